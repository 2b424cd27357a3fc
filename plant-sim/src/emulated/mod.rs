//! A board without a board: the firmware's ELF file on the emulated chip (`stm32-emulator`), a simulated cylinder at its
//! analog pins, this program at its serial line. What is emulated and what is assumed: `docs/emulator.md`.
//!
//! | file | contents |
//! | --- | --- |
//! | `board.rs` | power, ticks, resets, serial bytes and the log of a running board |
//! | `line.rs` | the serial line as a port that [`crate::board::Client`] takes |
//! | `commission.rs` | a rig's and a controller's numbers as parameters of the board, and how they get there |
//! | `cylinder.rs` | plant and sensors at the pins |
//! | `positioning.rs` | the step of `plant-sim run` on such a board |
//! | `session.rs` | a board that waits between commands: time, hand, supply, log |

pub mod board;
pub mod commission;
pub mod cylinder;
pub mod line;
pub mod positioning;
pub mod session;

use crate::board::BoardError;
use stm32_emulator::core::Stop;
use stm32_emulator::machine::ImageError;

/// Why an emulated board cannot go on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EmulatedError {
    /// The file is no firmware for this chip.
    Image(ImageError),
    /// The firmware did what is not modelled.
    Stopped(Stop),
    /// The board did not answer, or refused.
    Board(BoardError),
    /// Anything else, as a sentence.
    Other(String),
}

impl std::fmt::Display for EmulatedError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Image(error) => error.fmt(f),
            Self::Stopped(stop) => {
                write!(f, "the emulated chip stopped {stop}; docs/emulator.md lists what is modelled")
            }
            Self::Board(error) => write!(f, "the emulated board: {error}"),
            Self::Other(sentence) => f.write_str(sentence),
        }
    }
}

impl std::error::Error for EmulatedError {}

impl From<ImageError> for EmulatedError {
    fn from(error: ImageError) -> Self {
        Self::Image(error)
    }
}

impl From<Stop> for EmulatedError {
    fn from(stop: Stop) -> Self {
        Self::Stopped(stop)
    }
}

impl From<BoardError> for EmulatedError {
    fn from(error: BoardError) -> Self {
        Self::Board(error)
    }
}
