//! The chip's peripherals, one file each. Registers and bits: RM0440 (reference manual of the STM32G4).

pub mod adc;
pub mod dac;
pub mod flash;
pub mod gpio;
pub mod iwdg;
pub mod lpuart;
pub mod plain;
pub mod pwr;
pub mod rcc;
pub mod timer;

use crate::core::Trap;

/// A register that the model lacks.
pub(crate) fn unknown_register(access: &str, peripheral: &str, offset: u32) -> Trap {
    Trap::unmodelled(format!("{access} of {peripheral} at offset {offset:#05x}, which is not modelled"))
}

/// A value that the model cannot honour.
pub(crate) fn unknown_value(peripheral: &str, register: &str, value: u32) -> Trap {
    Trap::unmodelled(format!("{peripheral}.{register} = {value:#010x} asks for something that is not modelled"))
}
