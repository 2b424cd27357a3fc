//! Friction grows with chamber pressure.
//!
//! Equation: `g := g + k (p_a + p_b - 2 p_atm)`
//!
//! Signature: the odd force residual grows with the sum of the chamber pressures
//!
//! Source: seal lips loaded by chamber pressure; Belforte et al. 2003

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "friction-pressure",
    title: "Friction grows with chamber pressure",
    equation: "g := g + k (p_a + p_b - 2 p_atm)",
    signature: "the odd force residual grows with the sum of the chamber pressures",
    source: "seal lips loaded by chamber pressure; Belforte et al. 2003",
    parameters: &[ParameterInfo {
        name: "coefficient_n_per_pa",
        key: "effects.friction-pressure.coefficient_n_per_pa",
        min: 0.0,
        max: 1.0e-2,
        typical: 2.0e-5,
        meaning: "coefficient k, N/Pa",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.pressure_friction = values[0];
}
