//! Delay in the command path.
//!
//! Equation: `the valve acts on u(t - tau)`
//!
//! Signature: flow follows the command late by the same time at every frequency
//!
//! Source: hose transport or driver latency

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "line-delay",
    title: "Delay in the command path",
    equation: "the valve acts on u(t - tau)",
    signature: "flow follows the command late by the same time at every frequency",
    source: "hose transport or driver latency",
    parameters: &[ParameterInfo {
        name: "delay_s",
        key: "effects.line-delay.delay_s",
        min: 0.0,
        max: 0.1,
        typical: 0.01,
        meaning: "delay tau, s",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.line_delay_s = values[0];
}
