//! New firmware over the serial line, through the bootloader in the chip's ROM; the parameters stay where they are.
//!
//! | file | contents |
//! | --- | --- |
//! | `image.rs` | the firmware's file: what would be written, and whether it is for this chip and board |
//! | `rom.rs` | the protocol of the bootloader (AN3155) |
//!
//! Why the ROM's bootloader and not one of our own: `docs/decisions/update.md`.

pub mod image;
pub mod rom;

use image::Image;
use rom::{Rom, RomError};
use std::io::{Read, Write};

/// Bytes of a page of flash.
pub const PAGE_BYTES: usize = 2048;
/// The vector table's first double word: stack pointer and entry. While it is blank the chip starts nothing.
const START_BYTES: usize = 8;

/// Writes an image and starts it. The first double word comes last, so that half an image never runs; what was written is read back.
///
/// # Errors
/// The bootloader does not answer or refuses, or flash does not hold what was written.
pub fn write<P: Read + Write>(port: P, image: &Image, tell: &mut dyn FnMut(&str)) -> Result<(), RomError> {
    let mut rom = Rom::connect(port)?;
    let pages = image.bytes.len().div_ceil(PAGE_BYTES);
    tell(&format!("erasing {pages} pages of bank 1"));
    rom.erase(pages)?;
    let (start, rest) = image.bytes.split_at(START_BYTES.min(image.bytes.len()));
    tell(&format!("writing {} bytes", image.bytes.len()));
    for (block, address) in blocks(rest, image::FLASH + START_BYTES as u32) {
        rom.write(address, block)?;
    }
    tell("reading them back");
    for (block, address) in blocks(rest, image::FLASH + START_BYTES as u32) {
        rom.verify(address, block)?;
    }
    rom.write(image::FLASH, start)?;
    rom.verify(image::FLASH, start)?;
    tell("starting it");
    rom.go(image.restart)
}

fn blocks(bytes: &[u8], from: u32) -> impl Iterator<Item = (&[u8], u32)> {
    bytes.chunks(rom::BLOCK_BYTES).zip((from..).step_by(rom::BLOCK_BYTES))
}
