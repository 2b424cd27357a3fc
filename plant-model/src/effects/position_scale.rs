//! Position sensor gain error.
//!
//! Equation: `measured y = s y`
//!
//! Signature: velocity from the position sensor disagrees with the volume rate seen by the chamber pressures by a constant factor
//!
//! Source: calibration of the position sensor

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "position-scale",
    title: "Position sensor gain error",
    equation: "measured y = s y",
    signature: "velocity from the position sensor disagrees with the volume rate seen by the chamber pressures by a constant factor",
    source: "calibration of the position sensor",
    parameters: &[ParameterInfo {
        name: "scale",
        key: "effects.position-scale.scale",
        min: 0.2,
        max: 5.0,
        typical: 1.05,
        meaning: "sensor gain s",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ONE, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.position_scale = values[0];
}
