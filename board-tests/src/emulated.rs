//! The emulated board: the same file that would be flashed, on the emulated chip, its output wired to its inputs.

use crate::bench::Bench;
use plant_sim::emulated::EmulatedError;
use plant_sim::emulated::board::Board;
use plant_sim::emulated::line::Line;
use stm32_emulator::analog::Analog;
use stm32_emulator::peripherals::adc::Conversion;
use stm32_emulator::time::{Time, from_seconds, to_seconds};

/// 12-bit code of a pin that nothing drives: the output stage's resistors hold it at mid.
const MID: u16 = 2048;

/// A wire from the output to every input.
#[derive(Clone, Debug, Default)]
pub struct LoopBack {
    pin: Option<u16>,
    noise: u32,
    /// An input channel of the converter whose wire is off, if one is (a fault).
    pub broken: Option<u8>,
}

impl Analog for LoopBack {
    fn convert(&mut self, conversion: &Conversion) -> u16 {
        if self.broken == Some(conversion.channel) {
            return 1000;
        }
        // A step up or down in one conversion of four, as a converter has: oversampling lives on it.
        self.noise = self.noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let code = self.pin.unwrap_or(MID);
        match self.noise >> 29 {
            0 => code.saturating_sub(1),
            1 => (code + 1).min(4095),
            _ => code,
        }
    }
    fn output(&mut self, _: Time, code: Option<u16>) {
        self.pin = code;
    }
}

/// The chip with its wires.
pub struct Emulated {
    board: Board<LoopBack>,
}

impl Emulated {
    /// A chip with this firmware, just powered up.
    ///
    /// # Errors
    /// The file is no firmware for the chip.
    pub fn power_up(elf: &[u8]) -> Result<Self, EmulatedError> {
        let mut board = Board::power_up(elf, LoopBack::default())?;
        board.run(0.3)?;
        Ok(Self { board })
    }

    /// The board.
    pub fn board(&mut self) -> &mut Board<LoopBack> {
        &mut self.board
    }
}

impl Bench for Emulated {
    type Port<'a> = Line<'a, LoopBack>;

    fn port(&mut self) -> Self::Port<'_> {
        Line::to(&mut self.board)
    }

    fn seconds(&mut self) -> f64 {
        to_seconds(self.board.now())
    }

    fn pause(&mut self, seconds: f64) {
        // What the chip cannot do any more shows in the next answer, or in its absence.
        let _ = self.board.run(seconds);
    }

    fn halt(&mut self, seconds: f64) -> Option<Result<(), String>> {
        // Time passes, and no instruction.
        self.board.machine().chip.now += from_seconds(seconds);
        Some(self.board.run(0.001).map_err(|error| error.to_string()))
    }

    fn looped_back(&self) -> bool {
        true
    }
}
