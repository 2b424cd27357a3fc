//! A port of 16 pins (RM0440, 9). Inputs read low unless a test drives them.

use super::unknown_register;
use crate::core::Trap;

/// One port.
#[derive(Clone, Debug)]
pub struct Gpio {
    registers: [u32; 11],
    /// What stands at the pins that are inputs.
    pub inputs: u16,
}

impl Gpio {
    /// `mode`: MODER after reset.
    pub(crate) fn new(mode: u32) -> Self {
        let mut registers = [0; 11];
        registers[0] = mode;
        Self { registers, inputs: 0 }
    }

    fn is_output(&self, pin: u32) -> bool {
        self.registers[0] >> (2 * pin) & 3 == 1
    }

    /// Level of a pin that the firmware drives; `None` while it does not.
    #[must_use]
    pub fn driven(&self, pin: u32) -> Option<bool> {
        (pin < 16 && self.is_output(pin)).then(|| self.registers[5] >> pin & 1 != 0)
    }

    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        match offset {
            0x10 => Ok((0..16).fold(0, |bits, pin| {
                let high = self.driven(pin).unwrap_or(self.inputs >> pin & 1 != 0);
                bits | u32::from(high) << pin
            })),
            0x18 | 0x28 => Ok(0),
            _ => self.registers.get((offset / 4) as usize).copied().ok_or(unknown_register("read", "GPIO", offset)),
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Trap> {
        match offset {
            // Setting wins over clearing.
            0x18 => self.registers[5] = self.registers[5] & !(value >> 16) | value & 0xFFFF,
            0x28 => self.registers[5] &= !value,
            0x10 => {}
            _ => match self.registers.get_mut((offset / 4) as usize) {
                Some(register) => *register = value,
                None => return Err(unknown_register("write", "GPIO", offset)),
            },
        }
        Ok(())
    }
}
