//! Which timing faults a tick has seen, from the cycle counter and two flags of the converter's timer.

use control::ExternalFaults;

/// The clock's side of the control interrupt. The cycle counter may wrap; silence of half its range (12 s at 170 MHz) is beyond
/// what the watchdog lets pass.
#[derive(Clone, Debug)]
pub struct Timing {
    cycles_per_tick: u32,
    last_entry: Option<u32>,
    overran: bool,
}

impl Timing {
    /// For ticks of so many cycles, at most 2^30.
    #[must_use]
    pub fn new(cycles_per_tick: u32) -> Self {
        Self { cycles_per_tick, last_entry: None, overran: false }
    }

    /// At the interrupt's entry. `mixed`: the next conversion was already under way when this one was read.
    #[inline]
    pub fn begin(&mut self, entry_cycles: u32, mixed: bool) -> ExternalFaults {
        let elapsed = self.last_entry.map_or(0, |last| entry_cycles.wrapping_sub(last));
        self.last_entry = Some(entry_cycles);
        ExternalFaults {
            missed_ticks: self.ticks_missed(elapsed),
            late_tick: self.overran,
            overrun: mixed,
            model_disagreement: false,
        }
    }

    /// Whole ticks that fit in between: an interrupt half a tick late has missed none, one later has missed one.
    #[inline]
    fn ticks_missed(&self, elapsed: u32) -> u8 {
        let tick = self.cycles_per_tick;
        let mut late_by = elapsed.saturating_sub(tick / 2).saturating_sub(tick);
        let mut missed = 0;
        // Counted, because a division would cost more in every tick than this does in the rare one.
        while late_by > 0 && missed < u8::MAX {
            missed += 1;
            late_by = late_by.saturating_sub(tick);
        }
        missed
    }

    /// Behind the valve write. `overran`: the next tick had begun by then, so the code takes effect a tick late.
    #[inline]
    pub fn end(&mut self, overran: bool) {
        self.overran = overran;
    }
}
