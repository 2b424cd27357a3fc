//! Choked valve flow.
//!
//! Equation: `q = s C p_up psi(p_down/p_up) atan(2w), C = beta (p_sup - p_atm)/p_sup, psi = 1 up to b, sqrt(1 - ((r-b)/(1-b))^2) above`
//!
//! Signature: the flow error collapses on the pressure ratio p_down/p_up; a wrong coefficient does not
//!
//! Source: ISO 6358-1:2013

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "choked-flow",
    title: "Choked valve flow",
    equation: "q = s C p_up psi(p_down/p_up) atan(2w), C = beta (p_sup - p_atm)/p_sup, psi = 1 up to b, sqrt(1 - ((r-b)/(1-b))^2) above",
    signature: "the flow error collapses on the pressure ratio p_down/p_up; a wrong coefficient does not",
    source: "ISO 6358-1:2013",
    parameters: &[
        ParameterInfo {
            name: "critical_ratio",
            key: "effects.choked-flow.critical_ratio",
            min: 0.0,
            max: 0.9,
            typical: 0.3,
            meaning: "critical pressure ratio b",
        },
        ParameterInfo {
            name: "conductance_scale",
            key: "effects.choked-flow.conductance_scale",
            min: 0.05,
            max: 10.0,
            typical: 1.0,
            meaning: "factor s on both conductances; 1 gives the linear law's flow at full pressure drop",
        },
    ],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    // A critical ratio below zero stands for the linear law: see `Coefficients::choked`.
    [-R::ONE, R::ONE, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    if values[0] >= R::ZERO {
        model.choked = Some((values[0], values[1]));
    }
}
