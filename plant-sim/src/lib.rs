//! The desktop side of the positioner: the plant and the firmware's control law in one loop, sweeps over it, foreign
//! data, and what the command line is made of.
//!
//! ```
//! use plant_sim::{ClosedLoop, LoopSettings, controller};
//! use rig_files::RigFile;
//!
//! let rig = RigFile::paper_a();
//! let parameters = controller::parameters(&rig);
//! let mut positioner = ClosedLoop::new(&rig, &parameters, &LoopSettings::default())?;
//! for _ in 0..3000 {
//!     positioner.tick(0.045);
//! }
//! assert!((positioner.position_m() - 0.045).abs() < 0.01);
//! # Ok::<(), plant_sim::LoopError>(())
//! ```
#![forbid(unsafe_code)]

pub mod board;
pub mod bound;
pub mod charts;
pub mod closed_loop;
pub mod commission;
pub mod datasheet;
pub mod emulated;
pub mod gap;
pub mod import;
pub mod learned;
pub mod metrics;
pub mod monitoring;
pub mod open_loop;
pub mod paper;
pub mod probe;
pub mod recording;
pub mod sensors;
pub mod servo;
pub mod stdio;
pub mod sweep;
pub mod telemetry;
pub mod update;

pub use rig_files::controller;

pub use closed_loop::{ClosedLoop, LoopError, LoopRecord, LoopSettings};
pub use metrics::{StepMetrics, StepObserver};
pub use monitoring::MonitorAction;
pub use sensors::{CodeNoise, ConversionNoise};
