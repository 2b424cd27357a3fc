//! What a log holds, and how good it is.

use super::noise::ChannelNoise;
use serde::Serialize;

/// What was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Available {
    /// The valve command.
    pub command: bool,
    /// Pressure of chamber A.
    pub pressure_a: bool,
    /// Pressure of chamber B.
    pub pressure_b: bool,
    /// Supply pressure.
    pub supply: bool,
    /// External force.
    pub force: bool,
    /// A single-acting cylinder's chamber B breathes freely: its pressure is known, and tells nothing.
    #[serde(skip)]
    pub vented_b: bool,
}

/// Sampling and noise, as found in the log.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Quality {
    /// Number of usable samples.
    pub samples: usize,
    /// Rows left out because a measured column was blank.
    pub blank_rows: usize,
    /// Single readings left out, far from all their neighbours.
    pub isolated_readings: usize,
    /// Readings left out because they only repeat the one before: of a frozen sensor, or of a column held between its samples.
    pub repeated_readings: usize,
    /// Interruptions (missing rows), not bridged.
    pub interruptions: usize,
    /// Usual sampling interval, s.
    pub interval_s: f64,
    /// Standard deviation of the sampling interval relative to the usual one.
    pub jitter: f64,
    /// Position noise, m.
    pub position: ChannelNoise,
    /// Pressure noise of A, Pa.
    pub pressure_a: ChannelNoise,
    /// Pressure noise of B, Pa.
    pub pressure_b: ChannelNoise,
    /// Supply pressure noise, Pa.
    pub supply: ChannelNoise,
}
