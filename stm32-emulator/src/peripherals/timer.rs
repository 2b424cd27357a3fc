//! Timers that count up: TIM2 with four compare channels, TIM6 with none (RM0440, 30 and 32).

use super::{unknown_register, unknown_value};
use crate::core::Trap;
use crate::time::{NEVER, Time};

/// Update interrupt and flag.
const UPDATE: u32 = 1;
const URS: u32 = 1 << 2;
const PRELOAD: u32 = 1 << 7;

/// A counter. Between events its count is computed from time.
#[derive(Clone, Debug)]
pub struct Timer {
    name: &'static str,
    channels: usize,
    cr1: u32,
    cr2: u32,
    dier: u32,
    sr: u32,
    /// Prescaler as written and as in use since the last update.
    psc: u32,
    psc_in_use: u32,
    arr: u32,
    arr_in_use: u32,
    ccmr: [u32; 2],
    ccer: u32,
    ccr: [u32; 4],
    /// The count at `since`.
    base: u64,
    since: Time,
    /// Units of time per clock of the timer.
    units: u64,
    /// Time of the last event handled, so that it is handled once.
    handled_to: Time,
    /// The timer has stopped sending triggers (a fault).
    pub trigger_stuck: bool,
    /// The update flag cannot be cleared (a fault).
    pub update_flag_stuck: bool,
}

/// What a timer event means to others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trigger {
    None,
    /// TRGO pulses.
    Output,
}

impl Timer {
    pub(crate) fn new(name: &'static str, channels: usize, widest: u32) -> Self {
        Self {
            name,
            channels,
            cr1: 0,
            cr2: 0,
            dier: 0,
            sr: 0,
            psc: 0,
            psc_in_use: 0,
            arr: widest,
            arr_in_use: widest,
            ccmr: [0; 2],
            ccer: 0,
            ccr: [0; 4],
            base: 0,
            since: 0,
            units: 1,
            handled_to: 0,
            trigger_stuck: false,
            update_flag_stuck: false,
        }
    }

    fn running(&self) -> bool {
        self.cr1 & 1 != 0
    }

    fn step(&self) -> u64 {
        self.units * (u64::from(self.psc_in_use) + 1)
    }

    fn period(&self) -> u64 {
        u64::from(self.arr_in_use) + 1
    }

    /// The count at a time.
    #[must_use]
    pub fn count(&self, now: Time) -> u32 {
        let passed = if self.running() { now.saturating_sub(self.since) / self.step() } else { 0 };
        ((self.base + passed) % self.period()) as u32
    }

    /// Restarts the computation of the count from now.
    fn rebase(&mut self, now: Time, count: u64) {
        // The part of a count that has passed is kept while it runs on.
        let part = if self.running() { now.saturating_sub(self.since) % self.step() } else { 0 };
        self.base = count;
        self.since = now - part;
        self.handled_to = now;
    }

    /// The core's clock changed.
    pub(crate) fn set_clock(&mut self, now: Time, units: u64) {
        let count = u64::from(self.count(now));
        self.rebase(now, count);
        self.since = now;
        self.units = units;
    }

    /// The time at which the count next becomes `target`, after the last event handled.
    fn when(&self, target: u64) -> Time {
        let (step, period) = (self.step(), self.period());
        if target >= period {
            return NEVER;
        }
        let counts = (target + period - self.base % period) % period;
        let first = self.since + counts * step;
        if first > self.handled_to {
            return first;
        }
        let rounds = (self.handled_to - first) / (period * step) + 1;
        first + rounds * period * step
    }

    pub(crate) fn next_event(&self) -> Time {
        if !self.running() {
            return NEVER;
        }
        let compare = self.ccr.iter().take(self.channels).map(|ccr| self.when(u64::from(*ccr)));
        compare.fold(self.when(0), Time::min)
    }

    /// Handles the event at `at`.
    pub(crate) fn event(&mut self, at: Time) -> Trigger {
        for (channel, ccr) in self.ccr.into_iter().enumerate().take(self.channels) {
            if self.when(u64::from(ccr)) == at {
                self.sr |= 2 << channel;
            }
        }
        let update = self.when(0) == at;
        self.handled_to = at;
        if !update {
            return Trigger::None;
        }
        self.sr |= UPDATE;
        self.load(at);
        if self.cr2 >> 4 & 7 == 2 && !self.trigger_stuck { Trigger::Output } else { Trigger::None }
    }

    /// An update takes over prescaler and period.
    fn load(&mut self, at: Time) {
        if self.psc != self.psc_in_use || self.arr != self.arr_in_use {
            self.psc_in_use = self.psc;
            self.arr_in_use = self.arr;
            self.base = 0;
            self.since = at;
            self.handled_to = at;
        }
    }

    pub(crate) fn interrupt(&self) -> bool {
        self.sr & self.dier & 0x1F != 0
    }

    pub(crate) fn read(&self, now: Time, offset: u32) -> Result<u32, Trap> {
        Ok(match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x08 if self.channels > 0 => 0,
            0x0C => self.dier,
            0x10 => self.sr | u32::from(self.update_flag_stuck),
            0x14 => 0,
            0x18 | 0x1C if self.channels > 0 => self.ccmr[(offset as usize - 0x18) / 4],
            0x20 if self.channels > 0 => self.ccer,
            0x24 => self.count(now),
            0x28 => self.psc,
            0x2C => self.arr,
            0x34..=0x40 if self.channels > 0 => self.ccr[(offset as usize - 0x34) / 4],
            _ => return Err(unknown_register("read", self.name, offset)),
        })
    }

    pub(crate) fn write(&mut self, now: Time, offset: u32, value: u32) -> Result<Trigger, Trap> {
        let count = u64::from(self.count(now));
        match offset {
            0x00 => {
                if value & !(1 | URS | PRELOAD) != 0 {
                    return Err(unknown_value(self.name, "CR1", value));
                }
                self.rebase(now, count);
                if !self.running() {
                    self.since = now;
                }
                self.cr1 = value;
            }
            0x04 => match value {
                0x00 | 0x20 => self.cr2 = value,
                _ => return Err(unknown_value(self.name, "CR2", value)),
            },
            0x08 if self.channels > 0 && value == 0 => {}
            0x0C => {
                if value & !0x1F != 0 {
                    return Err(unknown_value(self.name, "DIER", value));
                }
                self.dier = value;
            }
            // Flags are cleared by writing 0.
            0x10 => self.sr &= value,
            0x14 => return self.generate(now, value),
            0x18 | 0x1C if self.channels > 0 => {
                // Channels as inputs.
                if value & 0x0303 != 0 {
                    return Err(unknown_value(self.name, "CCMR", value));
                }
                self.ccmr[(offset as usize - 0x18) / 4] = value;
            }
            0x20 if self.channels > 0 => self.ccer = value,
            0x24 => {
                self.rebase(now, u64::from(value));
                self.since = now;
            }
            0x28 => self.psc = value & 0xFFFF,
            0x2C => {
                self.arr = value;
                if self.cr1 & PRELOAD == 0 {
                    self.rebase(now, count);
                    self.arr_in_use = value;
                }
            }
            0x34..=0x40 if self.channels > 0 => {
                self.rebase(now, count);
                self.ccr[(offset as usize - 0x34) / 4] = value;
            }
            _ => return Err(unknown_register("write", self.name, offset)),
        }
        Ok(Trigger::None)
    }

    /// EGR: an update by software. In TRGO mode "reset" (MMS = 000) it is a trigger, too.
    fn generate(&mut self, now: Time, value: u32) -> Result<Trigger, Trap> {
        if value & !UPDATE != 0 {
            return Err(unknown_value(self.name, "EGR", value));
        }
        if value == 0 {
            return Ok(Trigger::None);
        }
        self.psc_in_use = self.psc;
        self.arr_in_use = self.arr;
        self.base = 0;
        self.since = now;
        self.handled_to = now;
        if self.cr1 & URS == 0 {
            self.sr |= UPDATE;
        }
        Ok(if matches!(self.cr2 >> 4 & 7, 0 | 2) { Trigger::Output } else { Trigger::None })
    }
}
