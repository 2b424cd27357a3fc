//! The memory map, and what ties the peripherals together: clocks, triggers, interrupt lines (RM0440, 2.2).

use crate::analog::Analog;
use crate::core::system::System;
use crate::core::{Bus, Trap};
use crate::peripherals::adc::Adc;
use crate::peripherals::dac::Dac;
use crate::peripherals::flash::{FLASH_BYTES, Flash};
use crate::peripherals::gpio::Gpio;
use crate::peripherals::iwdg::Iwdg;
use crate::peripherals::lpuart::Lpuart;
use crate::peripherals::plain::Plain;
use crate::peripherals::pwr::Pwr;
use crate::peripherals::rcc::{AHB1ENR, AHB2ENR, APB1ENR1, APB1ENR2, APB2ENR, Gate, Rcc, ResetCause};
use crate::peripherals::timer::{Timer, Trigger};
use crate::time::Time;

/// First byte of flash.
pub const FLASH: u32 = 0x0800_0000;
/// First byte of RAM.
pub const RAM: u32 = 0x2000_0000;
/// SRAM1, SRAM2 and the alias of CCM SRAM, one after the other.
pub const RAM_BYTES: usize = 128 << 10;

/// Input of ADC2 that shares the pin with the output of DAC1 (PA4: DS12288, table of pins).
const VALVE_PIN_OF_ADC2: u8 = 17;

/// Interrupt numbers (RM0440, table of vectors).
const FLASH_INTERRUPT: u32 = 4;
const ADC_INTERRUPT: u32 = 18;
const TIM2_INTERRUPT: u32 = 28;
const TIM6_INTERRUPT: u32 = 54;
const LPUART_INTERRUPT: u32 = 91;

/// Enable bits of the peripherals' clocks.
const GATES: [(u32, &str, Gate); 15] = [
    (0x4000_0000, "TIM2", Gate(APB1ENR1, 0)),
    (0x4000_1000, "TIM6", Gate(APB1ENR1, 4)),
    (0x4000_7000, "PWR", Gate(APB1ENR1, 28)),
    (0x4000_8000, "LPUART1", Gate(APB1ENR2, 0)),
    (0x4001_0000, "SYSCFG", Gate(APB2ENR, 0)),
    (0x4002_0000, "DMA1", Gate(AHB1ENR, 0)),
    (0x4002_0400, "DMA2", Gate(AHB1ENR, 1)),
    (0x4002_0800, "DMAMUX", Gate(AHB1ENR, 2)),
    (0x4002_2000, "FLASH", Gate(AHB1ENR, 8)),
    (0x4800_0000, "GPIOA", Gate(AHB2ENR, 0)),
    (0x4800_0400, "GPIOB", Gate(AHB2ENR, 1)),
    (0x4800_0800, "GPIOC", Gate(AHB2ENR, 2)),
    (0x5000_0000, "ADC1", Gate(AHB2ENR, 13)),
    (0x5000_0100, "ADC2", Gate(AHB2ENR, 13)),
    (0x5000_0800, "DAC1", Gate(AHB2ENR, 16)),
];

/// Everything on the chip but the core.
#[derive(Clone)]
pub struct Chip<A: ?Sized> {
    /// Simulated time since power-up.
    pub now: Time,
    /// When a peripheral next does something by itself.
    pub(crate) next_event: Time,
    /// A read waits until then.
    pub(crate) stalled_until: Time,
    /// RAM. Survives resets, not power cuts.
    pub ram: Vec<u8>,
    /// Interrupt controller and system control block.
    pub system: System,
    /// Clocks and reset flags.
    pub rcc: Rcc,
    pwr: Pwr,
    /// Flash memory.
    pub flash: Flash,
    /// Ports A, B and C.
    pub gpio: [Gpio; 3],
    /// Time base of the executor.
    pub tim2: Timer,
    /// The tick.
    pub tim6: Timer,
    /// The converter of the loop.
    pub adc1: Adc,
    adc2: Adc,
    adc_common: u32,
    /// The valve.
    pub dac: Dac,
    /// The serial line.
    pub lpuart: Lpuart,
    /// The watchdog.
    pub iwdg: Iwdg,
    syscfg: Plain,
    exti: Plain,
    dbgmcu: Plain,
    dma: [Plain; 3],
    /// The valve's pin as last reported.
    pin: Option<u16>,
    /// The world at the pins; last, so that a chip may be seen without knowing which.
    pub analog: A,
}

impl<A: Analog> Chip<A> {
    pub(crate) fn new(analog: A) -> Self {
        let mut chip = Self {
            now: 0,
            next_event: 0,
            stalled_until: 0,
            ram: vec![0; RAM_BYTES],
            system: System::default(),
            rcc: Rcc::new(Rcc::power_on_flags()),
            pwr: Pwr::default(),
            flash: Flash::new(),
            gpio: [Gpio::new(0xABFF_FFFF), Gpio::new(0xFFFF_FEBF), Gpio::new(u32::MAX)],
            tim2: Timer::new("TIM2", 4, u32::MAX),
            tim6: Timer::new("TIM6", 0, 0xFFFF),
            adc1: Adc::new("ADC1", 1),
            adc2: Adc::new("ADC2", 2),
            adc_common: 0,
            dac: Dac::default(),
            lpuart: Lpuart::default(),
            iwdg: Iwdg::default(),
            syscfg: Plain::new("SYSCFG", 12, &[]),
            // Lines that are unmasked would interrupt.
            exti: Plain::new("EXTI", 40, &[(0x00, 0xFFFF)]).with(0x80, 0x1F84_0000),
            dbgmcu: Plain::new("DBGMCU", 5, &[]).with(0, 0x2003_6469),
            dma: [Plain::new("DMA1", 42, DMA_LIVE), Plain::new("DMA2", 42, DMA_LIVE), Plain::new("DMAMUX", 84, &[])],
            pin: None,
            analog,
        };
        chip.clock_changed();
        chip
    }

    /// Everything but memory, time and the world as after a reset.
    pub(crate) fn reset(self, cause: ResetCause) -> Self {
        let flags = self.rcc.flags_after(cause);
        let mut fresh = Self::new(self.analog);
        fresh.now = self.now;
        fresh.ram = self.ram;
        fresh.flash = self.flash;
        fresh.flash.reset();
        fresh.rcc = Rcc::new(flags);
        fresh.rcc.pll_stuck = self.rcc.pll_stuck;
        fresh.adc1.ready_stuck = self.adc1.ready_stuck;
        fresh.tim6.trigger_stuck = self.tim6.trigger_stuck;
        fresh.iwdg.oscillator = self.iwdg.oscillator;
        fresh.dac.stuck_at = self.dac.stuck_at;
        fresh.pin = self.pin;
        fresh.clock_changed();
        fresh.report_pin();
        fresh
    }
}

impl<A: Analog + ?Sized> Chip<A> {
    /// Lets peripherals act until now.
    pub(crate) fn events(&mut self) {
        while self.next_event <= self.now {
            let at = self.next_event;
            // Triggers come first: DAC and converter act in the same cycle.
            if self.tim6.next_event() <= at {
                let trigger = self.tim6.event(at);
                self.tim6_output(at, trigger);
            }
            if self.tim2.next_event() <= at {
                self.tim2.event(at);
            }
            if let Some(conversion) = self.adc1.event(at) {
                let code = self.analog.convert(&conversion);
                self.adc1.result(code);
            }
            if let Some(conversion) = self.adc2.event(at) {
                let code = match self.dac.pin() {
                    // The same pin is the output's.
                    Some(code) if conversion.channel == VALVE_PIN_OF_ADC2 => code,
                    _ => self.analog.convert(&conversion),
                };
                self.adc2.result(code);
            }
            if self.lpuart.next_event() <= at {
                self.lpuart.event(at);
            }
            self.flash.event(at);
            self.update_lines();
        }
    }

    fn tim6_output(&mut self, at: Time, trigger: Trigger) {
        if trigger == Trigger::Output {
            self.dac.trigger_tim6();
            self.report_pin_at(at);
            self.adc1.trigger_tim6(at);
            self.adc2.trigger_tim6(at);
        }
    }

    fn report_pin(&mut self) {
        self.report_pin_at(self.now);
    }

    fn report_pin_at(&mut self, at: Time) {
        let pin = self.dac.pin();
        if pin != self.pin {
            self.pin = pin;
            self.analog.output(at, pin);
        }
    }

    /// Interrupt lines follow flags, and the next event is found.
    pub(crate) fn update_lines(&mut self) {
        self.system.set_line(ADC_INTERRUPT, self.adc1.interrupt() || self.adc2.interrupt());
        self.system.set_line(TIM2_INTERRUPT, self.tim2.interrupt());
        self.system.set_line(TIM6_INTERRUPT, self.tim6.interrupt());
        self.system.set_line(LPUART_INTERRUPT, self.lpuart.interrupt());
        self.system.set_line(FLASH_INTERRUPT, self.flash.interrupt());
        self.next_event = [
            self.tim2.next_event(),
            self.tim6.next_event(),
            self.adc1.next_event(),
            self.adc2.next_event(),
            self.lpuart.next_event(),
            self.flash.next_event(),
        ]
        .into_iter()
        .fold(Time::MAX, Time::min);
    }

    /// Bytes on the serial line to the chip.
    pub fn send(&mut self, bytes: &[u8]) {
        self.lpuart.send(self.now, bytes);
        self.update_lines();
    }

    fn clock_changed(&mut self) {
        let units = self.rcc.units_per_cycle();
        self.tim2.set_clock(self.now, units);
        self.tim6.set_clock(self.now, units);
        self.lpuart.set_clock(units);
        self.converter_clock_changed();
        self.update_lines();
    }

    fn converter_clock_changed(&mut self) {
        const PRESCALERS: [u64; 16] = [1, 2, 4, 6, 8, 10, 12, 16, 32, 64, 128, 256, 1, 1, 1, 1];
        let clock = match self.adc_common >> 16 & 3 {
            0 => {
                let prescaler = PRESCALERS[(self.adc_common >> 18 & 15) as usize];
                self.rcc.converter_source().ok().flatten().map(|units| units * prescaler)
            }
            mode => Some(self.rcc.units_per_cycle() << (mode - 1)),
        };
        self.adc1.set_clock(clock);
        self.adc2.set_clock(clock);
    }

    fn require_clock(&self, address: u32) -> Result<(), Trap> {
        let block = if (0x5000_0000..0x5000_0400).contains(&address) { address & !0xFF } else { address & !0x3FF };
        let block = if block == 0x5000_0300 || block == 0x5000_0200 { 0x5000_0000 } else { block };
        match GATES.iter().find(|(base, _, _)| *base == block) {
            Some((_, name, gate)) if !self.rcc.enabled(*gate) => {
                Err(Trap::unmodelled(format!("access to {name} ({address:#010x}) while its clock is off")))
            }
            _ => Ok(()),
        }
    }

    /// Reads a word of the peripherals' space.
    fn peripheral_read(&mut self, address: u32) -> Result<u32, Trap> {
        self.events();
        self.require_clock(address)?;
        let offset = address & 0x3FF;
        let now = self.now;
        let value = match address & !0x3FF {
            0x4000_0000 => self.tim2.read(now, offset)?,
            0x4000_1000 => self.tim6.read(now, offset)?,
            0x4000_3000 => self.iwdg.read(offset)?,
            0x4000_7000 => self.pwr.read(offset)?,
            0x4000_8000 => self.lpuart.read(offset)?,
            0x4001_0000 => self.syscfg.read(offset)?,
            0x4001_0400 => self.exti.read(offset)?,
            0x4002_0000 => self.dma[0].read(offset)?,
            0x4002_0400 => self.dma[1].read(offset)?,
            0x4002_0800 => self.dma[2].read(offset)?,
            0x4002_1000 => self.rcc.read(offset)?,
            0x4002_2000 => self.flash.read(offset)?,
            0x4800_0000 => self.gpio[0].read(offset)?,
            0x4800_0400 => self.gpio[1].read(offset)?,
            0x4800_0800 => self.gpio[2].read(offset)?,
            0x5000_0000 => match offset {
                0x000..0x100 => self.adc1.read(offset)?,
                0x100..0x200 => self.adc2.read(offset - 0x100)?,
                0x308 => self.adc_common,
                _ => return Err(nobody("read", address)),
            },
            0x5000_0800 => self.dac.read(offset)?,
            0xE004_2000 => self.dbgmcu.read(offset)?,
            _ => return Err(nobody("read", address)),
        };
        self.update_lines();
        Ok(value)
    }

    /// Writes a register. A write of fewer than four bytes at a register's start reaches registers of that width.
    fn peripheral_write(&mut self, address: u32, value: u32) -> Result<(), Trap> {
        self.events();
        self.require_clock(address)?;
        let offset = address & 0x3FF;
        let now = self.now;
        match address & !0x3FF {
            0x4000_0000 => {
                self.tim2.write(now, offset, value)?;
            }
            0x4000_1000 => {
                let trigger = self.tim6.write(now, offset, value)?;
                self.tim6_output(now, trigger);
            }
            0x4000_3000 => self.iwdg.write(now, offset, value)?,
            0x4000_7000 => self.pwr.write(offset, value)?,
            0x4000_8000 => self.lpuart.write(now, offset, value)?,
            0x4001_0000 => self.syscfg.write(offset, value)?,
            0x4001_0400 => self.exti.write(offset, value)?,
            0x4002_0000 => self.dma[0].write(offset, value)?,
            0x4002_0400 => self.dma[1].write(offset, value)?,
            0x4002_0800 => self.dma[2].write(offset, value)?,
            0x4002_1000 => self.rcc_write(offset, value)?,
            0x4002_2000 => self.flash.write(now, offset, value)?,
            0x4800_0000 => self.gpio[0].write(offset, value)?,
            0x4800_0400 => self.gpio[1].write(offset, value)?,
            0x4800_0800 => self.gpio[2].write(offset, value)?,
            0x5000_0000 => match offset {
                0x000..0x100 => self.adc1.write(now, offset, value)?,
                0x100..0x200 => self.adc2.write(now, offset - 0x100, value)?,
                0x308 => {
                    self.adc_common = value;
                    self.converter_clock_changed();
                }
                _ => return Err(nobody("write", address)),
            },
            0x5000_0800 => {
                self.dac.write(offset, value)?;
                self.report_pin();
            }
            0xE004_2000 => self.dbgmcu.write(offset, value)?,
            _ => return Err(nobody("write", address)),
        }
        self.update_lines();
        Ok(())
    }

    fn rcc_write(&mut self, offset: u32, value: u32) -> Result<(), Trap> {
        let before = self.rcc.units_per_cycle();
        self.rcc.write(offset, value)?;
        if self.rcc.units_per_cycle() != before {
            self.clock_changed();
        }
        self.converter_clock_changed();
        // Resets of single peripherals.
        let now = self.now;
        if offset == 0x38 && value & 1 != 0 {
            self.tim2 = Timer::new("TIM2", 4, u32::MAX);
        }
        if offset == 0x38 && value & 1 << 4 != 0 {
            let stuck = self.tim6.trigger_stuck;
            self.tim6 = Timer::new("TIM6", 0, 0xFFFF);
            self.tim6.trigger_stuck = stuck;
        }
        if offset == 0x38 {
            let units = self.rcc.units_per_cycle();
            self.tim2.set_clock(now, units);
            self.tim6.set_clock(now, units);
        }
        if offset == 0x2C && value & 1 << 13 != 0 {
            let stuck = self.adc1.ready_stuck;
            self.adc1 = Adc::new("ADC1", 1);
            self.adc2 = Adc::new("ADC2", 2);
            self.adc1.ready_stuck = stuck;
            self.adc_common = 0;
            self.converter_clock_changed();
        }
        if offset == 0x2C && value & 1 << 16 != 0 {
            let stuck_at = self.dac.stuck_at;
            self.dac = Dac::default();
            self.dac.stuck_at = stuck_at;
            self.report_pin();
        }
        Ok(())
    }
}

/// Channel enable bits of the DMA controllers' CCR registers: a transfer is not modelled.
const DMA_LIVE: &[(u32, u32)] =
    &[(0x08, 1), (0x1C, 1), (0x30, 1), (0x44, 1), (0x58, 1), (0x6C, 1), (0x80, 1), (0x94, 1)];

fn nobody(access: &str, address: u32) -> Trap {
    Trap::unmodelled(format!("{access} of {address:#010x}: no peripheral is modelled there"))
}

fn value_at(memory: &[u8], offset: usize, bytes: u32) -> Option<u32> {
    Some(match bytes {
        4 => u32::from_le_bytes(memory.get(offset..offset + 4)?.try_into().ok()?),
        2 => u32::from(u16::from_le_bytes(memory.get(offset..offset + 2)?.try_into().ok()?)),
        _ => u32::from(*memory.get(offset)?),
    })
}

impl<A: Analog + ?Sized> Bus for Chip<A> {
    #[inline]
    fn fetch(&mut self, address: u32) -> Result<u16, Trap> {
        let offset = address.wrapping_sub(FLASH) as usize;
        if let Some(value) = value_at(&self.flash.bytes, offset, 2) {
            self.flash_read(offset);
            return Ok(value as u16);
        }
        value_at(&self.ram, address.wrapping_sub(RAM) as usize, 2).map(|value| value as u16).ok_or(Trap::Bus(address))
    }

    #[inline]
    fn read(&mut self, address: u32, bytes: u32) -> Result<u32, Trap> {
        if let Some(value) = value_at(&self.ram, address.wrapping_sub(RAM) as usize, bytes) {
            return Ok(value);
        }
        let offset = address.wrapping_sub(FLASH) as usize;
        if let Some(value) = value_at(&self.flash.bytes, offset, bytes) {
            self.flash_read(offset);
            return Ok(value);
        }
        self.slow_read(address, bytes)
    }

    #[inline]
    fn write(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        let offset = address.wrapping_sub(RAM) as usize;
        if let Some(memory) = self.ram.get_mut(offset..offset.wrapping_add(bytes as usize)) {
            match bytes {
                4 => memory.copy_from_slice(&value.to_le_bytes()),
                2 => memory.copy_from_slice(&(value as u16).to_le_bytes()),
                _ => memory.fill(value as u8),
            }
            return Ok(());
        }
        self.slow_write(address, bytes, value)
    }

    #[inline]
    fn system(&mut self) -> &mut System {
        &mut self.system
    }
}

impl<A: Analog + ?Sized> Chip<A> {
    #[inline]
    fn flash_read(&mut self, offset: usize) {
        if self.flash.busy()
            && let Some(until) = self.flash.waits_until(offset)
        {
            self.stalled_until = self.stalled_until.max(until);
        }
        if self.flash.is_damaged() && self.flash.check(offset) {
            self.system.raise_nmi();
        }
    }

    #[cold]
    fn slow_read(&mut self, address: u32, bytes: u32) -> Result<u32, Trap> {
        let word = match address {
            // Boot from flash: its alias at 0.
            0..0x0008_0000 => {
                let memory = value_at(&self.flash.bytes, address as usize, bytes).ok_or(Trap::Bus(address));
                self.flash_read(address as usize);
                return memory;
            }
            0x4000_0000..0x6000_0000 | 0xE004_2000..0xE004_2400 => self.peripheral_read(address & !3)?,
            0xE000_0000..0xE010_0000 => self.system.read(address & !3)?,
            // Unique device number, package, size: words of the system memory.
            0x1FFF_7500..0x1FFF_7600 => 0xFFFF_FFFF,
            0x1FFF_0000..0x1FFF_7000 => {
                return Err(Trap::unmodelled(format!("the bootloader in ROM, read at {address:#010x}")));
            }
            _ => return Err(Trap::Bus(address)),
        };
        let shifted = word >> (8 * (address & 3));
        Ok(if bytes == 4 { shifted } else { shifted & ((1 << (8 * bytes)) - 1) })
    }

    #[cold]
    fn slow_write(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        let value = if bytes == 4 { value } else { value & ((1 << (8 * bytes)) - 1) };
        match address {
            FLASH..0x0808_0000 => {
                self.flash.program(self.now, (address - FLASH) as usize % FLASH_BYTES, bytes, value);
                self.update_lines();
                Ok(())
            }
            0x4000_0000..0x6000_0000 | 0xE004_2000..0xE004_2400 => {
                if address & 3 != 0 {
                    return Err(Trap::unmodelled(format!(
                        "write of {bytes} bytes to {address:#010x}, inside a register"
                    )));
                }
                self.peripheral_write(address, value)
            }
            0xE000_0000..0xE010_0000 => self.system.write(address, bytes, value),
            _ => Err(Trap::Bus(address)),
        }
    }
}
