//! Friction level changed.
//!
//! Equation: `F_c := scale F_c, F_s := scale F_s`
//!
//! Signature: the force residual is odd in velocity with a constant height
//!
//! Source: Canudas de Wit et al. 1995; worn or dry seals

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "coulomb-friction",
    title: "Friction level changed",
    equation: "F_c := scale F_c, F_s := scale F_s",
    signature: "the force residual is odd in velocity with a constant height",
    source: "Canudas de Wit et al. 1995; worn or dry seals",
    parameters: &[ParameterInfo {
        name: "scale",
        key: "effects.coulomb-friction.scale",
        min: 0.01,
        max: 20.0,
        typical: 1.3,
        meaning: "factor on F_c and F_s",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ONE, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.coulomb_n = model.coulomb_n * values[0];
    model.static_n = model.static_n * values[0];
}
