//! What a log can and cannot tell, before anything is fitted: whether its columns fit together and fit the rig, whether they
//! show enough, and how well each parameter would be known from them.

mod channels;
mod direction;
pub(crate) mod information;
pub(crate) mod mapping;

use crate::data::cleaned::Cleaned;
use crate::data::prepare::prepare;
use crate::errors::{DiagnosisError, LEAST_SAMPLES};
pub use information::{Knowledge, Window};
use plant_model::Plant;
use rig_files::{Log, RigFile};
use serde::Serialize;

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    /// The log contradicts the rig file or itself: nothing found in it would mean anything.
    Contradiction,
    /// Part of the log, or some questions, are lost.
    Loss,
}

/// Something that is wrong with a log, or missing in it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Flaw {
    /// How much it matters.
    pub weight: Weight,
    /// What was found.
    pub problem: String,
    /// What to do about it.
    pub remedy: String,
}

/// What a log can tell.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// What is wrong or missing, the gravest first.
    pub findings: Vec<Flaw>,
    /// How well each parameter would be known; empty where a contradiction makes that meaningless.
    pub knowledge: Vec<Knowledge>,
}

/// Checks a log against a rig without fitting anything.
///
/// # Errors
/// If the log allows no judgement at all.
pub fn check(rig: &RigFile, log: &Log) -> Result<Check, DiagnosisError> {
    Plant::new(&rig.rig, &rig.effects).map_err(DiagnosisError::Rig)?;
    let Cleaned { log, repeats, outliers, hums } = &Cleaned::of(log);
    let rows = prepare(log, rig);
    let mut findings: Vec<Flaw> = mapping::contradictions(rig, log, &rows);
    if findings.is_empty() && rows.len() < LEAST_SAMPLES {
        return Err(DiagnosisError::TooShort { found: rows.len() });
    }
    let knowledge = if findings.is_empty() { information::knowledge(rig, log) } else { Vec::new() };
    if findings.is_empty() {
        findings.extend(mapping::supply_in_doubt(rig, log));
    }
    findings.extend(repeats.iter().map(channels::repeats));
    findings.extend(channels::isolated(outliers));
    findings.extend(hums.iter().map(channels::hum));
    findings.extend(channels::losses(rig, log, &rows));
    findings.sort_by_key(|finding| finding.weight);
    Ok(Check { findings, knowledge })
}

/// The windows of a planned recording, by what each adds to the knowledge that `check` found lacking; best first.
#[must_use]
pub fn most_telling(rig: &RigFile, known: &[Knowledge], planned: &Log, window_s: f64) -> Vec<Window> {
    information::windows(rig, known, planned, window_s)
}
