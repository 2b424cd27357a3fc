//! Pressure sensor B offset.
//!
//! Equation: `measured p_b = p_b + b`
//!
//! Signature: a constant force and, at once, a constant error of p_b in the flow law; gravity is only the first
//!
//! Source: calibration or ageing of the pressure sensor

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "pressure-b-offset",
    title: "Pressure sensor B offset",
    equation: "measured p_b = p_b + b",
    signature: "a constant force and, at once, a constant error of p_b in the flow law; gravity is only the first",
    source: "calibration or ageing of the pressure sensor",
    parameters: &[ParameterInfo {
        name: "offset_pa",
        key: "effects.pressure-b-offset.offset_pa",
        min: -2.0e5,
        max: 2.0e5,
        typical: 1.5e4,
        meaning: "offset b, Pa",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.pressure_b_offset_pa = values[0];
}
