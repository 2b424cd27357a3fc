//! The part of the firmware that knows no hardware: it is the same on the board, under QEMU and on the desktop.
//!
//! ```text
//!            control interrupt                            background
//!  codes ─► ControlLoop::tick ─► valve code    Desk ◄─ requests (board-link)
//!               ▲    │                          │
//!    Order queue│    │record queue              │settings ◄─► ParameterStore (flash)
//!               │    ▼                          │
//!               │  telemetry                    ▼
//!               └──────────────────────────── orders        Supervisor ─► watchdog
//! ```
//!
//! | idea | file |
//! | --- | --- |
//! | one tick: setpoint, (bench plant,) control law, record, model monitor | `control_loop.rs` |
//! | where the setpoint goes | `course.rs` |
//! | whether the valve output shows what was written | `output_check.rs` |
//! | sums of oversampled conversions → codes | `oversampled.rs` |
//! | the simulated plant in place of sensors and valve | `bench.rs` |
//! | what one tick leaves for telemetry | `record.rs` |
//! | the last records, for a host that asks | `recent.rs` |
//! | the lines of telemetry | `telemetry_lines.rs` |
//! | what the background may read of the interrupt | `snapshot.rs` |
//! | parameters as one set, checked as a whole | `settings.rs` |
//! | parameters in flash | `store.rs`, `check.rs` |
//! | commands → answers and orders | `desk.rs` |
//! | codes in lock-step with a plant elsewhere | `lockstep.rs` |
//! | timing faults of the interrupt | `timing.rs` |
//! | whether the watchdog may be fed | `supervisor.rs` |
#![no_std]
#![forbid(unsafe_code)]

mod bench;
mod check;
mod control_loop;
mod course;
mod desk;
#[cfg(feature = "lockstep")]
pub mod lockstep;
mod output_check;
mod oversampled;
mod recent;
mod record;
mod settings;
mod snapshot;
mod store;
mod supervisor;
#[cfg(feature = "defmt")]
mod telemetry_lines;
mod timing;

pub use bench::BenchPlant;
pub use check::CHECK;
pub use control_loop::{ControlLoop, LoopTick, MonitorSetup, Order, Setup, SetupError};
pub use course::Course;
pub use desk::{Action, Desk, OrderOutcome};
pub use output_check::{OutputCheck, OutputSeen, tolerance as output_tolerance};
pub use oversampled::code_of_sum;
pub use parameter_table::ParameterError as SettingsError;
pub use recent::Recent;
pub use record::{Record, STOPPING, mode_from_number, mode_number};
pub use settings::{Kept, Settings};
pub use snapshot::{Snapshot, SnapshotValues};
pub use store::{LAYOUT as PARAMETER_LAYOUT, Loaded, ParameterStore, STORED_BYTES};
pub use supervisor::{DEAD_CHECKS, Progress, Supervisor, Verdict};
#[cfg(feature = "defmt")]
pub use telemetry_lines::{Scales, send as send_record, send_learned};
pub use timing::Timing;
