//! Panics, faults and stack overflow: valve to mid, a note for the next start, reset.
//!
//! The note lies in RAM that start-up does not clear, so it survives the reset (not a power cut), and carries a
//! check value, so that whatever RAM holds after power-up is not mistaken for one.

use core::cell::UnsafeCell;
use core::fmt::Write;
use core::mem::MaybeUninit;

use crate::board::{self, ResetCause};
use firmware_core::CHECK;

const MAGIC: u32 = 0x504E_4555;
const TEXT_BYTES: usize = 160;

/// What stopped the firmware.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub(crate) enum FaultKind {
    /// A Rust panic; the text says where and why.
    Panic,
    /// The stack pointer left its region.
    StackOverflow,
    /// Any other hard fault.
    HardFault,
    /// What the control interrupt owns changed between two ticks.
    MemoryCorrupted,
}

/// The note itself.
#[derive(Clone, Copy)]
#[repr(C)]
struct Note {
    magic: u32,
    kind: u32,
    cfsr: u32,
    hfsr: u32,
    bfar: u32,
    stack_pointer: u32,
    text_len: u32,
    text: [u8; TEXT_BYTES],
    check: u32,
}

impl Note {
    const EMPTY: Note = Note {
        magic: 0,
        kind: 0,
        cfsr: 0,
        hfsr: 0,
        bfar: 0,
        stack_pointer: 0,
        text_len: 0,
        text: [0; TEXT_BYTES],
        check: 0,
    };

    fn sum(&self) -> u32 {
        let words = [self.magic, self.kind, self.cfsr, self.hfsr, self.bfar, self.stack_pointer, self.text_len];
        let mut sum = CHECK.digest();
        words.iter().for_each(|word| sum.update(&word.to_le_bytes()));
        sum.update(&self.text);
        sum.finalize()
    }
}

struct NoteCell(UnsafeCell<MaybeUninit<Note>>);
// SAFETY: written by the panic and fault handlers, which never return, and read once at start with nothing else running.
unsafe impl Sync for NoteCell {}

#[unsafe(link_section = ".uninit.fault_note")]
static NOTE: NoteCell = NoteCell(UnsafeCell::new(MaybeUninit::uninit()));

impl Write for Note {
    /// Keeps what fits; a truncated message is better than none.
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        for byte in text.bytes() {
            let Some(slot) = self.text.get_mut(self.text_len as usize) else { break };
            *slot = byte;
            self.text_len += 1;
        }
        Ok(())
    }
}

fn leave(mut note: Note, kind: FaultKind) -> ! {
    board::valve_to_mid_at_once();
    note.magic = MAGIC;
    note.kind = kind as u32;
    note.check = note.sum();
    // SAFETY: interrupts are off or preempted for good; see `NoteCell`.
    unsafe { NOTE.0.get().write(MaybeUninit::new(note)) };
    board::reset()
}

/// What the control interrupt owns is no longer what it left: the panic's way, without a text.
#[cold]
#[inline(never)]
pub(crate) fn memory_corrupted() -> ! {
    cortex_m::interrupt::disable();
    leave(Note::EMPTY, FaultKind::MemoryCorrupted)
}

/// Valve to mid, no air, and nothing runs until the watchdog resets the chip: its flag is what tells the operator. Without
/// the interrupts off, triggers that return would let the loop drive the valve until then.
pub(crate) fn wait_for_the_watchdog() -> ! {
    cortex_m::interrupt::disable();
    board::valve_to_mid_at_once();
    board::air_off_at_once();
    loop {
        cortex_m::asm::nop();
    }
}

/// What happened before the reset, if something did.
pub(crate) struct PreviousFault {
    note: Note,
    /// What it was.
    pub(crate) kind: FaultKind,
}

impl PreviousFault {
    /// The panic message, as much of it as fitted; empty for faults.
    pub(crate) fn text(&self) -> &str {
        let bytes = &self.note.text[..(self.note.text_len as usize).min(TEXT_BYTES)];
        match core::str::from_utf8(bytes) {
            Ok(text) => text,
            // Truncation may have split a character.
            Err(error) => core::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or(""),
        }
    }

    /// Configurable fault status, hard fault status, bus fault address, stack pointer (ARMv7-M, B3.2.15).
    pub(crate) fn registers(&self) -> [u32; 4] {
        [self.note.cfsr, self.note.hfsr, self.note.bfar, self.note.stack_pointer]
    }
}

/// Takes the note of the previous run. Called once, at start. Whoever leaves a note resets the chip by software; after
/// power-up the RAM has not been written, and where its parity is checked, reading it would be a fault.
pub(crate) fn take_previous(cause: ResetCause) -> Option<PreviousFault> {
    if cause != ResetCause::Software {
        return None;
    }
    // SAFETY: any bit pattern is a valid `Note` (plain integers), and nothing else touches it at start.
    let note = unsafe { NOTE.0.get().read_volatile().assume_init() };
    let kind = match note.kind {
        kind if kind == FaultKind::Panic as u32 => FaultKind::Panic,
        kind if kind == FaultKind::StackOverflow as u32 => FaultKind::StackOverflow,
        kind if kind == FaultKind::MemoryCorrupted as u32 => FaultKind::MemoryCorrupted,
        _ => FaultKind::HardFault,
    };
    let genuine = note.magic == MAGIC && note.check == note.sum();
    // SAFETY: as above.
    unsafe { NOTE.0.get().write(MaybeUninit::new(Note::EMPTY)) };
    genuine.then_some(PreviousFault { note, kind })
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    board::valve_to_mid_at_once();
    let mut note = Note::EMPTY;
    let _ = write!(note, "{info}");
    leave(note, FaultKind::Panic)
}

/// Entered by hardware on any fault, the stack pointer possibly outside RAM: so it must not touch the stack before
/// it has set a new one. The old pointer is passed on as evidence.
#[unsafe(naked)]
#[unsafe(export_name = "HardFault")]
unsafe extern "C" fn hard_fault() -> ! {
    core::arch::naked_asm!(
        "cpsid i",
        "mrs r0, msp",
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "b {handler}",
        handler = sym hard_fault_on_fresh_stack,
    )
}

extern "C" fn hard_fault_on_fresh_stack(stack_pointer: u32) -> ! {
    unsafe extern "C" {
        static _stack_end: u8;
    }
    let mut note = Note::EMPTY;
    // SAFETY: reading the fault status registers has no side effect.
    let scb = unsafe { &*cortex_m::peripheral::SCB::PTR };
    note.cfsr = scb.cfsr.read();
    note.hfsr = scb.hfsr.read();
    note.bfar = scb.bfar.read();
    note.stack_pointer = stack_pointer;
    let bottom = &raw const _stack_end as u32;
    // Below the region, or an access below it from a frame still inside (a large array).
    let bus_fault_below = note.cfsr & (1 << 15) != 0 && note.bfar < bottom && note.bfar >= bottom - 0x1_0000;
    let overflow = stack_pointer < bottom || bus_fault_below || note.cfsr & (1 << 12) != 0;
    leave(note, if overflow { FaultKind::StackOverflow } else { FaultKind::HardFault })
}
