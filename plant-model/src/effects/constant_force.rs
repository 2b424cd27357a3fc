//! Constant force on the piston.
//!
//! Equation: `M v' = A (p_a - p_b) - F - F_0`
//!
//! Signature: the force residual has the same value in both directions of motion and at rest
//!
//! Source: incline, gravity, spring balance

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "constant-force",
    title: "Constant force on the piston",
    equation: "M v' = A (p_a - p_b) - F - F_0",
    signature: "the force residual has the same value in both directions of motion and at rest",
    source: "incline, gravity, spring balance",
    parameters: &[ParameterInfo {
        name: "force_n",
        key: "effects.constant-force.force_n",
        min: -1.0e4,
        max: 1.0e4,
        typical: 8.0,
        meaning: "force F_0 opposing positive motion, N",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.constant_force_n = values[0];
}
