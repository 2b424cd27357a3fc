//! The control interrupt: the only code between the converter and the valve.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::interrupt;

use crate::board::{Sampler, Valve};

/// What the interrupt owns.
struct Owned {
    sampler: Sampler,
    valve: Valve,
}

struct OwnedCell(UnsafeCell<Option<Owned>>);
// SAFETY: filled by `start` before the interrupt is enabled, touched by the interrupt alone afterwards.
unsafe impl Sync for OwnedCell {}
static OWNED: OwnedCell = OwnedCell(UnsafeCell::new(None));

/// Ticks sampled since start; wraps.
pub(crate) static TICKS: AtomicU32 = AtomicU32::new(0);
/// Ticks whose valve code came too late; wraps.
pub(crate) static OVERRUNS: AtomicU32 = AtomicU32::new(0);

/// Starts the tick. Called once.
pub(crate) fn start(sampler: Sampler, mut valve: Valve, tick_hz: u32) {
    valve.latch_with_tick();
    // SAFETY: the interrupt is not enabled yet, see `OwnedCell`.
    let owned = unsafe { &mut *OWNED.0.get() }.insert(Owned { sampler, valve });
    owned.sampler.start(tick_hz);
}

#[interrupt]
fn ADC1_2() {
    // SAFETY: see `OwnedCell`.
    let Some(owned) = (unsafe { &mut *OWNED.0.get() }) else { return };
    let _sequence = owned.sampler.read();
    owned.valve.set(2048);
    TICKS.store(TICKS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    if owned.sampler.overran() {
        OVERRUNS.store(OVERRUNS.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }
}
