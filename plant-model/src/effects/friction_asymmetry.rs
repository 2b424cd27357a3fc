//! Friction depends on direction.
//!
//! Equation: `g := g (1 + a sign v)`
//!
//! Signature: friction is larger in one direction; equal to a constant force a F_c except around standstill
//!
//! Source: Armstrong-Helouvry et al. 1994; single-lip seals

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "friction-asymmetry",
    title: "Friction depends on direction",
    equation: "g := g (1 + a sign v)",
    signature: "friction is larger in one direction; equal to a constant force a F_c except around standstill",
    source: "Armstrong-Helouvry et al. 1994; single-lip seals",
    parameters: &[ParameterInfo {
        name: "asymmetry",
        key: "effects.friction-asymmetry.asymmetry",
        min: -0.95,
        max: 0.95,
        typical: 0.25,
        meaning: "relative asymmetry a",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.asymmetry = values[0];
}
