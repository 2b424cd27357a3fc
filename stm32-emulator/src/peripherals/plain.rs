//! Blocks of which the firmware uses nothing but that registers keep their values: SYSCFG, EXTI, DBGMCU, DMA, DMAMUX, CRC.
//!
//! A block whose register would make it do something names the bits that may be written; others end the run.

use super::{unknown_register, unknown_value};
use crate::core::Trap;

/// Registers that keep what is written.
#[derive(Clone, Debug)]
pub struct Plain {
    name: &'static str,
    registers: Vec<u32>,
    /// Word offsets, each with the bits that would start something.
    live: &'static [(u32, u32)],
}

impl Plain {
    pub(crate) fn new(name: &'static str, words: usize, live: &'static [(u32, u32)]) -> Self {
        Self { name, registers: vec![0; words], live }
    }

    pub(crate) fn with(mut self, offset: u32, value: u32) -> Self {
        if let Some(register) = self.registers.get_mut((offset / 4) as usize) {
            *register = value;
        }
        self
    }

    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        self.registers.get((offset / 4) as usize).copied().ok_or_else(|| unknown_register("read", self.name, offset))
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Trap> {
        if self.live.iter().any(|(at, bits)| *at == offset && value & bits != 0) {
            return Err(unknown_value(self.name, &format!("register {offset:#x}"), value));
        }
        match self.registers.get_mut((offset / 4) as usize) {
            Some(register) => *register = value,
            None => return Err(unknown_register("write", self.name, offset)),
        }
        Ok(())
    }
}
