//! Unstated dead volume.
//!
//! Equation: `V_a0 := V_a0 + V, V_b0 := V_b0 + V`
//!
//! Signature: pressures change too slowly by a factor that is largest where the chamber is smallest; flow at standstill and compression by motion are affected alike
//!
//! Source: hoses and fittings between valve and cylinder

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "dead-volume",
    title: "Unstated dead volume",
    equation: "V_a0 := V_a0 + V, V_b0 := V_b0 + V",
    signature: "pressures change too slowly by a factor that is largest where the chamber is smallest; flow at standstill and compression by motion are affected alike",
    source: "hoses and fittings between valve and cylinder",
    parameters: &[ParameterInfo {
        name: "volume_m3",
        key: "effects.dead-volume.volume_m3",
        min: 0.0,
        max: 1.0e-2,
        typical: 5.0e-5,
        meaning: "volume added to each chamber, m3",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.volume_a0_m3 += values[0];
    model.volume_b0_m3 += values[0];
}
