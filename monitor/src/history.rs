//! The position's last readings, a millisecond apart.

/// Readings kept.
pub(crate) const KEPT: usize = 24;
/// Time between readings, s.
pub(crate) const SPACING_S: f32 = 1.0e-3;
/// Readings are kept as whole 2^-20 m, so that their sums neither drift nor overflow.
pub(crate) const PER_METRE: f32 = 1_048_576.0;

/// The last readings in whole 2^-20 m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct History {
    spacing_ticks: u16,
    tick: u16,
    kept: [i32; KEPT],
    next: u8,
    filled: u8,
}

impl History {
    pub(crate) fn new(tick_s: f32) -> Self {
        let spacing_ticks = ((SPACING_S / tick_s + 0.5) as u16).max(1);
        Self { spacing_ticks, tick: 0, kept: [0; KEPT], next: 0, filled: 0 }
    }

    pub(crate) fn restart(&mut self) {
        self.filled = 0;
    }

    /// One tick; the reading that is forgotten, once a millisecond. The first reading counts for all those before.
    pub(crate) fn advance(&mut self, position_m: f32) -> Option<i32> {
        self.tick += 1;
        if self.tick < self.spacing_ticks {
            return None;
        }
        self.tick = 0;
        let reading = (position_m * PER_METRE) as i32;
        if self.filled == 0 {
            self.kept = [reading; KEPT];
        }
        self.filled = (self.filled + 1).min(KEPT as u8);
        let slot = self.kept.get_mut(usize::from(self.next))?;
        let forgotten = core::mem::replace(slot, reading);
        self.next = (self.next + 1) % KEPT as u8;
        Some(forgotten)
    }

    /// How many readings there have been, up to [`KEPT`].
    pub(crate) fn filled(&self) -> usize {
        self.filled.into()
    }

    /// The reading of so many milliseconds ago, below [`KEPT`].
    pub(crate) fn ago(&self, age: usize) -> i32 {
        let place = usize::from(self.next) + (KEPT - 1) - age.min(KEPT - 1);
        self.kept.get(if place < KEPT { place } else { place - KEPT }).copied().unwrap_or(0)
    }
}
