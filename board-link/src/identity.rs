//! What a firmware image says of itself, in its own flash, so that a desktop can tell before it writes it.
//!
//! ```text
//!   offset │ 0: mark │ 16: vector of a restart: stack pointer, code │ 24: four numbers │ 28: board │ 52: firmware │
//! ```

/// How the block begins. Sixteen bytes that no other part of an image holds.
pub const MARK: [u8; 16] = *b"\x7FPOSITIONER\xF0IMG1";
/// Bytes of the block.
pub const IDENTITY_BYTES: usize = 68;
/// Where the restart's vector stands in it: a stack pointer and an entry, as the ROM bootloader's "go" takes them.
pub const RESTART_VECTOR: usize = 16;

const NUMBERS: usize = 24;
const BOARD: usize = 28;
const FIRMWARE: usize = 52;

/// The block in a firmware's flash. `repr(C)`: its layout is that of the file's head.
#[repr(C)]
pub struct Identity {
    mark: [u8; 16],
    /// What the ROM bootloader jumps to when the update is done: it resets the chip.
    restart: (*const u32, extern "C" fn() -> !),
    numbers: [u8; 4],
    board: [u8; 24],
    firmware: [u8; 16],
}

// A pointer in it is an address for a host to read; this program never follows it.
impl Identity {
    /// Of a firmware for `board` that stores parameters in this layout. Longer texts are cut.
    #[must_use]
    pub const fn new(
        restart: (*const u32, extern "C" fn() -> !),
        protocol: u8,
        parameters: u8,
        board: &str,
        firmware: &str,
    ) -> Self {
        let numbers = [protocol, parameters, 0, 0];
        Self { mark: MARK, restart, numbers, board: padded(board), firmware: padded(firmware) }
    }
}

const fn padded<const N: usize>(text: &str) -> [u8; N] {
    let mut out = [0; N];
    let (bytes, mut at) = (text.as_bytes(), 0);
    while at < N && at < bytes.len() {
        out[at] = bytes[at];
        at += 1;
    }
    out
}

/// What a desktop reads of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Told<'i> {
    /// Version of the protocol it speaks.
    pub protocol: u8,
    /// Layout of the parameters that it reads and writes.
    pub parameters: u8,
    /// The board it is for.
    pub board: &'i str,
    /// Its version.
    pub firmware: &'i str,
    /// Where in the image the restart's vector stands.
    pub restart_at: usize,
}

/// Finds the block in an image. `None` if there is none, or more than one.
#[must_use]
pub fn find(image: &[u8]) -> Option<Told<'_>> {
    let places = || image.windows(IDENTITY_BYTES).enumerate().filter(|(_, bytes)| bytes.starts_with(&MARK));
    let (at, block) = places().next()?;
    if places().nth(1).is_some() {
        return None;
    }
    let text = |from: usize, to: usize| {
        let bytes = block.get(from..to)?;
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        core::str::from_utf8(bytes.get(..end)?).ok()
    };
    let [protocol, parameters, ..] = *block.get(NUMBERS..BOARD)? else { return None };
    Some(Told {
        protocol,
        parameters,
        board: text(BOARD, FIRMWARE)?,
        firmware: text(FIRMWARE, IDENTITY_BYTES)?,
        restart_at: at + RESTART_VECTOR,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> [u8; 400] {
        let mut image = [0xFF; 400];
        image[100..116].copy_from_slice(&MARK);
        image[100 + NUMBERS..100 + BOARD].copy_from_slice(&[5, 1, 0, 0]);
        image[100 + BOARD..100 + FIRMWARE].copy_from_slice(&padded::<24>("a-board"));
        image[100 + FIRMWARE..100 + IDENTITY_BYTES].copy_from_slice(&padded::<16>("1.2.3"));
        image
    }

    #[test]
    fn a_block_is_found_once_or_not_at_all() {
        let mut image = image();
        let told = find(&image).expect("there is one");
        assert_eq!((told.protocol, told.parameters, told.board, told.firmware), (5, 1, "a-board", "1.2.3"));
        assert_eq!(told.restart_at, 116);
        image[300..316].copy_from_slice(&MARK);
        assert_eq!(find(&image), None);
        assert_eq!(find(&[0; 400]), None);
        assert_eq!(find(&[]), None);
    }
}
