//! Analog-to-digital converter: the injected sequence with trigger and oversampling (RM0440, 21). Regular conversions end the
//! run.

use super::{unknown_register, unknown_value};
use crate::core::Trap;
use crate::time::{NEVER, Time};

const READY: u32 = 1;
const INJECTED_DONE: u32 = 1 << 5;
const SEQUENCE_DONE: u32 = 1 << 6;

const ENABLE: u32 = 1;
const DISABLE: u32 = 2;
const START: u32 = 4;
const START_INJECTED: u32 = 8;
const STOP: u32 = 0x10;
const STOP_INJECTED: u32 = 0x20;
const REGULATOR: u32 = 1 << 28;
const DEEP_POWER_DOWN: u32 = 1 << 29;
const CALIBRATE: u32 = 1 << 31;

/// Trigger 14 of injected conversions: TIM6_TRGO (RM0440, table "ADC1/2 external triggers for injected channels").
const TRIGGER_TIM6: u32 = 14;

/// Cycles from the trigger to the start of sampling. The manual gives 2 to 4 for most clock choices; assumed.
const TRIGGER_CYCLES: u64 = 3;
/// Cycles of a calibration (DS12288, t_CAL).
const CALIBRATION_CYCLES: u64 = 116;
/// Cycles until ready after enabling; the data sheet gives one conversion at most.
const START_UP_CYCLES: u64 = 25;

/// Sampling times in half cycles.
const SAMPLING_HALVES: [u64; 8] = [5, 13, 25, 49, 95, 185, 495, 1281];
/// Successive approximation of 12 bits, in half cycles.
const CONVERSION_HALVES: u64 = 25;

/// One conversion that is due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conversion {
    /// When the input is held.
    pub at: Time,
    /// Which of the two converters, 1 or 2.
    pub converter: u8,
    /// Its input channel.
    pub channel: u8,
    /// Place in the sequence, from 0.
    pub rank: u8,
    /// Which of the conversions that are added up, from 0.
    pub sample: u16,
    /// How many are added up.
    pub samples: u16,
}

#[derive(Clone, Copy, Debug)]
struct Running {
    next: Conversion,
    /// When the conversion under way ends.
    ends_at: Time,
    sum: u32,
}

/// One converter.
#[derive(Clone, Debug)]
pub struct Adc {
    name: &'static str,
    number: u8,
    isr: u32,
    ier: u32,
    cr: u32,
    cfgr: u32,
    cfgr2: u32,
    smpr: [u32; 2],
    jsqr: u32,
    jdr: [u32; 4],
    /// Registers that are kept and have no effect on the injected sequence.
    kept: [u32; 52],
    calibrated_at: Time,
    ready_at: Time,
    running: Option<Running>,
    /// Units of time per cycle of the converter; `None` without a clock.
    clock: Option<u64>,
    /// Sequences finished since reset.
    pub sequences: u64,
    /// ADRDY never comes (a fault).
    pub ready_stuck: bool,
    /// The flags of the injected sequence are stuck, set or clear (a fault).
    pub flags_stuck: Option<bool>,
}

impl Adc {
    pub(crate) fn new(name: &'static str, number: u8) -> Self {
        Self {
            name,
            number,
            isr: 0,
            ier: 0,
            cr: DEEP_POWER_DOWN,
            cfgr: 1 << 31,
            cfgr2: 0,
            smpr: [0; 2],
            jsqr: 0,
            jdr: [0; 4],
            kept: [0; 52],
            calibrated_at: NEVER,
            ready_at: NEVER,
            running: None,
            clock: None,
            sequences: 0,
            ready_stuck: false,
            flags_stuck: None,
        }
    }

    pub(crate) fn set_clock(&mut self, clock: Option<u64>) {
        self.clock = clock;
    }

    /// The next instant at which something happens. The input is taken when sampling ends; results appear when conversion ends.
    pub(crate) fn next_event(&self) -> Time {
        let running = self.running.map_or(NEVER, |running| running.ends_at);
        self.calibrated_at.min(self.ready_at).min(running)
    }

    /// The conversion that ends now, if one does: its result goes to [`Adc::result`].
    pub(crate) fn event(&mut self, now: Time) -> Option<Conversion> {
        if self.calibrated_at <= now {
            self.calibrated_at = NEVER;
            self.cr &= !CALIBRATE;
        }
        if self.ready_at <= now {
            self.ready_at = NEVER;
            self.isr |= READY;
        }
        self.running.filter(|running| running.ends_at <= now).map(|running| running.next)
    }

    /// TRGO of TIM6.
    pub(crate) fn trigger_tim6(&mut self, now: Time) {
        let selected = self.jsqr >> 7 & 3 == 1 && self.jsqr >> 2 & 31 == TRIGGER_TIM6;
        // A trigger during a sequence is lost.
        if self.cr & START_INJECTED != 0 && selected && self.running.is_none() {
            self.begin(now + TRIGGER_CYCLES * self.clock.unwrap_or(0), 0, 0, 0);
        }
    }

    fn samples(&self) -> u16 {
        if self.cfgr2 & 2 != 0 { 2 << (self.cfgr2 >> 2 & 7) } else { 1 }
    }

    fn channel(&self, rank: u8) -> u8 {
        (self.jsqr >> (9 + 6 * u32::from(rank)) & 31) as u8
    }

    fn begin(&mut self, start: Time, rank: u8, sample: u16, sum: u32) {
        let Some(clock) = self.clock else { return };
        let channel = self.channel(rank);
        let place = u32::from(channel);
        let code = if place < 10 { self.smpr[0] >> (3 * place) } else { self.smpr[1] >> (3 * (place - 10)) } & 7;
        let sampling = SAMPLING_HALVES[code as usize];
        let at = start + sampling * clock / 2;
        let next = Conversion { at, converter: self.number, channel, rank, sample, samples: self.samples() };
        self.running = Some(Running { next, ends_at: start + (sampling + CONVERSION_HALVES) * clock / 2, sum });
    }

    /// The 12-bit result of a conversion that ended; the next one begins.
    pub(crate) fn result(&mut self, code: u16) {
        let Some(running) = self.running.take() else { return };
        let (rank, sample) = (running.next.rank, running.next.sample);
        let sum = running.sum + u32::from(code.min(4095));
        if sample + 1 < running.next.samples {
            return self.begin(running.ends_at, rank, sample + 1, sum);
        }
        let shift = if self.cfgr2 & 2 != 0 { self.cfgr2 >> 5 & 15 } else { 0 };
        self.jdr[usize::from(rank) & 3] = sum >> shift & 0xFFFF;
        self.isr |= INJECTED_DONE;
        if u32::from(rank) < self.jsqr & 3 {
            self.begin(running.ends_at, rank + 1, 0, 0);
        } else {
            self.isr |= SEQUENCE_DONE;
            self.sequences += 1;
        }
    }

    fn flags(&self) -> u32 {
        const STUCK: u32 = INJECTED_DONE | SEQUENCE_DONE;
        match self.flags_stuck {
            None => self.isr,
            Some(true) => self.isr | STUCK,
            Some(false) => self.isr & !STUCK,
        }
    }

    pub(crate) fn interrupt(&self) -> bool {
        self.flags() & self.ier != 0
    }

    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        Ok(match offset {
            0x00 => self.flags(),
            0x04 => self.ier,
            0x08 => self.cr,
            0x0C => self.cfgr,
            0x10 => self.cfgr2,
            0x14 | 0x18 => self.smpr[(offset as usize - 0x14) / 4],
            0x4C => self.jsqr,
            0x80..=0x8C => self.jdr[(offset as usize - 0x80) / 4],
            0x20..=0x3C | 0x60..=0x6C | 0xA0..=0xC0 => self.kept[offset as usize / 4],
            _ => return Err(unknown_register("read", self.name, offset)),
        })
    }

    pub(crate) fn write(&mut self, now: Time, offset: u32, value: u32) -> Result<(), Trap> {
        match offset {
            0x00 => self.isr &= !value,
            0x04 => self.ier = value,
            0x08 => return self.control(now, value),
            // DMA, external triggers of regular conversions, continuous, discontinuous, automatic injection.
            0x0C if value & (1 | 3 << 10 | 1 << 13 | 1 << 16 | 1 << 20 | 1 << 25) != 0 => {
                return Err(unknown_value(self.name, "CFGR", value));
            }
            0x0C if value >> 3 & 3 != 0 => return Err(unknown_value(self.name, "CFGR", value)),
            0x0C => self.cfgr = value,
            0x10 if value & (1 << 9 | 7 << 16) != 0 => return Err(unknown_value(self.name, "CFGR2", value)),
            0x10 => self.cfgr2 = value,
            0x14 | 0x18 => self.smpr[(offset as usize - 0x14) / 4] = value,
            0x4C => self.jsqr = value,
            0x60..=0x6C | 0xB0 | 0xC0 if value != 0 => {
                return Err(unknown_value(self.name, &format!("register {offset:#x}"), value));
            }
            0x20..=0x3C | 0x60..=0x6C | 0xA0..=0xC0 => self.kept[offset as usize / 4] = value,
            _ => return Err(unknown_register("write", self.name, offset)),
        }
        Ok(())
    }

    fn control(&mut self, now: Time, value: u32) -> Result<(), Trap> {
        if value & START != 0 {
            return Err(Trap::unmodelled("a regular conversion, which is not modelled"));
        }
        let cycles = |count: u64| self.clock.map_or(NEVER, |clock| now + count * clock);
        // Configuration bits are written; the others can only be set, and are cleared by hardware.
        self.cr = self.cr & (CALIBRATE | 0x3F) | value & 0x7000_0000;
        if value & CALIBRATE != 0 {
            if self.cr & REGULATOR == 0 {
                return Err(Trap::unmodelled(format!("{} calibrates without its regulator", self.name)));
            }
            self.cr |= CALIBRATE;
            self.calibrated_at = cycles(CALIBRATION_CYCLES);
        }
        if value & ENABLE != 0 && self.cr & ENABLE == 0 {
            self.cr |= ENABLE;
            self.ready_at = if self.ready_stuck { NEVER } else { cycles(START_UP_CYCLES) };
        }
        if value & START_INJECTED != 0 {
            self.cr |= START_INJECTED;
            if self.jsqr >> 7 & 3 == 0 && self.running.is_none() {
                self.begin(now, 0, 0, 0);
            }
        }
        if value & STOP != 0 {
            self.cr &= !START;
        }
        if value & STOP_INJECTED != 0 {
            self.cr &= !START_INJECTED;
            self.running = None;
        }
        if value & DISABLE != 0 {
            self.cr &= !(ENABLE | DISABLE);
            self.isr &= !READY;
        }
        Ok(())
    }
}
