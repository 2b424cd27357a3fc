//! Digital-to-analog converter, channel 1 (RM0440, 22).

use super::{unknown_register, unknown_value};
use crate::core::Trap;

/// Bits of the control register.
const ENABLE: u32 = 1;
const TRIGGERED: u32 = 2;
/// TIM6 as trigger (RM0440, table of interconnections).
const TRIGGER_TIM6: u32 = 7;

/// One channel.
#[derive(Clone, Debug, Default)]
pub struct Dac {
    cr: u32,
    mcr: u32,
    holding: u32,
    output: u32,
    /// Codes written by the firmware since reset.
    pub writes: u64,
    /// The code at the pin, whatever is written (a fault).
    pub stuck_at: Option<u16>,
}

impl Dac {
    /// The code at the pin; `None`: the pin is high impedance.
    #[must_use]
    pub fn pin(&self) -> Option<u16> {
        (self.cr & ENABLE != 0).then_some(self.stuck_at.unwrap_or(self.output as u16))
    }

    /// The code that waits for the trigger, or passed already.
    #[must_use]
    pub fn holding(&self) -> u16 {
        self.holding as u16
    }

    /// The code that is converted: what a trigger has latched.
    #[must_use]
    pub fn latched(&self) -> u16 {
        self.output as u16
    }

    /// TRGO of TIM6.
    pub(crate) fn trigger_tim6(&mut self) {
        if self.cr & (ENABLE | TRIGGERED) == ENABLE | TRIGGERED && self.cr >> 2 & 15 == TRIGGER_TIM6 {
            self.output = self.holding;
        }
    }

    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        Ok(match offset {
            0x00 => self.cr,
            0x08 => self.holding,
            0x2C => self.output,
            0x34 => 0,
            0x3C => self.mcr,
            _ => return Err(unknown_register("read", "DAC1", offset)),
        })
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Trap> {
        match offset {
            0x00 => {
                let source = value >> 2 & 15;
                if value & !0x3F != 0 || value & TRIGGERED != 0 && source != TRIGGER_TIM6 {
                    return Err(unknown_value("DAC1", "CR", value));
                }
                self.cr = value;
            }
            0x08 => {
                self.holding = value & 0xFFF;
                self.writes += 1;
            }
            0x3C => self.mcr = value,
            _ => return Err(unknown_register("write", "DAC1", offset)),
        }
        // Without a trigger the code passes within one bus cycle.
        if self.cr & TRIGGERED == 0 {
            self.output = self.holding;
        }
        Ok(())
    }
}
