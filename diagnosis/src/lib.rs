//! Names the physical causes of the gap between a plant model and measured data.
//!
//! The known physics stays; every effect of the catalogue (`plant_model::Effect`) is a hypothesis that is fitted to the
//! log beside the nominal values, which are known within their tolerance only. A cause is named when it is needed, when
//! the balance it acts on is closed with it, and when the part of the log that was held back agrees.
//!
//! ```text
//! log ─ record ─ balances (mass A, mass B, force, supply) ─ fit ─ search ─ verdict, ties, advice
//!                 each predicts one channel from the others       └─ hold-out: the whole model, restarted
//! ```
#![forbid(unsafe_code)]

mod advice;
mod balance;
mod beyond;
mod diagnose;
mod errors;
mod extensions;
mod fit;
mod friction_map;
mod holdout;
mod hypothesis;
mod judgement;
mod noise;
mod one_pressure;
mod outcome;
mod predicted;
mod record;
mod residual;
mod ripple;
mod rugged;
mod search;
mod smooth;
mod starts;
mod terms;
mod worth;

pub use balance::Channel;
pub use beyond::{Description, MissingTerm};
pub use diagnose::{Diagnosis, DiagnosisError, Evidence, Hypothesised, LogSummary, diagnose};
pub use friction_map::{Finding, FrictionMap, FrictionMapError, FrictionRun, RippleLine, Stage, friction_map};
pub use holdout::Overlay;
pub use noise::ChannelNoise;
pub use outcome::{Balance, Calibration, Cause, Estimate, Gain, HoldOut, PerChannel};
pub use record::{Available, Quality};
pub use residual::{Curve, Dependence, Model, Peak, Quantity, Residuals, Spectrum};
