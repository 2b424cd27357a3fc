//! Leak across the piston seal.
//!
//! Equation: `q = k (p_a - p_b), from A to B`
//!
//! Signature: both chambers drift towards each other while the valve is closed; what A loses B gains
//!
//! Source: laminar piston seal leak; Beater 2007

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "leak-cross-piston",
    title: "Leak across the piston seal",
    equation: "q = k (p_a - p_b), from A to B",
    signature: "both chambers drift towards each other while the valve is closed; what A loses B gains",
    source: "laminar piston seal leak; Beater 2007",
    parameters: &[ParameterInfo {
        name: "conductance_kg_per_s_pa",
        key: "effects.leak-cross-piston.conductance_kg_per_s_pa",
        min: 0.0,
        max: 1.0e-7,
        typical: 3.0e-10,
        meaning: "leak conductance k, kg/(s Pa)",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.leak_cross = values[0];
}
