//! Why a log cannot be diagnosed.

use crate::constants;

/// The least usable data.
pub(crate) const LEAST_SAMPLES: usize = 200;
/// Why a log cannot be diagnosed at all.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum DiagnosisError {
    /// Too few complete samples.
    #[error(
        "the log has {found} samples in which all its measured columns have a value; at least {LEAST_SAMPLES} are needed: \
         record longer, or leave out the column with the blanks"
    )]
    TooShort {
        /// Complete samples found.
        found: usize,
    },
    /// Complete samples, but none in a row.
    #[error(
        "the log is interrupted so often that no {} s of it hang together: record without losing rows, or \
         leave out the column with the blanks",
        constants::shortest_stretch_s()
    )]
    TooBroken,
    /// The log contradicts the rig file or itself.
    #[error("{problem}: {remedy}")]
    Contradiction {
        /// What was found.
        problem: String,
        /// What to do about it.
        remedy: String,
    },
    /// No balance can be formed.
    #[error(
        "the log has no combination of columns that makes a balance: add u_v with p_a_pa or p_b_pa (mass balance), or both \
         pressures (force balance)"
    )]
    NothingToJudge,
    /// Without a command only the force balance could be formed, and nothing moves.
    #[error("without u_v only the mechanics could be judged, and the piston hardly moves: add u_v, or record strokes")]
    Still,
    /// The rig file contradicts itself.
    #[error("the rig cannot be simulated: {0}")]
    Rig(plant_model::ParameterError),
}
