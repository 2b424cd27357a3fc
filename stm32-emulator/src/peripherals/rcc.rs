//! Reset and clock control (RM0440, 7).

use super::{unknown_register, unknown_value};
use crate::core::Trap;
use crate::time::UNITS_PER_SECOND;

/// Frequency of the internal oscillator.
const HSI_HZ: u64 = 16_000_000;

/// Why the chip starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// Supply came up (brown-out flag).
    PowerOn,
    /// The reset pin.
    Pin,
    /// SYSRESETREQ.
    Software,
    /// Independent watchdog.
    Watchdog,
}

impl ResetCause {
    /// Flags in RCC_CSR. The pin is pulled by every internal reset, so its flag always comes along.
    fn flags(self) -> u32 {
        const PIN: u32 = 1 << 26;
        PIN | match self {
            Self::PowerOn => 1 << 27,
            Self::Pin => 0,
            Self::Software => 1 << 28,
            Self::Watchdog => 1 << 29,
        }
    }
}

/// A peripheral's clock: offset of its enable register, and bit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gate(pub(crate) u32, pub(crate) u32);

pub(crate) const AHB1ENR: u32 = 0x48;
pub(crate) const AHB2ENR: u32 = 0x4C;
pub(crate) const APB1ENR1: u32 = 0x58;
pub(crate) const APB1ENR2: u32 = 0x5C;
pub(crate) const APB2ENR: u32 = 0x60;

/// Registers as written, ready bits as the hardware would answer. Oscillators are ready at once.
#[derive(Clone, Debug)]
pub struct Rcc {
    registers: [u32; 41],
    /// Units of time per cycle of the core.
    units_per_cycle: u64,
    /// The phase-locked loop never locks.
    pub pll_stuck: bool,
    /// The system clock has stopped: nothing moves but the watchdog, which has an oscillator of its own (a fault).
    pub clock_stopped: bool,
}

impl Rcc {
    pub(crate) fn new(flags: u32) -> Self {
        let mut registers = [0; 41];
        registers[0] = 0x500;
        registers[1] = 0x4000_0000;
        registers[2] = 0x5;
        registers[3] = 0x1000;
        registers[(AHB1ENR / 4) as usize] = 0x100;
        registers[(0x94 / 4) as usize] = flags;
        Self { registers, units_per_cycle: UNITS_PER_SECOND / HSI_HZ, pll_stuck: false, clock_stopped: false }
    }

    /// The flags after a reset: those not yet cleared stay.
    pub(crate) fn flags_after(&self, cause: ResetCause) -> u32 {
        self.registers[0x94 / 4] & 0xFE00_0000 | cause.flags()
    }

    /// The flags after the supply came up.
    pub(crate) fn power_on_flags() -> u32 {
        ResetCause::PowerOn.flags()
    }

    /// Units of time per cycle of the core, and of the timers and peripherals on its buses.
    #[must_use]
    pub fn units_per_cycle(&self) -> u64 {
        self.units_per_cycle
    }

    /// Units per cycle of the system clock, ahead of the bus prescaler: the converters' source. `None`: no clock is selected.
    pub(crate) fn converter_source(&self) -> Result<Option<u64>, Trap> {
        match self.registers[0x88 / 4] >> 28 & 3 {
            0 => Ok(None),
            2 => Ok(Some(self.system_units()?)),
            _ => Err(unknown_value("RCC", "CCIPR", self.registers[0x88 / 4])),
        }
    }

    pub(crate) fn enabled(&self, gate: Gate) -> bool {
        self.registers[(gate.0 / 4) as usize] >> gate.1 & 1 != 0
    }

    fn pll_hz(&self) -> Result<u64, Trap> {
        let pll = self.registers[3];
        if pll & 3 != 2 {
            return Err(unknown_value("RCC", "PLLCFGR", pll));
        }
        let m = u64::from(pll >> 4 & 15) + 1;
        let n = u64::from(pll >> 8 & 0x7F);
        let r = 2 * (u64::from(pll >> 25 & 3) + 1);
        Ok(HSI_HZ / m * n / r)
    }

    fn system_units(&self) -> Result<u64, Trap> {
        let hz = match self.registers[2] & 3 {
            1 => HSI_HZ,
            3 => self.pll_hz()?,
            _ => return Err(unknown_value("RCC", "CFGR", self.registers[2])),
        };
        if hz == 0 || !UNITS_PER_SECOND.is_multiple_of(hz) {
            return Err(Trap::unmodelled(format!("a system clock of {hz} Hz, which does not divide the unit of time")));
        }
        Ok(UNITS_PER_SECOND / hz)
    }

    fn update_clock(&mut self) -> Result<(), Trap> {
        let cfgr = self.registers[2];
        let prescaler = match cfgr >> 4 & 15 {
            code @ 0..8 if code & 8 == 0 => 1,
            code => [2, 4, 8, 16, 64, 128, 256, 512][(code & 7) as usize],
        };
        if cfgr >> 8 & 7 >= 4 || cfgr >> 11 & 7 >= 4 {
            return Err(unknown_value("RCC", "CFGR", cfgr));
        }
        self.units_per_cycle = self.system_units()? * prescaler;
        Ok(())
    }

    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        let Some(&value) = self.registers.get((offset / 4) as usize) else {
            return Err(unknown_register("read", "RCC", offset));
        };
        // A ready bit stands one above its enable bit.
        let ready = |on: u32| value & !(on << 1) | (value & on) << 1;
        Ok(match offset {
            0x00 => {
                let value = value & !(1 << 10 | 1 << 17 | 1 << 25);
                let pll = if self.pll_stuck { 0 } else { (value & 1 << 24) << 1 };
                value | (value & 1 << 8) << 2 | (value & 1 << 16) << 1 | pll
            }
            0x08 => value & !0xC | (value & 3) << 2,
            0x90 => ready(1),
            0x94 | 0x98 => ready(1),
            _ => value,
        })
    }

    /// Writes a register; whether a peripheral's reset was asked for: its gate.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Result<(), Trap> {
        let Some(register) = self.registers.get_mut((offset / 4) as usize) else {
            return Err(unknown_register("write", "RCC", offset));
        };
        match offset {
            0x94 if value >> 23 & 1 != 0 => *register = value & 1,
            0x94 => *register = *register & 0xFE00_0000 | value & 1,
            _ => *register = value,
        }
        match offset {
            0x08 => self.update_clock(),
            0x18 if value != 0 => Err(unknown_value("RCC", "CIER", value)),
            _ => Ok(()),
        }
    }
}
