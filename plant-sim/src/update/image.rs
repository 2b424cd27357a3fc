//! The firmware's file: what would be written, and whether it is for this chip and board.

use board_link::identity::{self, RESTART_VECTOR};
use board_link::{PROTOCOL_VERSION, Version};
use object::read::elf::{FileHeader as _, ProgramHeader as _};
use rig_files::InputError;

/// First byte of flash.
pub const FLASH: u32 = 0x0800_0000;
/// Bytes of bank 1: the program's. The parameters stand at the end of bank 2.
const BANK_1_BYTES: usize = 256 << 10;
/// RAM of the STM32G474: 128 KiB.
const RAM: std::ops::RangeInclusive<u32> = 0x2000_0000..=0x2002_0000;

/// A firmware for this chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// What flash holds from its first byte on, blank where nothing is written; whole double words.
    pub bytes: Vec<u8>,
    /// The board it is for.
    pub board: String,
    /// Its version.
    pub firmware: String,
    /// Layout of the parameters that it reads.
    pub parameters: u8,
    /// Address of the vector by which the ROM starts it.
    pub restart: u32,
}

impl Image {
    /// Reads an ELF file; `file` is what errors call it.
    ///
    /// # Errors
    /// It is no firmware of this project for the STM32G474, or one whose protocol this program does not speak.
    pub fn of_elf(elf: &[u8], file: &str) -> Result<Self, InputError> {
        let wrong = |what: String| {
            let remedy = "give the file that `cargo fw` makes: target/thumbv7em-none-eabihf/firmware/firmware";
            InputError::new(file, what, remedy)
        };
        let bytes = loadable(elf).map_err(|what| wrong(format!("is no firmware for this chip: {what}")))?;
        let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
        let inside = |address: u32| address & 1 == 1 && (FLASH..FLASH + bytes.len() as u32).contains(&address);
        let vector = |at: usize| {
            let (stack, entry) = (word(at)?, word(at + 4)?);
            (RAM.contains(&stack) && inside(entry)).then_some(())
        };
        vector(0).ok_or_else(|| wrong("has no vector table at the beginning of flash".into()))?;
        let told = identity::find(&bytes).ok_or_else(|| {
            wrong("does not say which board it is for; it is not this project's firmware, or an old one".into())
        })?;
        vector(told.restart_at).ok_or_else(|| wrong("names no way to start it".into()))?;
        if told.protocol != PROTOCOL_VERSION {
            let problem = format!("speaks protocol version {}, this program {PROTOCOL_VERSION}", told.protocol);
            return Err(InputError::new(
                file,
                problem,
                "use `plant-sim` of the same sources: cargo install --path plant-sim",
            ));
        }
        debug_assert!(told.restart_at >= RESTART_VECTOR);
        Ok(Self {
            board: told.board.to_owned(),
            firmware: told.firmware.to_owned(),
            parameters: told.parameters,
            restart: FLASH + told.restart_at as u32,
            bytes,
        })
    }

    /// Whether it is for the board that answers; `anew` says that its parameters may be lost.
    ///
    /// # Errors
    /// A sentence with the remedy.
    pub fn suits(&self, board: &Version, anew: bool) -> Result<(), String> {
        if board.board != self.board.as_str() {
            return Err(format!(
                "this firmware is for a {}, and the board is a {}; build it for that board",
                self.board, board.board
            ));
        }
        if board.parameters != self.parameters && !anew {
            return Err(format!(
                "this firmware stores parameters in layout {}, the board has layout {}: they would be lost; write them to a file \
                 first (`parameters --out FILE`), update with --new-parameters, then `apply FILE --save`",
                self.parameters, board.parameters
            ));
        }
        Ok(())
    }
}

/// What flash holds when a file is loaded.
fn loadable(elf: &[u8]) -> Result<Vec<u8>, String> {
    type Header = object::elf::FileHeader32<object::Endianness>;
    let told = |error: object::Error| error.to_string();
    let header = Header::parse(elf).map_err(told)?;
    let endian = header.endian().map_err(told)?;
    if header.e_machine(endian) != object::elf::EM_ARM {
        return Err("it is for another processor".into());
    }
    let mut bytes = Vec::new();
    for segment in header.program_headers(endian, elf).map_err(told)? {
        let data = segment.data(endian, elf).map_err(|()| "a segment lies outside the file".to_owned())?;
        if segment.p_type(endian) != object::elf::PT_LOAD || data.is_empty() {
            continue;
        }
        let start = segment.p_paddr(endian).checked_sub(FLASH).map(|start| start as usize);
        let place =
            start.map(|start| start..start.saturating_add(data.len())).filter(|place| place.end <= BANK_1_BYTES);
        let place = place.ok_or("a part of it lies outside bank 1, where the program belongs")?;
        if bytes.len() < place.end {
            bytes.resize(place.end.next_multiple_of(8), 0xFF);
        }
        bytes[place].copy_from_slice(data);
    }
    if bytes.is_empty() { Err("it holds nothing to write".into()) } else { Ok(bytes) }
}
