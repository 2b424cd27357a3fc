//! Viscous friction changed.
//!
//! Equation: `sigma2 := coefficient`
//!
//! Signature: the force residual is proportional to velocity
//!
//! Source: Valdiero et al. 2011 (3.9); lubricant, temperature

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "viscous-friction",
    title: "Viscous friction changed",
    equation: "sigma2 := coefficient",
    signature: "the force residual is proportional to velocity",
    source: "Valdiero et al. 2011 (3.9); lubricant, temperature",
    parameters: &[ParameterInfo {
        name: "coefficient_n_s_per_m",
        key: "effects.viscous-friction.coefficient_n_s_per_m",
        min: 0.0,
        max: 1.0e4,
        typical: 60.0,
        meaning: "viscous coefficient sigma2, N s/m",
    }],
};

pub(super) fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [rig.friction.viscous_n_s_per_m, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.viscous = values[0];
}
