//! Valve hysteresis.
//!
//! Equation: `play operator of half-width h on u, before the spool`
//!
//! Signature: the loop flow(u) has a width that does not depend on rate
//!
//! Source: Festo MPYE catalogue: at most 0.4 % of stroke; Visintin 1994 (play operator)

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "valve-hysteresis",
    title: "Valve hysteresis",
    equation: "play operator of half-width h on u, before the spool",
    signature: "the loop flow(u) has a width that does not depend on rate",
    source: "Festo MPYE catalogue: at most 0.4 % of stroke; Visintin 1994 (play operator)",
    parameters: &[ParameterInfo {
        name: "half_width_v",
        key: "effects.valve-hysteresis.half_width_v",
        min: 0.0,
        max: 2.0,
        typical: 0.1,
        meaning: "half-width of the play, V",
    }],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.play_half_width_v = values[0];
}
