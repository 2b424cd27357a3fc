//! The fifth-order model of a pneumatic servo positioner (Valdiero, Ritter, Rios, Rafikov 2011).
#![no_std]
#![forbid(unsafe_code)]

mod real;
mod rig;

pub use real::Real;
pub use rig::{Cylinder, Friction, Gas, Load, ParameterError, Rig, Supply, Valve};
