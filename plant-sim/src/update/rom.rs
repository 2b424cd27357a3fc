//! The bootloader in the ROM of the STM32, over a serial line: AN3155, "USART protocol used in the STM32 bootloader". 115 200 baud, 8
//! data bits, even parity.
//!
//! Every command is a byte and its complement; every part of it is acknowledged. Addresses and lengths carry a check byte, the
//! exclusive or of what it checks.

use std::io::{ErrorKind, Read, Write};

/// Most bytes of one write or read.
pub const BLOCK_BYTES: usize = 256;

const SYNC: u8 = 0x7F;
const ACK: u8 = 0x79;
const NACK: u8 = 0x1F;
const GET_ID: u8 = 0x02;
const READ: u8 = 0x11;
const GO: u8 = 0x21;
const WRITE: u8 = 0x31;
const EXTENDED_ERASE: u8 = 0x44;

/// STM32G471, G473, G474, G483, G484 (RM0440, DBGMCU_IDCODE).
pub const CHIP: u16 = 0x469;
/// Pages erased by one command: 32 take 0.7 s.
const PAGES_AT_ONCE: usize = 32;
/// Read time-outs (50 ms or so each) until an answer counts as lost: three seconds.
const PATIENCE: u32 = 60;

/// Why the update does not go on. Flash may hold half an image, which never starts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RomError {
    /// The port failed.
    Line(String),
    /// Nothing came back.
    Silent,
    /// It does not want to.
    Refused(&'static str),
    /// Another chip.
    Chip(u16),
    /// Flash does not hold what was written.
    Differs(u32),
}

impl std::fmt::Display for RomError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(error) => write!(f, "the serial port failed: {error}"),
            Self::Silent => f.write_str("the bootloader does not answer"),
            Self::Refused(what) => {
                write!(f, "the bootloader refuses to {what}; is the flash protected (option bytes)?")
            }
            Self::Chip(id) => {
                write!(f, "the chip is not an STM32G474 but one with number {id:#05x}; nothing was written")
            }
            Self::Differs(address) => write!(f, "flash does not hold what was written at {address:#010x}"),
        }
    }
}

impl std::error::Error for RomError {}

/// A bootloader that listens.
pub struct Rom<P> {
    port: P,
}

impl<P: Read + Write> Rom<P> {
    /// Wakes it, and asks which chip it is in.
    ///
    /// # Errors
    /// No answer, or another chip.
    pub fn connect(port: P) -> Result<Self, RomError> {
        let mut rom = Self { port };
        // A first byte sets its baud rate. One that has been woken before refuses the byte, which is an answer, too.
        rom.send(&[SYNC])?;
        match rom.byte()? {
            ACK | NACK => {}
            _ => return Err(RomError::Silent),
        }
        rom.command(GET_ID, "tell its chip")?;
        let more = rom.byte()?;
        let mut id = 0;
        for _ in 0..=more {
            id = id << 8 | u16::from(rom.byte()?);
        }
        rom.acknowledged("tell its chip")?;
        if id == CHIP { Ok(rom) } else { Err(RomError::Chip(id)) }
    }

    /// Erases so many pages from the beginning of bank 1.
    ///
    /// # Errors
    /// No answer, or a refusal.
    pub fn erase(&mut self, pages: usize) -> Result<(), RomError> {
        let pages: Vec<u16> = (0..pages as u16).collect();
        for some in pages.chunks(PAGES_AT_ONCE) {
            self.command(EXTENDED_ERASE, "erase")?;
            let count = (some.len() - 1) as u16;
            let list: Vec<u8> = std::iter::once(count).chain(some.iter().copied()).flat_map(u16::to_be_bytes).collect();
            self.checked(&list, "erase")?;
        }
        Ok(())
    }

    /// Writes a block at an address divisible by 8.
    ///
    /// # Errors
    /// No answer, or a refusal.
    pub fn write(&mut self, address: u32, block: &[u8]) -> Result<(), RomError> {
        self.command(WRITE, "write")?;
        self.checked(&address.to_be_bytes(), "write there")?;
        let mut message = vec![(block.len() - 1) as u8];
        message.extend(block);
        self.checked(&message, "write")
    }

    /// Reads a block back.
    ///
    /// # Errors
    /// No answer, a refusal, or other bytes.
    pub fn verify(&mut self, address: u32, block: &[u8]) -> Result<(), RomError> {
        self.command(READ, "be read")?;
        self.checked(&address.to_be_bytes(), "be read there")?;
        let count = (block.len() - 1) as u8;
        self.send(&[count, !count])?;
        self.acknowledged("be read")?;
        for (offset, byte) in block.iter().enumerate() {
            if self.byte()? != *byte {
                return Err(RomError::Differs(address + offset as u32));
            }
        }
        Ok(())
    }

    /// Leaves for the program whose vector (stack pointer, entry) stands at an address.
    ///
    /// # Errors
    /// No answer, or a refusal.
    pub fn go(&mut self, address: u32) -> Result<(), RomError> {
        self.command(GO, "leave")?;
        self.checked(&address.to_be_bytes(), "leave for that address")
    }

    fn command(&mut self, code: u8, what: &'static str) -> Result<(), RomError> {
        self.send(&[code, !code])?;
        self.acknowledged(what)
    }

    /// Bytes with their check byte.
    fn checked(&mut self, bytes: &[u8], what: &'static str) -> Result<(), RomError> {
        let mut message = bytes.to_vec();
        message.push(bytes.iter().fold(0, |sum, byte| sum ^ byte));
        self.send(&message)?;
        self.acknowledged(what)
    }

    fn acknowledged(&mut self, what: &'static str) -> Result<(), RomError> {
        match self.byte()? {
            ACK => Ok(()),
            _ => Err(RomError::Refused(what)),
        }
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), RomError> {
        self.port.write_all(bytes).and_then(|()| self.port.flush()).map_err(|error| RomError::Line(error.to_string()))
    }

    fn byte(&mut self) -> Result<u8, RomError> {
        let mut byte = [0];
        for _ in 0..PATIENCE {
            match self.port.read(&mut byte) {
                Ok(1..) => return Ok(byte[0]),
                Ok(0) => {}
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
                Err(error) => return Err(RomError::Line(error.to_string())),
            }
        }
        Err(RomError::Silent)
    }
}
