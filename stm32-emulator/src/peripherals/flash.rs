//! Flash memory: 512 KiB in two banks, programmed by double words, erased by pages of 2 KiB (RM0440, 3).
//!
//! While one bank is programmed or erased the other can be read; a read of the busy bank waits. A supply that fails in between
//! leaves a double word with wrong check bits, or a page that is neither old nor erased.

use std::collections::BTreeMap;

use super::{unknown_register, unknown_value};
use crate::core::Trap;
use crate::time::{NEVER, Time, UNITS_PER_SECOND};

/// Bytes of the whole memory and of a bank.
pub const FLASH_BYTES: usize = 512 << 10;
const BANK_BYTES: usize = FLASH_BYTES / 2;
/// Bytes of a page.
pub const PAGE_BYTES: usize = 2 << 10;

/// DS12288, flash memory characteristics: 22.02 ms typical for a page, 81.7 us for a double word.
const ERASE_TIME: Time = UNITS_PER_SECOND * 22 / 1000;
const PROGRAM_TIME: Time = UNITS_PER_SECOND * 82 / 1_000_000;

const END: u32 = 1;
const PROGRAM_ERROR: u32 = 1 << 3;
const SIZE_ERROR: u32 = 1 << 6;
const SEQUENCE_ERROR: u32 = 1 << 7;
/// All flags that are cleared by writing 1.
const CLEARABLE: u32 = 0xC3FB;
const BUSY: u32 = 1 << 16;

const PROGRAM: u32 = 1;
const ERASE_PAGE: u32 = 2;
const START: u32 = 1 << 16;
const LOCK: u32 = 1 << 31;
const OPTION_LOCK: u32 = 1 << 30;
/// Mass erase, option bytes, fast programming.
const NOT_MODELLED: u32 = 1 << 2 | 1 << 15 | 1 << 17 | 1 << 18 | 1 << 27;

/// Double error found, and in which bank (FLASH_ECCR).
const ECC_DETECTED: u32 = 1 << 31;
const ECC_CORRECTED: u32 = 1 << 30;
const ECC_BANK_2: u32 = 1 << 21;

/// What check bits say of a double word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ecc {
    /// One bit is wrong: corrected when read, and noted.
    Corrected,
    /// Two bits or more: read as it is, and a non-maskable interrupt.
    Detected,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operation {
    Program { at: usize, value: u64 },
    Erase { page: usize },
}

/// Memory and its controller.
#[derive(Clone, Debug)]
pub struct Flash {
    /// What is stored. Survives resets and power cuts.
    pub bytes: Vec<u8>,
    /// Double words, by offset, whose check bits are wrong.
    damaged: BTreeMap<usize, Ecc>,
    acr: u32,
    cr: u32,
    sr: u32,
    eccr: u32,
    /// Option bytes: bit 22 says whether there are two banks.
    pub optr: u32,
    /// Every order to program or erase is refused with a programming error (a fault).
    pub refusing: bool,
    /// The busy flag cannot be cleared (a fault).
    pub busy_stuck: bool,
    keys: u32,
    first_word: Option<(usize, u32)>,
    operation: Option<(Operation, Time)>,
    /// Erasures of each page and programmed double words, for tests.
    pub erased: u64,
    /// Double words programmed.
    pub programmed: u64,
}

impl Flash {
    pub(crate) fn new() -> Self {
        Self {
            bytes: vec![0xFF; FLASH_BYTES],
            damaged: BTreeMap::new(),
            acr: 0x600,
            cr: LOCK | OPTION_LOCK,
            sr: 0,
            eccr: 0,
            // As shipped: two banks.
            optr: 0xFFEF_F8AA,
            refusing: false,
            busy_stuck: false,
            keys: 0,
            first_word: None,
            operation: None,
            erased: 0,
            programmed: 0,
        }
    }

    /// Registers after a reset. An operation that runs is finished by the hardware unless the supply fails.
    pub(crate) fn reset(&mut self) {
        if let Some((operation, _)) = self.operation.take() {
            self.finish(operation);
        }
        (self.acr, self.cr, self.sr, self.eccr) = (0x600, LOCK | OPTION_LOCK, 0, 0);
        (self.keys, self.first_word) = (0, None);
    }

    /// The supply fails: an operation that runs stops halfway.
    pub(crate) fn cut(&mut self) {
        match self.operation.take() {
            Some((Operation::Program { at, value }, _)) => {
                // Half of the bits have reached their state, and the check bits fit neither.
                let old = self.double_word(at);
                self.set_double_word(at, old & (value | 0xAAAA_AAAA_AAAA_AAAA));
                self.damaged.insert(at, Ecc::Detected);
            }
            Some((Operation::Erase { page }, _)) => {
                for at in (page * PAGE_BYTES..(page + 1) * PAGE_BYTES).step_by(8) {
                    let old = self.double_word(at);
                    self.set_double_word(at, old | 0x5555_5555_5555_5555);
                    self.damaged.insert(at, Ecc::Detected);
                }
            }
            None => {}
        }
        self.reset();
    }

    /// Takes all wrong check bits away.
    pub fn repair(&mut self) {
        self.damaged.clear();
    }

    /// Damages the check bits of the double word that contains `offset`.
    pub fn damage(&mut self, offset: usize, ecc: Ecc) {
        self.damaged.insert(offset & !7, ecc);
    }

    fn double_word(&self, at: usize) -> u64 {
        let bytes = self.bytes.get(at..at + 8).and_then(|bytes| bytes.try_into().ok());
        u64::from_le_bytes(bytes.unwrap_or([0xFF; 8]))
    }

    fn set_double_word(&mut self, at: usize, value: u64) {
        if let Some(bytes) = self.bytes.get_mut(at..at + 8) {
            bytes.copy_from_slice(&value.to_le_bytes());
        }
    }

    fn finish(&mut self, operation: Operation) {
        match operation {
            Operation::Program { at, value } => {
                self.set_double_word(at, value);
                self.programmed += 1;
            }
            Operation::Erase { page } => {
                if let Some(bytes) = self.bytes.get_mut(page * PAGE_BYTES..(page + 1) * PAGE_BYTES) {
                    bytes.fill(0xFF);
                }
                self.damaged.retain(|at, _| at / PAGE_BYTES != page);
                self.erased += 1;
            }
        }
    }

    pub(crate) fn next_event(&self) -> Time {
        self.operation.map_or(NEVER, |(_, done)| done)
    }

    pub(crate) fn event(&mut self, now: Time) {
        if let Some((operation, done)) = self.operation
            && done <= now
        {
            self.operation = None;
            self.finish(operation);
            self.sr &= !BUSY;
            if self.cr >> 24 & 1 != 0 {
                self.sr |= END;
            }
        }
    }

    /// Whether the controller works on a page or word.
    #[must_use]
    pub fn busy(&self) -> bool {
        self.operation.is_some()
    }

    /// Until when a read at `offset` has to wait.
    #[inline]
    pub(crate) fn waits_until(&self, offset: usize) -> Option<Time> {
        let (operation, done) = self.operation?;
        let at = match operation {
            Operation::Program { at, .. } => at,
            Operation::Erase { page } => page * PAGE_BYTES,
        };
        (at / BANK_BYTES == offset / BANK_BYTES).then_some(done)
    }

    /// Whether any word has wrong check bits: then reads must ask [`Flash::check`].
    #[inline]
    pub(crate) fn is_damaged(&self) -> bool {
        !self.damaged.is_empty()
    }

    /// Notes the read of a damaged double word; whether a non-maskable interrupt follows.
    pub(crate) fn check(&mut self, offset: usize) -> bool {
        let Some(ecc) = self.damaged.get(&(offset & !7)) else { return false };
        let place = (offset % BANK_BYTES / 8) as u32 | if offset >= BANK_BYTES { ECC_BANK_2 } else { 0 };
        let flag = if *ecc == Ecc::Detected { ECC_DETECTED } else { ECC_CORRECTED };
        // The address of the first error stays until it is acknowledged.
        if self.eccr & (ECC_DETECTED | ECC_CORRECTED) == 0 {
            self.eccr = self.eccr & 0x0100_0000 | place;
        }
        self.eccr |= flag;
        *ecc == Ecc::Detected
    }

    pub(crate) fn interrupt(&self) -> bool {
        let end = self.cr >> 24 & 1 != 0 && self.sr & END != 0;
        // OPERR follows any error while the error interrupt is on.
        let error = self.cr >> 25 & 1 != 0 && self.sr & 2 != 0;
        end || error
    }

    fn error(&mut self, flag: u32) {
        self.sr |= flag;
        if self.cr >> 25 & 1 != 0 {
            self.sr |= 2;
        }
    }

    /// A write into the memory itself: two words program a double word.
    pub(crate) fn program(&mut self, now: Time, offset: usize, bytes: u32, value: u32) {
        if self.cr & PROGRAM == 0 || self.cr & LOCK != 0 || self.operation.is_some() {
            return self.error(SEQUENCE_ERROR);
        }
        if bytes != 4 {
            return self.error(SIZE_ERROR);
        }
        if self.refusing {
            return self.error(PROGRAM_ERROR);
        }
        match self.first_word.take() {
            None if offset.is_multiple_of(8) => self.first_word = Some((offset, value)),
            Some((first, low)) if first + 4 == offset => {
                let value = u64::from(value) << 32 | u64::from(low);
                // Only an erased double word can be programmed, or anything to all zeros.
                let erased = self.double_word(first) == u64::MAX && !self.damaged.contains_key(&first);
                if !erased && value != 0 {
                    return self.error(PROGRAM_ERROR);
                }
                self.sr |= BUSY;
                self.operation = Some((Operation::Program { at: first, value }, now + PROGRAM_TIME));
            }
            _ => self.error(SEQUENCE_ERROR),
        }
    }

    pub(crate) fn read(&self, offset: u32) -> Result<u32, Trap> {
        Ok(match offset {
            0x00 => self.acr,
            0x10 => self.sr | if self.busy_stuck { BUSY } else { 0 },
            0x14 => self.cr,
            0x18 => self.eccr,
            0x20 => self.optr,
            0x04..=0x0C => 0,
            _ => return Err(unknown_register("read", "FLASH", offset)),
        })
    }

    pub(crate) fn write(&mut self, now: Time, offset: u32, value: u32) -> Result<(), Trap> {
        match offset {
            0x00 => self.acr = value,
            0x08 => {
                self.keys = match (self.keys, value) {
                    (0, 0x4567_0123) => 1,
                    (1, 0xCDEF_89AB) => {
                        self.cr &= !LOCK;
                        0
                    }
                    _ => return Err(Trap::unmodelled("a wrong key for the flash: a bus fault and a lock until reset")),
                }
            }
            0x10 => self.sr &= !(value & CLEARABLE),
            0x14 => {
                if self.cr & LOCK != 0 {
                    return Ok(());
                }
                if value & NOT_MODELLED != 0 {
                    return Err(unknown_value("FLASH", "CR", value));
                }
                self.cr = value & !START | OPTION_LOCK;
                if value & START != 0 {
                    if value & ERASE_PAGE == 0 || self.operation.is_some() {
                        self.error(SEQUENCE_ERROR);
                    } else if self.refusing {
                        self.error(PROGRAM_ERROR);
                    } else {
                        let page = (value >> 3 & 0x7F) as usize + if value >> 11 & 1 != 0 { 128 } else { 0 };
                        self.sr |= BUSY;
                        self.operation = Some((Operation::Erase { page }, now + ERASE_TIME));
                    }
                }
            }
            0x18 => self.eccr = self.eccr & !(value & 0xF000_0000) & !0x0100_0000 | value & 0x0100_0000,
            _ => return Err(unknown_register("write", "FLASH", offset)),
        }
        Ok(())
    }
}
