//! Independent checks of `plant-model`.
//!
//! [`Reference`] is a second transcription of the equations, written from the paper and its errata alone: it shares no
//! code, no parameter structure and no mathematical library with `plant-model`. [`Reference::simulate`] integrates it
//! with diffsol, a general-purpose library of stiff solvers, at tolerances far below those of the simulator. Whatever
//! is wrong in the right-hand side, in its analytic Jacobian or in the stepper shows as a difference between the two.
#![forbid(unsafe_code)]

mod equations;
mod inputs;
mod integrate;

pub use equations::{NUMBER_OF_STATES, Reference, state};
pub use inputs::{OpenLoop, sampled};
pub use integrate::{Method, SolverError};
