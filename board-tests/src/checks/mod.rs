//! The checks, in the order in which a new board should go through them.

mod boot;
mod clocks;
mod converters;
mod cycles;
mod model;
mod saves;
mod watchdog;

pub use boot::boot;
pub use clocks::clocks;
pub use converters::converters;
pub use cycles::cycles;
pub use model::model;
pub use saves::saves;
pub use watchdog::watchdog;

use crate::bench::{Bench, Failure, Outcome};

/// A check by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Check {
    /// The firmware of these sources starts, without a fault on record.
    Boot,
    /// A second of the board is a second.
    Clocks,
    /// The converters read what the output gives, from end to end of what the loop reaches.
    Converters,
    /// The simulated cylinder on the chip gives the codes of the desktop.
    Model,
    /// A tick takes the time it may.
    Cycles,
    /// A hundred saves, erasures included, and no tick lost.
    Saves,
    /// A core that stops is reset, and says so.
    Watchdog,
}

/// All of them.
pub const CHECKS: [Check; 7] =
    [Check::Boot, Check::Clocks, Check::Converters, Check::Model, Check::Cycles, Check::Saves, Check::Watchdog];

impl Check {
    /// Runs it.
    ///
    /// # Errors
    /// What is not as it should be.
    pub fn run<B: Bench>(self, bench: &mut B) -> Result<Outcome, Failure> {
        match self {
            Self::Boot => boot(bench),
            Self::Clocks => clocks(bench),
            Self::Converters => converters(bench),
            Self::Model => model(bench),
            Self::Cycles => cycles(bench),
            Self::Saves => saves(bench),
            Self::Watchdog => watchdog(bench),
        }
    }
}
