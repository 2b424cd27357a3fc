//! Frames: COBS around postcard around a CRC-32.

use crc::{CRC_32_ISCSI, Crc};
use postcard::ser_flavors::{Cobs, Slice, crc::CrcModifier};
use serde::{Serialize, de::DeserializeOwned};

/// Longest frame, zeros included, in bytes. The longest response (a panic message) is 190.
pub const FRAME_BYTES: usize = 256;

/// Detects every burst of up to 32 bits, and one random frame in 4 billion passes.
const CHECK: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);
const CHECK_BYTES: usize = 4;

/// Why a frame was thrown away. It changed nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameError {
    /// Longer than [`FRAME_BYTES`].
    TooLong,
    /// Byte stuffing broken, or too short to hold a check value.
    Malformed,
    /// The check value does not fit the content.
    Corrupt,
    /// The check value fits, but the content is no message of this protocol.
    Unknown,
}

/// A message does not fit into the buffer offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncodeError;

/// Writes one message as one frame, and returns the part of `buffer` used.
///
/// # Errors
/// If `buffer` is too short; [`FRAME_BYTES`] is enough for every message of this crate.
pub fn encode<'b, T: Serialize>(message: &T, buffer: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
    let (first, rest) = buffer.split_first_mut().ok_or(EncodeError)?;
    *first = 0;
    let flavor = Cobs::try_new(Slice::new(rest)).map_err(|_| EncodeError)?;
    let used = postcard::serialize_with_flavor(message, CrcModifier::new(flavor, CHECK.digest()))
        .map_err(|_| EncodeError)?
        .len();
    buffer.get(..=used).ok_or(EncodeError)
}

/// Collects bytes until a frame is complete.
#[derive(Debug)]
pub struct Accumulator {
    bytes: [u8; FRAME_BYTES],
    len: usize,
    too_long: bool,
}

impl Default for Accumulator {
    fn default() -> Self {
        Self::new()
    }
}

impl Accumulator {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self { bytes: [0; FRAME_BYTES], len: 0, too_long: false }
    }

    /// Takes one byte. Returns `None` while a frame is incomplete (and for empty frames, which separate others).
    pub fn push<T: DeserializeOwned>(&mut self, byte: u8) -> Option<Result<T, FrameError>> {
        if byte != 0 {
            match self.bytes.get_mut(self.len) {
                Some(slot) => {
                    *slot = byte;
                    self.len += 1;
                }
                // Kept until the next zero, so that the tail of an oversized frame is not taken for a frame.
                None => self.too_long = true,
            }
            return None;
        }
        let (len, too_long) = (core::mem::take(&mut self.len), core::mem::take(&mut self.too_long));
        if too_long {
            return Some(Err(FrameError::TooLong));
        }
        if len == 0 {
            return None;
        }
        let frame = self.bytes.get_mut(..len)?;
        Some(decode(frame))
    }
}

/// Decodes the content between two zeros, in place.
fn decode<T: DeserializeOwned>(frame: &mut [u8]) -> Result<T, FrameError> {
    let len = cobs::decode_in_place(frame).map_err(|_| FrameError::Malformed)?;
    let content = frame.get(..len).ok_or(FrameError::Malformed)?;
    let (message, check) = content.split_last_chunk::<CHECK_BYTES>().ok_or(FrameError::Malformed)?;
    if CHECK.checksum(message) != u32::from_le_bytes(*check) {
        return Err(FrameError::Corrupt);
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Ok(message),
        Ok(_) | Err(_) => Err(FrameError::Unknown),
    }
}
