//! What a board measures over a while, asked for by `status`: averages, noise and drift.

use crate::board::{BoardError, Client};
use board_link::{Command, Reply, Status, Version};
use firmware_core::Settings;
use std::io::{Read, Write};

/// Highest ADC and DAC codes of the board.
pub const TOP_CODE: f64 = 65_535.0;
const TOP_DAC_CODE: f64 = 4095.0;

/// One number watched over a while.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Signal {
    /// Average.
    pub mean: f64,
    /// Standard deviation about the two halves' averages, so that a slow drift is no noise.
    pub noise: f64,
    /// Average of the second half minus that of the first.
    pub drift: f64,
    /// Standard error of the drift that the noise makes.
    pub drift_error: f64,
}

impl Signal {
    /// Of samples in the order of time; zero without any.
    #[must_use]
    pub fn of(samples: &[f64]) -> Self {
        let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
        let (first, second) = samples.split_at(samples.len() / 2);
        let about = |part: &[f64]| part.iter().map(|x| (x - mean(part)).powi(2)).sum::<f64>();
        let degrees = samples.len().saturating_sub(2).max(1) as f64;
        let noise = ((about(first) + about(second)) / degrees).sqrt();
        Self {
            mean: mean(samples),
            noise,
            drift: mean(second) - mean(first),
            drift_error: noise * (1.0 / first.len().max(1) as f64 + 1.0 / second.len().max(1) as f64).sqrt(),
        }
    }
}

/// What was watched.
#[derive(Clone, Debug, Default)]
pub struct Observation {
    /// Every answer.
    pub statuses: Vec<Status>,
}

impl Observation {
    /// One channel's codes: position, p_a, p_b, p_sup.
    #[must_use]
    pub fn codes(&self, channel: usize) -> Signal {
        let code = |status: &Status| f64::from(status.codes.get(channel).copied().unwrap_or_default());
        Signal::of(&self.statuses.iter().map(code).collect::<Vec<_>>())
    }

    /// The last so many answers, if there are that many.
    #[must_use]
    pub fn last(&self, count: usize) -> Option<Self> {
        let first = self.statuses.len().checked_sub(count)?;
        Some(Self { statuses: self.statuses.get(first..)?.to_vec() })
    }

    /// The valve voltage about mid that the board commands, V.
    #[must_use]
    pub fn valve_v(&self, settings: &Settings) -> Signal {
        let [low, high] = settings.control_parameters().valve_range_v.map(f64::from);
        let volts = |status: &Status| low + (high - low) * f64::from(status.dac_code) / TOP_DAC_CODE;
        Signal::of(&self.statuses.iter().map(volts).collect::<Vec<_>>())
    }

    /// One channel as a quantity, as calibrated: m or Pa.
    #[must_use]
    pub fn quantity(&self, settings: &Settings, channel: usize) -> Signal {
        let ranges = settings.control_parameters().calibrated_ranges();
        let [low, high] = ranges.get(channel).copied().unwrap_or_default();
        let (codes, unit) = (self.codes(channel), (high - low) / TOP_CODE);
        Signal {
            mean: low + unit * codes.mean,
            noise: unit.abs() * codes.noise,
            drift: unit * codes.drift,
            drift_error: unit.abs() * codes.drift_error,
        }
    }
}

/// One answer to `status`.
///
/// # Errors
/// No answer.
pub fn status<P: Read + Write>(client: &mut Client<P>) -> Result<Status, BoardError> {
    match client.ask(Command::Status)? {
        Reply::Status(status) => Ok(status),
        _ => Err(BoardError::Unexpected),
    }
}

/// One answer to `version`.
///
/// # Errors
/// No answer.
pub fn version<P: Read + Write>(client: &mut Client<P>) -> Result<Version, BoardError> {
    match client.ask(Command::Version)? {
        Reply::Version(version) => Ok(version),
        _ => Err(BoardError::Unexpected),
    }
}

/// Watches for so many ticks of the board, its own time.
///
/// # Errors
/// No answer.
pub fn ticks<P: Read + Write>(client: &mut Client<P>, ticks: u32) -> Result<Observation, BoardError> {
    let mut seen = Observation::default();
    loop {
        let status = status(client)?;
        let begun = seen.statuses.first().map_or(status.ticks, |first| first.ticks);
        let over = status.ticks.wrapping_sub(begun) >= ticks;
        seen.statuses.push(status);
        // A tick that stands still would keep this waiting for ever.
        if over || seen.statuses.len() > ticks as usize + 10 {
            return Ok(seen);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_drift_and_an_alternation_is_noise() {
        let ramp = Signal::of(&[0.0, 1.0, 2.0, 3.0]);
        assert_eq!((ramp.mean, ramp.drift), (1.5, 2.0));
        let noise = Signal::of(&[1.0, -1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0]);
        assert_eq!((noise.mean, noise.drift), (0.0, 0.0));
        assert!((noise.noise - 1.155).abs() < 0.001, "{noise:?}");
    }
}
