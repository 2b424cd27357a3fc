//! Setpoint generators as a host asks for them, and what is allowed. The board runs them as `control::program`.

use serde::{Deserialize, Serialize};

/// Largest setpoint of a generator, in micrometres from mid-stroke. The setpoint limiter on the board is tighter.
pub const POSITION_LIMIT_UM: i32 = 3_900_000;
/// Shortest period, in milliseconds.
pub const SHORTEST_MS: u32 = 10;
/// Longest period, in milliseconds: one hour.
pub const LONGEST_MS: u32 = 3_600_000;

/// A setpoint over time. Positions in micrometres from mid-stroke, positive towards chamber B.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Generator {
    /// One position.
    Hold {
        /// Where.
        position_um: i32,
    },
    /// A shape that repeats.
    Repeat {
        /// Which.
        shape: Shape,
        /// Centre of the motion.
        centre_um: i32,
        /// Half the peak-to-peak motion, not negative.
        amplitude_um: i32,
        /// One period, [`SHORTEST_MS`]`..=`[`LONGEST_MS`]. For the identification sequence the whole sequence: 40 s.
        period_ms: u32,
    },
}

/// The shapes that repeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Shape {
    /// Square wave, the upper position first.
    Step,
    /// Triangle wave, from the centre upwards.
    Ramp,
    /// Sine, from the centre upwards.
    Sine,
    /// The identification sequence made for the diagnosis.
    Identification,
}

/// Why a generator is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GeneratorError {
    /// A position beyond ±[`POSITION_LIMIT_UM`].
    Position,
    /// A period outside [`SHORTEST_MS`]`..=`[`LONGEST_MS`].
    Time,
    /// A negative amplitude.
    Amplitude,
}

impl Generator {
    /// Checks every number.
    ///
    /// # Errors
    /// Names the first number outside its range.
    pub fn check(&self) -> Result<(), GeneratorError> {
        let position = |um: i32| {
            if um.unsigned_abs() <= POSITION_LIMIT_UM.unsigned_abs() { Ok(()) } else { Err(GeneratorError::Position) }
        };
        match *self {
            Self::Hold { position_um } => position(position_um),
            Self::Repeat { centre_um, amplitude_um, period_ms, .. } => {
                position(centre_um)?;
                position(amplitude_um)?;
                if amplitude_um < 0 {
                    return Err(GeneratorError::Amplitude);
                }
                // No overflow: both lie within ±3 900 000.
                position(centre_um + amplitude_um)?;
                position(centre_um - amplitude_um)?;
                if (SHORTEST_MS..=LONGEST_MS).contains(&period_ms) { Ok(()) } else { Err(GeneratorError::Time) }
            }
        }
    }
}
