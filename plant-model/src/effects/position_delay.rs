//! Position signal late against the pressures.
//!
//! Equation: `measured y(t) = y(t - tau)`
//!
//! Signature: compression by motion shows in the pressures before the measured motion
//!
//! Source: bus or encoder interface latency

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "position-delay",
    title: "Position signal late against the pressures",
    equation: "measured y(t) = y(t - tau)",
    signature: "compression by motion shows in the pressures before the measured motion",
    source: "bus or encoder interface latency",
    parameters: &[ParameterInfo {
        name: "delay_s",
        key: "effects.position-delay.delay_s",
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
    model.position_delay_s = values[0];
}
