//! Filling conductance changed.
//!
//! Equation: `beta_fill := scale beta_fill`
//!
//! Signature: mass flow into a chamber is off by a constant factor whenever it fills, at all pressures, in both chambers
//!
//! Source: Valdiero et al. 2011 (3.3); clogged supply filter or undersized fitting

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "fill-coefficient",
    title: "Filling conductance changed",
    equation: "beta_fill := scale beta_fill",
    signature: "mass flow into a chamber is off by a constant factor whenever it fills, at all pressures, in both chambers",
    source: "Valdiero et al. 2011 (3.3); clogged supply filter or undersized fitting",
    parameters: &[ParameterInfo {
        name: "scale",
        key: "effects.fill-coefficient.scale",
        min: 0.05,
        max: 10.0,
        typical: 0.8,
        meaning: "factor on beta_fill",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ONE, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.fill = model.fill * values[0];
}
