//! Which timing faults a tick has seen, from the cycle counter and two flags of the converter's timer.

use control::ExternalFaults;

/// The clock's side of the control interrupt. The cycle counter may wrap; silence of half its range (12 s at 170 MHz) is beyond
/// what the watchdog lets pass.
#[derive(Clone, Debug)]
pub struct Timing {
    cycles_per_tick: u32,
    last_update: Option<u32>,
    overran: bool,
}

impl Timing {
    /// For ticks of so many cycles, at most 2^30.
    #[must_use]
    pub fn new(cycles_per_tick: u32) -> Self {
        Self { cycles_per_tick, last_update: None, overran: false }
    }

    /// When the samples are read: at `now_cycles`, so many cycles after the last update of the timer. `mixed`: that update was one
    /// too many, as the next conversion was already under way.
    ///
    /// From update to update, and not from interrupt to interrupt: an interrupt that comes late has not missed a tick.
    #[inline]
    pub fn begin(&mut self, now_cycles: u32, since_update: u32, mixed: bool) -> ExternalFaults {
        let ahead = if mixed { self.cycles_per_tick } else { 0 };
        let update = now_cycles.wrapping_sub(since_update).wrapping_sub(ahead);
        let elapsed = self.last_update.map_or(0, |last| update.wrapping_sub(last));
        self.last_update = Some(update);
        ExternalFaults {
            missed_ticks: self.ticks_missed(elapsed),
            late_tick: self.overran,
            overrun: mixed,
            ..ExternalFaults::default()
        }
    }

    /// Whole ticks that fit in between; the cycles lie within half a tick of whole ones.
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
