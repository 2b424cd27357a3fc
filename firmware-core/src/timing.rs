//! Which timing faults a tick has seen, from the cycle counter and two flags of the converter's timer.

use control::ExternalFaults;

/// The clock's side of the control interrupt. The cycle counter may wrap; a tick is far shorter than its range.
#[derive(Clone, Debug)]
pub struct Timing {
    /// A tick and a half: an interrupt later than that has missed one.
    patience_cycles: u32,
    last_entry: Option<u32>,
    overran: bool,
}

impl Timing {
    /// For ticks of so many cycles, at most 2^31.
    #[must_use]
    pub fn new(cycles_per_tick: u32) -> Self {
        Self { patience_cycles: cycles_per_tick.saturating_add(cycles_per_tick / 2), last_entry: None, overran: false }
    }

    /// At the interrupt's entry. `mixed`: the next conversion was already under way when this one was read.
    #[inline]
    pub fn begin(&mut self, entry_cycles: u32, mixed: bool) -> ExternalFaults {
        let elapsed = self.last_entry.map_or(0, |last| entry_cycles.wrapping_sub(last));
        self.last_entry = Some(entry_cycles);
        ExternalFaults {
            missed_tick: elapsed > self.patience_cycles,
            late_tick: self.overran,
            overrun: mixed,
            model_disagreement: false,
        }
    }

    /// Behind the valve write. `overran`: the next tick had begun by then, so the code takes effect a tick late.
    #[inline]
    pub fn end(&mut self, overran: bool) {
        self.overran = overran;
    }
}
