//! The bootloader in ROM as AN3155 describes it, for tests: it takes bytes, and erases and writes a memory as flash does.

use std::collections::VecDeque;
use std::io::{Error, ErrorKind, Read, Result, Write};

/// First byte of flash.
const FLASH: u32 = 0x0800_0000;
const PAGE_BYTES: usize = 2048;
const ACK: u8 = 0x79;
const NACK: u8 = 0x1F;

/// What it waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Awaits {
    Sync,
    Command,
    Pages,
    Address(u8),
    Block(u32),
    Count(u32),
}

/// A bootloader with its flash.
pub struct RomModel<'f> {
    flash: &'f mut [u8],
    chip: u16,
    awaits: Awaits,
    taken: Vec<u8>,
    answers: VecDeque<u8>,
    /// Bytes that it still takes before its power fails.
    power: Option<usize>,
    /// Bits of written double words that stick (a fault): none by default.
    stuck: u8,
    /// The vector it was told to go to.
    gone: Option<u32>,
}

impl<'f> RomModel<'f> {
    /// With this flash, in a chip with this number.
    pub fn new(flash: &'f mut [u8], chip: u16) -> Self {
        let (taken, answers) = (Vec::new(), VecDeque::new());
        Self { flash, chip, awaits: Awaits::Sync, taken, answers, power: None, stuck: 0, gone: None }
    }

    /// Its power fails when so many bytes have come.
    #[must_use]
    pub fn with_power_for(mut self, bytes: usize) -> Self {
        self.power = Some(bytes);
        self
    }

    /// Its flash keeps these bits of every byte at 1.
    #[must_use]
    pub fn with_stuck_bits(mut self, bits: u8) -> Self {
        self.stuck = bits;
        self
    }

    /// Where it has gone.
    #[must_use]
    pub fn gone(&self) -> Option<u32> {
        self.gone
    }

    fn answer(&mut self, good: bool, then: Awaits) {
        self.answers.push_back(if good { ACK } else { NACK });
        self.awaits = if good { then } else { Awaits::Command };
        self.taken.clear();
    }

    fn command(&mut self, code: u8) {
        let good = self.taken[1] == !code;
        match code {
            _ if !good => self.answer(false, Awaits::Command),
            0x02 => {
                let [high, low] = self.chip.to_be_bytes();
                self.answers.extend([ACK, 1, high, low]);
                self.answer(true, Awaits::Command);
            }
            0x44 => self.answer(true, Awaits::Pages),
            0x11 | 0x21 | 0x31 => self.answer(true, Awaits::Address(code)),
            _ => self.answer(false, Awaits::Command),
        }
    }

    fn place(&self, address: u32, bytes: usize) -> Option<std::ops::Range<usize>> {
        let start = address.checked_sub(FLASH)? as usize;
        (start + bytes <= self.flash.len()).then(|| start..start + bytes)
    }

    fn take(&mut self, byte: u8) {
        self.taken.push(byte);
        let sum = self.taken.iter().fold(0, |sum, byte| sum ^ byte);
        match (self.awaits, &self.taken[..]) {
            (Awaits::Sync, [sync]) => {
                let good = *sync == 0x7F;
                self.answer(good, Awaits::Command);
            }
            (Awaits::Command, [code, _]) => self.command(*code),
            (Awaits::Pages, [high, low, pages @ ..])
                if pages.len() == 2 * (usize::from(u16::from_be_bytes([*high, *low])) + 1) + 1 =>
            {
                let pages: Vec<usize> =
                    pages.chunks_exact(2).map(|page| usize::from(u16::from_be_bytes([page[0], page[1]]))).collect();
                let good = sum == 0 && pages.iter().all(|page| (page + 1) * PAGE_BYTES <= self.flash.len());
                for page in pages.into_iter().filter(|_| good) {
                    self.flash[page * PAGE_BYTES..(page + 1) * PAGE_BYTES].fill(0xFF);
                }
                self.answer(good, Awaits::Command);
            }
            (Awaits::Address(code), [a, b, c, d, _]) => {
                let address = u32::from_be_bytes([*a, *b, *c, *d]);
                let good = sum == 0 && self.place(address, 8).is_some();
                if good && code == 0x21 {
                    self.gone = Some(address);
                }
                let then = match code {
                    0x11 => Awaits::Count(address),
                    0x31 => Awaits::Block(address),
                    _ => Awaits::Command,
                };
                self.answer(good, then);
            }
            (Awaits::Count(address), [count, complement]) => {
                let place = self.place(address, usize::from(*count) + 1).filter(|_| *complement == !count);
                let read: Vec<u8> = place.map(|place| self.flash[place].to_vec()).unwrap_or_default();
                self.answer(!read.is_empty(), Awaits::Command);
                self.answers.extend(read);
            }
            (Awaits::Block(address), [count, data @ ..]) if data.len() == usize::from(*count) + 2 => {
                let data = data[..data.len() - 1].to_vec();
                // Double words that are blank: others cannot be written.
                let place = self.place(address, data.len()).filter(|place| {
                    let whole = address % 8 == 0 && data.len() % 8 == 0;
                    sum == 0 && whole && self.flash[place.clone()].iter().all(|byte| *byte == 0xFF)
                });
                if let Some(place) = place.clone() {
                    for (slot, byte) in self.flash[place].iter_mut().zip(data) {
                        *slot = byte | self.stuck;
                    }
                }
                self.answer(place.is_some(), Awaits::Command);
            }
            _ => {}
        }
    }
}

impl Write for RomModel<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        for byte in bytes {
            match &mut self.power {
                Some(0) => {
                    self.answers.clear();
                    break;
                }
                Some(left) => *left -= 1,
                None => {}
            }
            self.take(*byte);
        }
        Ok(bytes.len())
    }
    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Read for RomModel<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let count = self.answers.len().min(buffer.len());
        for (slot, byte) in buffer.iter_mut().zip(self.answers.drain(..count)) {
            *slot = byte;
        }
        if count == 0 { Err(Error::from(ErrorKind::TimedOut)) } else { Ok(count) }
    }
}
