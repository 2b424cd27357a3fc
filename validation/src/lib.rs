//! Independent checks of `plant-model`.
//!
//! [`Reference`] is a second transcription of the equations, written from the paper and its errata alone: it shares no
//! code, no parameter structure and no mathematical library with `plant-model`. [`Reference::simulate`] integrates it
//! by one of two textbook methods at tolerances far below those of the simulator. Whatever is wrong in the right-hand side,
//! in its analytic Jacobian or in the stepper shows as a difference between the two. `validation/peers` compares the same
//! equations with a public solver library.
#![forbid(unsafe_code)]

mod equations;
mod inputs;
mod integrate;
mod integrators;

pub use equations::{NUMBER_OF_STATES, Reference, state};
pub use inputs::{OpenLoop, sampled};
pub use integrate::Method;
pub use integrators::StepTooSmall;
