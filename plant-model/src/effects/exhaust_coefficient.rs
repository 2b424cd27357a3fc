//! Exhaust conductance changed.
//!
//! Equation: `beta_exh := scale beta_exh`
//!
//! Signature: mass flow out of a chamber is off by a constant factor whenever it exhausts, at all pressures, in both chambers
//!
//! Source: Valdiero et al. 2011 (3.3); clogged silencer

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "exhaust-coefficient",
    title: "Exhaust conductance changed",
    equation: "beta_exh := scale beta_exh",
    signature: "mass flow out of a chamber is off by a constant factor whenever it exhausts, at all pressures, in both chambers",
    source: "Valdiero et al. 2011 (3.3); clogged silencer",
    parameters: &[ParameterInfo {
        name: "scale",
        key: "effects.exhaust-coefficient.scale",
        min: 0.05,
        max: 10.0,
        typical: 0.8,
        meaning: "factor on beta_exh",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ONE, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.exhaust = model.exhaust * values[0];
}
