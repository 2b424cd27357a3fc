//! Setpoint generators: what they are and what is allowed. The board evaluates them (crate `firmware-core`).

use serde::{Deserialize, Serialize};

/// Largest setpoint of a generator, in micrometres from mid-stroke. The setpoint limiter on the board is tighter.
pub const POSITION_LIMIT_UM: i32 = 2_000_000;
/// Longest period or duration, in milliseconds: one hour.
pub const LONGEST_MS: u32 = 3_600_000;
/// Fastest sine, in millihertz: 50 Hz is far beyond what a pneumatic cylinder follows.
pub const HIGHEST_SINE_MILLIHERTZ: u32 = 50_000;

/// A setpoint over time. Positions in micrometres from mid-stroke, positive towards chamber B; times in milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Generator {
    /// One position.
    Hold {
        /// Where.
        position_um: i32,
    },
    /// Alternates between two positions, half a period each, `low_um` first.
    Step {
        /// First position.
        low_um: i32,
        /// Second position.
        high_um: i32,
        /// Time for both.
        period_ms: u32,
    },
    /// Moves from where the setpoint is to `target_um` in `duration_ms`, then holds.
    Ramp {
        /// End.
        target_um: i32,
        /// Time to get there.
        duration_ms: u32,
    },
    /// A sine about `centre_um`.
    Sine {
        /// Mean.
        centre_um: i32,
        /// Peak deviation, not negative.
        amplitude_um: i32,
        /// Frequency in thousandths of a hertz, 1..=[`HIGHEST_SINE_MILLIHERTZ`].
        frequency_mhz: u32,
    },
    /// The sequence for the diagnosis: steps of three sizes both ways, slow ramps, rests, and sines of rising frequency,
    /// 40 s in all, repeated. Positions scale with `amplitude_um`.
    Identification {
        /// Mean.
        centre_um: i32,
        /// Largest deviation, not negative.
        amplitude_um: i32,
    },
}

/// Why a generator is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum GeneratorError {
    /// A position beyond ±[`POSITION_LIMIT_UM`].
    Position,
    /// A time of zero, or longer than [`LONGEST_MS`].
    Time,
    /// A frequency of zero, or above [`HIGHEST_SINE_MILLIHERTZ`].
    Frequency,
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
        let time = |ms: u32| if (1..=LONGEST_MS).contains(&ms) { Ok(()) } else { Err(GeneratorError::Time) };
        let swing = |centre: i32, amplitude: i32| {
            position(centre)?;
            position(amplitude)?;
            if amplitude < 0 {
                return Err(GeneratorError::Amplitude);
            }
            // No overflow: both lie within ±2 000 000.
            position(centre + amplitude)?;
            position(centre - amplitude)
        };
        match *self {
            Self::Hold { position_um } => position(position_um),
            Self::Step { low_um, high_um, period_ms } => {
                position(low_um)?;
                position(high_um)?;
                time(period_ms)
            }
            Self::Ramp { target_um, duration_ms } => {
                position(target_um)?;
                time(duration_ms)
            }
            Self::Sine { centre_um, amplitude_um, frequency_mhz } => {
                swing(centre_um, amplitude_um)?;
                if (1..=HIGHEST_SINE_MILLIHERTZ).contains(&frequency_mhz) {
                    Ok(())
                } else {
                    Err(GeneratorError::Frequency)
                }
            }
            Self::Identification { centre_um, amplitude_um } => swing(centre_um, amplitude_um),
        }
    }
}
