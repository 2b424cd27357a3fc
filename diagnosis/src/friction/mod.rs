//! Friction from logs with a measured force, and on what it depends. The unit of inference is the recording.
//!
//! Where position, one chamber pressure and the force at the rod are measured and the motion is slow, the force balance
//! needs no valve: `r = A (p_a - p_b) + f_ext` is friction (with the sign of the motion) plus any force that keeps its
//! sign. Half the difference of the two directions is friction, half the sum is the rest. Recordings of the same rig at
//! several pressures are the unit of inference: what differs from one run to the next for unknown reasons (temperature,
//! grease, sensor zero) is the same for all samples of a run, so these count as one observation.
//!
//! ```text
//! sliding: log -> samples and summary ─ regression: figures of the recordings on pressure and speed
//!                                     ├ models: which dependences hold on recordings left out
//!                                     └ ripple: what repeats itself along the stroke
//! ```

mod models;
mod regression;
mod ripple;
mod sliding;

pub use models::{OffCentre, Stage};
pub use regression::Finding;
pub use ripple::RippleLine;
pub use sliding::FrictionRun;

use models::Models;
use rig_files::{Log, RigFile};
use serde::Serialize;

/// Why no friction map can be made.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum FrictionMapError {
    /// A column is missing.
    #[error("has no column `{column}`: a friction map needs y_m, f_ext_n and at least one of p_a_pa and p_b_pa")]
    Missing {
        /// Which log, counted from 0.
        log: usize,
        /// Its name.
        column: &'static str,
    },
    /// Friction drives the piston.
    #[error(
        "has a force that drives the piston where friction holds it back: turn `sign` under [column.f_ext_n] in the mapping, as f_ext_n counts towards +y"
    )]
    Reversed {
        /// Which log, counted from 0.
        log: usize,
    },
    /// The piston does not slide in both directions.
    #[error("has too little sliding in one direction: record strokes in both directions at a slow, steady speed")]
    NoMotion {
        /// Which log, counted from 0.
        log: usize,
    },
}

/// What friction depends on. A finding is established if it exceeds the scatter between the recordings (1 % level) and
/// improves the prediction of recordings left out.
#[derive(Clone, Debug, Serialize)]
pub struct FrictionMap {
    /// The recordings.
    pub runs: Vec<FrictionRun>,
    /// Friction at no pressure, N.
    pub friction_n: Finding,
    /// Growth of friction with the sum of both gauge pressures, N/Pa.
    pub pressure_n_per_pa: Finding,
    /// Growth of friction with speed, N s/m: inside the recordings where their speed varies, else between them at equal
    /// pressure.
    pub speed_n_s_per_m: Finding,
    /// Whether [`Self::speed_n_s_per_m`] was seen inside the recordings.
    pub speed_inside_recordings: bool,
    /// Force that keeps its sign when the motion reverses, N: the same at every pressure.
    pub bias_n: Finding,
    /// Area on which the pressure acts, relative to the rig file's, minus one; a gain of the force sensor looks alike.
    pub area_error: Finding,
    /// Friction towards +y relative to its mean of both directions, minus one.
    pub asymmetry: Finding,
    /// What the force that keeps its sign is, most likely.
    pub off_centre: Option<OffCentre>,
    /// What else it may be: as likely within the recordings' scatter.
    pub off_centre_ties: Vec<OffCentre>,
    /// The ripple, if a line stands out.
    pub ripple: Option<RippleLine>,
    /// Models in order, each on runs left out.
    pub stages: Vec<Stage>,
    /// Spectrum of the ripple: wavelength, m, and explained part of the variance.
    #[serde(skip)]
    pub spectrum: Vec<(f64, f64)>,
    /// Per run: position, m, signed residual force, N, and direction of motion.
    #[serde(skip)]
    pub scatter: Vec<Vec<(f64, f64, f64)>>,
}

/// Maps friction from recordings of one rig, best at several pressures.
///
/// # Errors
/// A log lacks a column or does not slide in both directions.
pub fn friction_map(rig: &RigFile, logs: &[&Log]) -> Result<FrictionMap, FrictionMapError> {
    let mut runs =
        logs.iter().enumerate().map(|(place, log)| sliding::run(rig, log, place)).collect::<Result<Vec<_>, _>>()?;
    let (line, spectrum) = ripple::ripple(&runs);
    let line = line.map(|line| ripple::confirmed(line, &runs));
    if let Some(line) = &line {
        for run in &mut runs {
            let part = run.samples.iter().collect::<Vec<_>>();
            let (a, b) = ripple::phase(&part, line.wavelength_m, line.turns_with_motion);
            run.summary.ripple_n = a.hypot(b);
        }
    }
    let models = Models::new(&runs, rig.rig.cylinder.mean_area_m2(), line.as_ref());
    Ok(FrictionMap {
        friction_n: models.friction_n,
        pressure_n_per_pa: models.pressure_n_per_pa,
        speed_n_s_per_m: models.speed_n_s_per_m,
        speed_inside_recordings: models.speed_inside_recordings,
        bias_n: models.bias_n,
        area_error: models.area_error,
        asymmetry: models.asymmetry,
        off_centre: models.off_centre,
        off_centre_ties: models.off_centre_ties,
        stages: models.stages,
        scatter: runs.iter().map(|run| run.samples.iter().map(|s| (s.y, s.r, s.direction)).collect()).collect(),
        runs: runs.into_iter().map(|run| run.summary).collect(),
        ripple: line.filter(|line| line.holds(logs.len())),
        spectrum,
    })
}
