//! Power control (RM0440, 6): plain registers; the voltage is ready at once.

use super::unknown_register;
use crate::core::Trap;

/// Registers as written.
#[derive(Clone, Debug)]
pub struct Pwr {
    registers: [u32; 33],
}

impl Default for Pwr {
    fn default() -> Self {
        let mut registers = [0; 33];
        registers[0] = 0x200;
        registers[2] = 0x8000;
        registers[0x80 / 4] = 0x100;
        Self { registers }
    }
}

impl Pwr {
    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        match offset {
            // SR1, SR2: no flag set, regulators ready.
            0x10 | 0x14 => Ok(0),
            _ => self.registers.get((offset / 4) as usize).copied().ok_or(unknown_register("read", "PWR", offset)),
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Trap> {
        let register = self.registers.get_mut((offset / 4) as usize);
        *register.ok_or(unknown_register("write", "PWR", offset))? = value;
        Ok(())
    }
}
