//! The setpoint's course: one position, or a program of `control::program`, which the board runs by itself.

use board_link::{Generator, GeneratorError};
use control::Position;
use control::program::{Program, ProgramParameters, ProgramState, Shape};

/// Where the setpoint goes, tick by tick.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and one exists")]
pub enum Course {
    /// One position.
    Hold(Position),
    /// A program.
    Repeat(Program, ProgramState),
}

impl Course {
    /// Checks what a host asks for and prepares it. Uses floats: for the background, not for the tick.
    ///
    /// # Errors
    /// If a number of the generator is out of range.
    pub fn prepare(generator: &Generator, tick_hz: u32) -> Result<Self, GeneratorError> {
        generator.check()?;
        match *generator {
            Generator::Hold { position_um } => Ok(Self::Hold(metres(position_um))),
            Generator::Repeat { shape, centre_um, amplitude_um, period_ms } => {
                let parameters = ProgramParameters {
                    shape: match shape {
                        board_link::Shape::Step => Shape::Step,
                        board_link::Shape::Ramp => Shape::Ramp,
                        board_link::Shape::Sine => Shape::Sine,
                        board_link::Shape::Identification => Shape::Identification,
                    },
                    centre_m: centre_um as f32 * 1.0e-6,
                    amplitude_m: amplitude_um as f32 * 1.0e-6,
                    period_s: period_ms as f32 * 1.0e-3,
                };
                // The check above is the tighter one.
                let program = Program::from_parameters(&parameters, tick_hz).map_err(|_| GeneratorError::Position)?;
                Ok(Self::Repeat(program, ProgramState::default()))
            }
        }
    }

    /// The setpoint of the coming tick.
    #[inline]
    pub fn advance(&mut self) -> Position {
        match self {
            Self::Hold(position) => *position,
            Self::Repeat(program, state) => program.advance(state),
        }
    }
}

/// Micrometres → metres, to the nearest bit: multiplies by 2^50 / 10^6 instead of dividing.
fn metres(um: i32) -> Position {
    // |um| <= 3 900 000 after the generator's check: the product stays below 2^53.
    Position::from_bits(((i64::from(um) * 1_125_899_907 + (1 << 21)) >> 22) as i32)
}
