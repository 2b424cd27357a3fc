//! Slow valve spool.
//!
//! Equation: `tau w' + w = u`
//!
//! Signature: flow follows the command late by an amount that depends on its frequency; the width of the loop flow(u) grows with rate
//!
//! Source: Festo MPYE catalogue: -3 dB at 115/95/80/70 Hz full stroke

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "valve-lag",
    title: "Slow valve spool",
    equation: "tau w' + w = u",
    signature: "flow follows the command late by an amount that depends on its frequency; the width of the loop flow(u) grows with rate",
    source: "Festo MPYE catalogue: -3 dB at 115/95/80/70 Hz full stroke",
    parameters: &[ParameterInfo {
        name: "time_constant_s",
        key: "effects.valve-lag.time_constant_s",
        min: 0.0,
        max: 0.2,
        typical: 0.01,
        meaning: "first-order time constant of the spool, s",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.spool_time_constant_s = values[0];
}
