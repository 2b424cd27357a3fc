//! Low-power UART (RM0440, 38): both lines are queues of bytes that take their time.

use std::collections::VecDeque;

use super::{unknown_register, unknown_value};
use crate::core::Trap;
use crate::time::{NEVER, Time};

const OVERRUN: u32 = 1 << 3;
const IDLE: u32 = 1 << 4;
const RECEIVED: u32 = 1 << 5;
const COMPLETE: u32 = 1 << 6;
const EMPTY: u32 = 1 << 7;

/// Depth of the FIFO of the low-power UART.
const FIFO_BYTES: usize = 8;

/// Bits of a frame: start, eight of data, stop.
const FRAME_BITS: u64 = 10;

/// The port.
#[derive(Clone, Debug)]
pub struct Lpuart {
    cr1: u32,
    cr2: u32,
    cr3: u32,
    brr: u32,
    prescaler: u32,
    isr: u32,
    received: VecDeque<u8>,
    /// Bytes on their way to the chip.
    incoming: VecDeque<u8>,
    arrives_at: Time,
    idle_at: Time,
    /// What waits in the data register or its FIFO, and what is being shifted out.
    waiting: VecDeque<u8>,
    shifting: Option<(u8, Time)>,
    outgoing: Vec<u8>,
    units: u64,
    /// The interrupt line is stuck (a fault).
    pub interrupt_stuck: bool,
}

impl Default for Lpuart {
    fn default() -> Self {
        Self {
            cr1: 0,
            cr2: 0,
            cr3: 0,
            brr: 0,
            prescaler: 0,
            isr: EMPTY | COMPLETE,
            received: VecDeque::new(),
            incoming: VecDeque::new(),
            arrives_at: NEVER,
            idle_at: NEVER,
            waiting: VecDeque::new(),
            shifting: None,
            outgoing: Vec::new(),
            units: 1,
            interrupt_stuck: false,
        }
    }
}

impl Lpuart {
    fn frame_time(&self) -> Time {
        // RM0440, 38.4.7: baud = 256 · clock / BRR.
        FRAME_BITS * u64::from(self.brr) * self.units / 256
    }

    /// Bytes that fit ahead of the shift registers (RM0440, 38.3: a FIFO of eight, or one register).
    fn depth(&self) -> usize {
        if self.cr1 >> 29 & 1 != 0 { FIFO_BYTES } else { 1 }
    }

    fn receiving(&self) -> bool {
        self.cr1 & 5 == 5
    }

    pub(crate) fn set_clock(&mut self, units: u64) {
        self.units = units;
    }

    /// Puts bytes on the line to the chip, one after another.
    pub(crate) fn send(&mut self, now: Time, bytes: &[u8]) {
        self.incoming.extend(bytes);
        if self.arrives_at == NEVER && !self.incoming.is_empty() {
            self.arrives_at = now + self.frame_time().max(1);
        }
    }

    /// What the chip has sent since the last call.
    pub fn take_sent(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.outgoing)
    }

    pub(crate) fn next_event(&self) -> Time {
        self.arrives_at.min(self.idle_at).min(self.shifting.map_or(NEVER, |(_, done)| done))
    }

    pub(crate) fn event(&mut self, now: Time) {
        if self.arrives_at <= now {
            if let Some(byte) = self.incoming.pop_front()
                && self.receiving()
            {
                if self.received.len() >= self.depth() {
                    self.isr |= OVERRUN;
                } else {
                    self.received.push_back(byte);
                    self.isr |= RECEIVED;
                }
            }
            self.idle_at = now + self.frame_time().max(1);
            self.arrives_at = if self.incoming.is_empty() { NEVER } else { self.idle_at };
            if self.arrives_at != NEVER {
                self.idle_at = NEVER;
            }
        }
        if self.idle_at <= now {
            self.idle_at = NEVER;
            if self.receiving() {
                self.isr |= IDLE;
            }
        }
        if let Some((byte, done)) = self.shifting
            && done <= now
        {
            self.outgoing.push(byte);
            self.shifting = None;
            self.shift(now);
            if self.shifting.is_none() {
                self.isr |= COMPLETE;
            }
        }
    }

    fn shift(&mut self, now: Time) {
        if self.shifting.is_none()
            && let Some(byte) = self.waiting.pop_front()
        {
            self.shifting = Some((byte, now + self.frame_time()));
        }
        // With the FIFO the flag means "not full".
        if self.waiting.len() < self.depth() {
            self.isr |= EMPTY;
        } else {
            self.isr &= !EMPTY;
        }
    }

    pub(crate) fn interrupt(&self) -> bool {
        // Interrupt enables of IDLE, RXNE, TC and TXE stand where their flags do.
        let enabled = self.cr1 & (IDLE | RECEIVED | COMPLETE | EMPTY);
        let overrun = self.isr & OVERRUN != 0 && (self.cr1 & RECEIVED != 0 || self.cr3 & 1 != 0);
        self.isr & enabled != 0 || overrun || self.interrupt_stuck
    }

    pub(crate) fn read(&mut self, offset: u32) -> Result<u32, Trap> {
        Ok(match offset {
            0x00 => self.cr1,
            0x04 => self.cr2,
            0x08 => self.cr3,
            0x0C => self.brr,
            // TEACK and REACK follow TE and RE while the port is on.
            0x1C => {
                let on = self.cr1 & 1;
                self.isr | (self.cr1 >> 3 & on) << 21 | (self.cr1 >> 2 & on) << 22
            }
            0x20 => 0,
            0x24 => {
                let byte = self.received.pop_front().unwrap_or(0);
                if self.received.is_empty() {
                    self.isr &= !RECEIVED;
                }
                u32::from(byte)
            }
            0x28 => 0,
            0x2C => self.prescaler,
            _ => return Err(unknown_register("read", "LPUART1", offset)),
        })
    }

    pub(crate) fn write(&mut self, now: Time, offset: u32, value: u32) -> Result<(), Trap> {
        match offset {
            0x00 => {
                // Interrupts of a full or empty FIFO, word lengths other than 8, parity.
                if value & (3 << 30 | 1 << 28 | 1 << 12 | 1 << 10) != 0 {
                    return Err(unknown_value("LPUART1", "CR1", value));
                }
                self.cr1 = value;
            }
            0x04 if value == 0 => self.cr2 = value,
            0x04 => return Err(unknown_value("LPUART1", "CR2", value)),
            0x08 => {
                // DMA, half duplex, flow control.
                if value & 0x3C8 != 0 {
                    return Err(unknown_value("LPUART1", "CR3", value));
                }
                self.cr3 = value;
            }
            0x0C => self.brr = value,
            0x18 => {
                if value & 8 != 0 {
                    self.received.clear();
                    self.isr &= !RECEIVED;
                }
            }
            0x20 => self.isr &= !(value & (0x1F | COMPLETE)),
            0x28 => {
                // A byte written into a full FIFO is lost.
                if self.waiting.len() < self.depth() {
                    self.waiting.push_back(value as u8);
                }
                self.isr &= !COMPLETE;
                self.shift(now);
            }
            0x2C if value == 0 => {}
            _ => return Err(unknown_register("write", "LPUART1", offset)),
        }
        Ok(())
    }
}
