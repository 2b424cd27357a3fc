//! Faults on purpose, in the binary `firmware-broken` (`broken_main.rs` is a link to `main.rs`): each of them must be found, by the
//! check that is meant for it (`tests/tests/emulated/broken.rs`). They are chosen by a word in flash, so one build has them all.

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
#[allow(dead_code, reason = "only the number counts where the feature is off")]
pub(crate) enum Fault {
    /// Chamber B and supply are converted in each other's place.
    ChannelOrder = 1,
    /// The converter is not ready for the next trigger.
    NoRetrigger = 2,
    /// Every valve code is one too high.
    DacCode = 3,
    /// The control interrupt gives way to all others.
    Priority = 4,
    /// The command task waits for the flash in silence.
    UnfedSave = 5,
}

/// The word, in flash.
#[cfg(feature = "broken")]
#[unsafe(no_mangle)]
static DELIBERATE_FAULT: u32 = 0;

/// Whether this fault is at work.
#[cfg(feature = "broken")]
pub(crate) fn is(fault: Fault) -> bool {
    // SAFETY: a reference is readable. Volatile, because the word in flash need not be what the compiler knows.
    unsafe { (&raw const DELIBERATE_FAULT).read_volatile() == fault as u32 }
}

/// None is.
#[cfg(not(feature = "broken"))]
#[inline(always)]
pub(crate) const fn is(_: Fault) -> bool {
    false
}
