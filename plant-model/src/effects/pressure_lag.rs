//! Slow pressure sensors.
//!
//! Equation: `tau p_m' + p_m = p, both channels`
//!
//! Signature: measured pressure follows the flow and the motion late, more so when fast; the force balance lags the acceleration
//!
//! Source: sensor tubing or filter

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "pressure-lag",
    title: "Slow pressure sensors",
    equation: "tau p_m' + p_m = p, both channels",
    signature: "measured pressure follows the flow and the motion late, more so when fast; the force balance lags the acceleration",
    source: "sensor tubing or filter",
    parameters: &[ParameterInfo {
        name: "time_constant_s",
        key: "effects.pressure-lag.time_constant_s",
        min: 0.0,
        max: 0.2,
        typical: 0.01,
        meaning: "time constant tau of both channels, s",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.pressure_time_constant_s = values[0];
}
