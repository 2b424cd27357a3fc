//! Two-point calibration of a channel: two states of the rig that are known otherwise, and what the sensor reads in each.
//!
//! The reading of the sensor's stated range, `r = low + code / 65535 · (high − low)`, becomes `offset + gain · r`, so that both
//! points read what they are: `gain = (x2 − x1) / (r2 − r1)`, `offset = x1 − gain · r1`.

use super::Change;
use super::observe::{Observation, Signal, TOP_CODE, status};
use crate::board::{BoardError, Client};
use board_link::Parameter;
use firmware_core::Settings;
use std::io::{Read, Write};

/// Answers averaged per point: noise of 40 codes (600 Pa of 10 bar) leaves 5.
const SAMPLES: usize = 64;
/// Most noise of a quantity at rest, in codes: half a percent of the range.
const RESTLESS: f64 = 328.0;
/// A drift of fewer codes is none.
const DRIFT: f64 = 20.0;
/// Codes this near to an end are a broken wire or a sensor at its limit.
const RAIL: f64 = 16.0;
/// The points are at least this part of the range apart: less, and the noise of the points makes the gain.
const APART: f64 = 0.1;
/// Corrections beyond this are told: sensors are better, so the stated range may be wrong.
const UNUSUAL: f64 = 0.05;

/// A sensor's channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Piston position.
    Position,
    /// Pressure of chamber A.
    PressureA,
    /// Pressure of chamber B.
    PressureB,
    /// Supply pressure.
    Supply,
}

impl Channel {
    /// Its place among the codes.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }

    /// Its unit.
    #[must_use]
    pub const fn unit(self) -> &'static str {
        if matches!(self, Self::Position) { "m" } else { "Pa" }
    }

    /// In words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::PressureA => "pressure of chamber A",
            Self::PressureB => "pressure of chamber B",
            Self::Supply => "supply pressure",
        }
    }

    /// Its offset and gain.
    #[must_use]
    pub const fn parameters(self) -> [Parameter; 2] {
        match self {
            Self::Position => [Parameter::PositionOffset, Parameter::PositionGain],
            Self::PressureA => [Parameter::PressureAOffset, Parameter::PressureAGain],
            Self::PressureB => [Parameter::PressureBOffset, Parameter::PressureBGain],
            Self::Supply => [Parameter::SupplyOffset, Parameter::SupplyGain],
        }
    }

    /// The ends of its sensor's stated range.
    #[must_use]
    pub const fn range(self) -> [Parameter; 2] {
        match self {
            Self::Position => [Parameter::PositionLow, Parameter::PositionHigh],
            _ => [Parameter::PressureLow, Parameter::PressureHigh],
        }
    }
}

/// A known state, and what the converter delivered in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// What it is, m or Pa absolute.
    pub value: f64,
    /// What was measured, in codes.
    pub codes: Signal,
}

/// Why there is no calibration.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationError {
    /// The board.
    Board(BoardError),
    /// The measurement is not what it should be: a sentence with the remedy.
    Implausible(String),
}

impl From<BoardError> for CalibrationError {
    fn from(error: BoardError) -> Self {
        Self::Board(error)
    }
}

fn implausible<T>(text: String) -> Result<T, CalibrationError> {
    Err(CalibrationError::Implausible(text))
}

/// Measures a channel that rests at `value`.
///
/// # Errors
/// No answer; bench mode; a reading at an end of the converter, or one that does not rest.
pub fn measure<P: Read + Write>(
    client: &mut Client<P>,
    channel: Channel,
    value: f64,
) -> Result<Point, CalibrationError> {
    let mut seen = Observation::default();
    for _ in 0..SAMPLES {
        let status = status(client)?;
        if status.bench {
            return implausible("in bench mode the simulated cylinder is read; switch it off: `bench off`".into());
        }
        seen.statuses.push(status);
    }
    let (codes, name) = (seen.codes(channel.index()), channel.name());
    if !(RAIL..=TOP_CODE - RAIL).contains(&codes.mean) {
        return implausible(format!(
            "the {name} reads code {:.0}, an end of the converter: a broken wire, or a sensor beyond its range; check the wiring \
             (docs/wiring.md)",
            codes.mean
        ));
    }
    if codes.noise > RESTLESS || codes.drift.abs() > DRIFT + 4.0 * codes.drift_error {
        return implausible(format!(
            "the {name} does not rest: code {:.0}, noise {:.1}, drift {:+.1} codes; hold it still, wait, and try again",
            codes.mean, codes.noise, codes.drift
        ));
    }
    Ok(Point { value, codes })
}

/// Offset and gain that make both points read what they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Which channel.
    pub channel: Channel,
    /// What was measured.
    pub points: [Point; 2],
    /// What the points read by the stated range alone.
    pub readings: [f64; 2],
    /// Added to the reading times the gain, m or Pa.
    pub offset: f64,
    /// Factor on the reading.
    pub gain: f64,
}

impl Calibration {
    /// Computes them, for a board with these settings.
    ///
    /// # Errors
    /// A sentence: the points are too near to each other, or the gain they make is that of another sensor.
    pub fn of(settings: &Settings, channel: Channel, points: [Point; 2]) -> Result<Self, CalibrationError> {
        let [low, high] = channel.range().map(|end| f64::from(settings.get(end)));
        let [low_key, high_key] = channel.range().map(Parameter::name);
        let readings = points.map(|point| low + (high - low) * point.codes.mean / TOP_CODE);
        let codes_apart = (points[1].codes.mean - points[0].codes.mean) / TOP_CODE;
        if codes_apart.abs() < APART {
            return implausible(format!(
                "both points read almost the same ({:.4} and {:.4} {unit}); take two at least {:.4} {unit} apart",
                readings[0],
                readings[1],
                APART * (high - low),
                unit = channel.unit()
            ));
        }
        let gain = (points[1].value - points[0].value) / (readings[1] - readings[0]);
        let offset = points[0].value - gain * readings[0];
        if gain < 0.0 {
            return implausible(format!(
                "the {} falls where it should rise: the two values are exchanged, or the sensor is mounted or wired the other \
                 way round",
                channel.name()
            ));
        }
        let [offset_key, gain_key] = channel.parameters();
        if gain_key.check(gain as f32).is_err() || offset_key.check(offset as f32).is_err() {
            return implausible(format!(
                "the sensor's range is not {low} to {high} {}: gain {gain:.3} and offset {offset:.4} are beyond what a calibration \
                 corrects; set `{low_key}` and `{high_key}` first",
                channel.unit()
            ));
        }
        Ok(Self { channel, points, readings, offset, gain })
    }

    /// Whether the correction is larger than sensors usually need.
    #[must_use]
    pub fn unusual(&self, settings: &Settings) -> bool {
        let [low, high] = self.channel.range().map(|end| f64::from(settings.get(end)));
        (self.gain - 1.0).abs() > UNUSUAL || self.offset.abs() > UNUSUAL * (high - low)
    }

    /// Standard error of a corrected reading near the points, from the noise of the two averages; m or Pa.
    #[must_use]
    pub fn error(&self, settings: &Settings) -> f64 {
        let [low, high] = self.channel.range().map(|end| f64::from(settings.get(end)));
        let noise = self.points[0].codes.noise.max(self.points[1].codes.noise);
        self.gain * noise * (high - low) / TOP_CODE / (SAMPLES as f64).sqrt()
    }

    /// The parameters that it changes. A range of the setpoint that is as wide as the sensor's stays so; a narrower one stays
    /// as it is, unless it would reach beyond the sensor's.
    #[must_use]
    pub fn changes(&self, settings: &Settings) -> Vec<Change> {
        let [offset, gain] = self.channel.parameters();
        let mut changes = vec![(offset, self.offset as f32), (gain, self.gain as f32)];
        let mut calibrated = settings.clone();
        for (parameter, value) in &changes {
            // Checked when it was computed.
            let _ = calibrated.set(*parameter, *value);
        }
        let range = |settings: &Settings| {
            let [position, ..] = settings.control_parameters().calibrated_ranges();
            position.map(|end| end as f32)
        };
        let ([was_low, was_high], [low, high]) = (range(settings), range(&calibrated));
        let ends = [Parameter::SetpointLow, Parameter::SetpointHigh];
        let [set_low, set_high] = ends.map(|end| settings.get(end));
        let moved = [
            if set_low == was_low { low } else { set_low.clamp(low, high) },
            if set_high == was_high { high } else { set_high.clamp(low, high) },
        ];
        for (end, value) in ends.into_iter().zip(moved) {
            if value != settings.get(end) {
                changes.push((end, value));
            }
        }
        changes
    }
}
