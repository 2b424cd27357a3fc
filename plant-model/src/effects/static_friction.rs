//! Static friction changed.
//!
//! Equation: `F_s := static_n`
//!
//! Signature: the force residual sits only around standstill: breakaway needs more force, sliding does not
//!
//! Source: Stribeck curve (3.11); stiction after rest

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "static-friction",
    title: "Static friction changed",
    equation: "F_s := static_n",
    signature: "the force residual sits only around standstill: breakaway needs more force, sliding does not",
    source: "Stribeck curve (3.11); stiction after rest",
    parameters: &[ParameterInfo {
        name: "static_n",
        key: "effects.static-friction.static_n",
        min: 1.0e-3,
        max: 1.0e4,
        typical: 40.0,
        meaning: "static friction force F_s, N; taken as F_c where smaller",
    }],
};

pub(super) fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [rig.friction.static_n, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.static_n = values[0].at_least(model.coulomb_n);
}
