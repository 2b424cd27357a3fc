//! Names the physical causes of the gap between a plant model and measured data.
//!
//! The known physics stays. Every effect of the catalogue (`plant_model::Effect`) is a hypothesis. It is fitted to the
//! log together with the nominal values, which are known within their tolerance only. A cause is named if the fit needs
//! it, if the balance it acts on is closed with it, and if the part of the log that was held back confirms it.
//!
//! ```text
//! data ─ balances (mass A, mass B, force, supply) ─ estimate ─ select ─ validate ─ explain
//!        each predicts one channel from the others                      └─ hold-out: the whole model, restarted
//! ```
//!
//! Statistics in the field's notation: `docs/diagnosis-statistics.md`. Terms: `docs/glossary.md`.
#![forbid(unsafe_code)]

mod balances;
mod check;
pub mod constants;
mod data;
mod diagnose;
mod errors;
mod estimate;
mod explain;
mod friction;
mod model;
mod one_pressure;
mod outcome;
mod select;
mod statistics;
mod validate;

pub use check::{Check, Flaw, Knowledge, Weight, Window, check, most_telling};
pub use data::channel::Channel;
pub use data::noise::ChannelNoise;
pub use data::quality::{Available, Quality};
pub use diagnose::diagnose;
pub use errors::DiagnosisError;
pub use explain::residuals::{Curve, Model, Quantity, Residuals, Spectrum};
pub use friction::{Finding, FrictionMap, FrictionMapError, FrictionRun, OffCentre, RippleLine, Stage, friction_map};
pub use outcome::{
    Balance, Calibration, Cause, Dependence, Description, Diagnosis, Estimate, Evidence, Gain, HoldOut, Hypothesised,
    LogSummary, MissingTerm, Overlay, Peak, PerChannel, Standing, Supported,
};
