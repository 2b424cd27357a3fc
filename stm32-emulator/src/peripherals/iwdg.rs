//! Independent watchdog (RM0440, 43): counts the 32 kHz oscillator, resets the chip, cannot be stopped.

use super::{unknown_register, unknown_value};
use crate::core::Trap;
use crate::time::{NEVER, Time, UNITS_PER_SECOND};

/// Nominal frequency of the low-speed oscillator.
const LSI_HZ: u64 = 32_000;

/// The watchdog. Registers take effect at once; the chip needs up to five cycles of its oscillator.
#[derive(Clone, Debug)]
pub struct Iwdg {
    prescaler: u32,
    reload: u32,
    running: bool,
    bites_at: Time,
    /// The oscillator's frequency as a share of its nominal one: 0.95 to 1.05 over temperature (DS12288).
    pub oscillator: f64,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self { prescaler: 0, reload: 0xFFF, running: false, bites_at: NEVER, oscillator: 1.0 }
    }
}

impl Iwdg {
    /// When it resets the chip unless it is fed.
    #[must_use]
    pub fn bites_at(&self) -> Time {
        if self.running { self.bites_at } else { NEVER }
    }

    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        match offset {
            0x04 => Ok(self.prescaler),
            0x08 => Ok(self.reload),
            0x0C => Ok(0),
            0x10 => Ok(0xFFF),
            _ => Err(unknown_register("read", "IWDG", offset)),
        }
    }

    pub(crate) fn write(&mut self, now: Time, offset: u32, value: u32) -> Result<(), Trap> {
        match (offset, value) {
            (0x00, 0xCCCC) => self.running = true,
            (0x00, 0xAAAA) => {}
            // Opens PR and RLR.
            (0x00, 0x5555) => return Ok(()),
            (0x04, _) => {
                self.prescaler = value & 7;
                return Ok(());
            }
            (0x08, _) => {
                self.reload = value & 0xFFF;
                return Ok(());
            }
            (0x10, _) => return Err(unknown_value("IWDG", "WINR", value)),
            _ => return Err(unknown_register("write", "IWDG", offset)),
        }
        let counts = (u64::from(self.reload) + 1) * (4 << self.prescaler.min(6));
        self.bites_at = now + (counts as f64 * (UNITS_PER_SECOND / LSI_HZ) as f64 / self.oscillator) as Time;
        Ok(())
    }
}
