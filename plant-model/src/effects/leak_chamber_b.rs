//! Leak of chamber B to atmosphere.
//!
//! Equation: `q = k (p - p_atm), out of the chamber`
//!
//! Signature: chamber B keeps losing mass while the valve is closed, in proportion to its gauge pressure; the other chamber gains nothing
//!
//! Source: laminar seal or fitting leak; Beater 2007

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "leak-chamber-b",
    title: "Leak of chamber B to atmosphere",
    equation: "q = k (p - p_atm), out of the chamber",
    signature: "chamber B keeps losing mass while the valve is closed, in proportion to its gauge pressure; the other chamber gains nothing",
    source: "laminar seal or fitting leak; Beater 2007",
    parameters: &[ParameterInfo {
        name: "conductance_kg_per_s_pa",
        key: "effects.leak-chamber-b.conductance_kg_per_s_pa",
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
    model.leak_b = values[0];
}
