//! The log block that the firmware keeps in RAM (SEGGER RTT): read as a debug probe reads it.

use crate::analog::Analog;
use crate::machine::Machine;
use crate::memory::RAM;

/// Offset of the first up-channel, and of its fields: buffer, size, write and read offset.
const CHANNEL: usize = 24;
const BUFFER: usize = 4;
const SIZE: usize = 8;
const WRITE: usize = 12;
const READ: usize = 16;

/// What the block begins with, once the firmware has set it up.
const MAGIC: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";

fn word(ram: &[u8], at: usize) -> Option<usize> {
    Some(u32::from_le_bytes(ram.get(at..at + 4)?.try_into().ok()?) as usize)
}

/// Takes what the firmware has logged since the last call. `None`: there is no block, or it makes no sense.
pub fn take<A: Analog>(machine: &mut Machine<A>) -> Option<Vec<u8>> {
    let ram = &mut machine.chip.ram;
    let block = ram.windows(MAGIC.len()).step_by(4).position(|bytes| bytes == MAGIC)? * 4;
    let channel = block + CHANNEL;
    let buffer = word(ram, channel + BUFFER)?.checked_sub(RAM as usize)?;
    let size = word(ram, channel + SIZE)?;
    let (write, read) = (word(ram, channel + WRITE)?, word(ram, channel + READ)?);
    let bytes = ram.get(buffer..buffer.checked_add(size)?)?;
    if write >= size || read >= size {
        return None;
    }
    let taken = if write >= read { bytes[read..write].to_vec() } else { [&bytes[read..], &bytes[..write]].concat() };
    ram.get_mut(channel + READ..channel + READ + 4)?.copy_from_slice(&(write as u32).to_le_bytes());
    Some(taken)
}
