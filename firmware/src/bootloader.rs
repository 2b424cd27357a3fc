//! The way to the bootloader in ROM and back, for updates over the serial line.
//!
//! A running watchdog cannot be stopped, and would bite in the midst of an update: so the chip is reset first, with a word in RAM
//! that survives, and leaves for the ROM before anything is started. On the way back the ROM jumps to [`restart`], which resets
//! the chip: the new firmware finds it as after power-up.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

use board_link::PROTOCOL_VERSION;
use board_link::identity::Identity;
use firmware_core::PARAMETER_LAYOUT;

use crate::board;

/// Any number that RAM does not hold by chance.
const ASKED: u32 = 0xB007_10AD;

struct WordCell(UnsafeCell<MaybeUninit<u32>>);
// SAFETY: written by the command task ahead of a reset, and read once at start with nothing else running.
unsafe impl Sync for WordCell {}

#[unsafe(link_section = ".uninit.bootloader")]
static WORD: WordCell = WordCell(UnsafeCell::new(MaybeUninit::uninit()));

/// Resets the chip, which then leaves for the ROM.
pub(crate) fn restart_into() -> ! {
    // SAFETY: see `WordCell`.
    unsafe { WORD.0.get().write_volatile(MaybeUninit::new(ASKED)) };
    board::reset()
}

/// The first statement of `main`: leaves for the ROM if the last run asked for it. After power-up RAM has not been written, and
/// where its parity is checked, reading it would be a fault.
pub(crate) fn enter_if_asked() {
    if !board::reset_by_software() {
        return;
    }
    // SAFETY: any word is valid, and nothing else touches it at start.
    let word = unsafe { WORD.0.get().read_volatile().assume_init() };
    // Once only: whatever the ROM does, the next reset starts the firmware.
    // SAFETY: as above.
    unsafe { WORD.0.get().write_volatile(MaybeUninit::new(0)) };
    if word == ASKED {
        board::jump_to_bootloader();
    }
}

/// Where the ROM jumps to when it is told to go: peripherals and clocks are as it left them, so they are reset.
extern "C" fn restart() -> ! {
    board::reset()
}

unsafe extern "C" {
    static _stack_start: u32;
}

struct Shared(#[expect(dead_code, reason = "read by a host, in the file and in flash")] Identity);
// SAFETY: constants only.
unsafe impl Sync for Shared {}

/// What this image says of itself.
#[used]
static IDENTITY: Shared = Shared(Identity::new(
    (&raw const _stack_start, restart),
    PROTOCOL_VERSION,
    PARAMETER_LAYOUT,
    board::NAME,
    env!("CARGO_PKG_VERSION"),
));
