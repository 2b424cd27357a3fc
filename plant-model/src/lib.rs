//! The fifth-order model of a pneumatic servo positioner (Valdiero, Ritter, Rios, Rafikov 2011), as one source for the
//! desktop and the microcontroller.
//!
//! ```text
//!  command u ─ delay ─ play ─ spool lag ─ dead zone ─ valve flow ─ chamber pressures ─ motion ─ sensors
//!              └────────── command path ──────────┘   (3.2, 3.3)      (3.6, 3.7)     (3.8…3.12)
//! ```
//!
//! - [`Rig`] holds nominal parameters, [`Effects`] what a real rig adds to the paper; [`Plant`] combines both.
//! - [`Plant::derivative`] is the right-hand side, written once and generic over `f32` and `f64`.
//! - [`Stepper`] integrates it; [`Simulator`] adds the command path and the sensors and is what most callers want.
//!
//! Equation numbers are the paper's; `docs/model.md` lists where the paper is wrong and what it leaves out.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod chamber;
mod coefficients;
mod command_path;
pub mod cushion;
pub mod dead_zone;
pub mod effects;
mod equilibrium;
mod flow;
pub mod friction;
pub mod hose;
mod measurement;
mod opening;
mod opening_table;
mod plant;
mod real;
mod rig;
mod right_hand_side;
mod rosenbrock;
mod sensors;
pub mod similarity;
mod simulator;
mod stepper;
pub mod tube;
pub mod valve_flow;

pub use coefficients::{Coefficients, ValvePaths};
pub use effects::opening_curve::OpeningParabola;
pub use effects::wall_heat::{Law as WallHeatLaw, Walls};
pub use effects::{Added, ChamberFlow, Effect, Effects, FirstOrderLag, Force, Side};
pub use measurement::Measurement;
pub use opening::OpeningCurve;
pub use opening_table::{OPENING_POINTS, OpeningPoints, OpeningTable, Piece as OpeningPiece};
pub use plant::{GRAVITY_M_PER_S2, Inputs, MINIMUM_VOLUME_RATIO, Plant, State};
pub use real::Real;
pub use rig::{
    BOTH_SIDES, Cylinder, Friction, Gas, Hoses, Limits, Load, Must, ParameterError, Place, RIG_KEYS, RIG_NUMBERS, Rig,
    RigKey, Short, Supply, Valve, all_keys, rig_key,
};
pub use simulator::Simulator;
pub use stepper::{Stepper, Tolerance};
