//! Scenarios, not scripts: one description of rig, effects, references, faults and expected bounds, run unchanged against
//! every way the control step can be executed.
//!
//! ```text
//! scenario.toml ─► runner: plant (f64) ─► sensors, noise, faults ─► codes ─┐
//!                    ▲                                                     ▼
//!                    └──── valve ◄── DAC code ◄──────────────────────── Target
//! ```
//!
//! [`HostTarget`] is the firmware's own loop on the desktop, [`emulated::EmulatedTarget`] the flashed ELF on the emulated chip. Another [`Target`] (QEMU, the flashed ELF, a board) sees the same
//! codes and must answer with the same ones: [`Outcome::fingerprint`] compares whole runs.
#![forbid(unsafe_code)]

pub mod emulated;
pub mod fault;
pub mod listing;
pub mod qemu;
pub mod reliability;
pub mod rig;
mod runner;
mod scenario;
mod sensors;
pub mod sound_twin;
mod target;

pub use runner::{Outcome, Sample, host_target, run, run_observed};
pub use scenario::{Deviation, Expect, ReferenceSegment, Scenario, ScheduledCommand, Start};
pub use target::{HostTarget, Target, TargetError, TickOutput};
