//! A limit cycle: the piston passes a standing target again and again.

use crate::quantities::Position;

/// Counts how often a target is passed while it stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Cycle {
    /// On which side of the target the piston was last: the sign of its error.
    side: i8,
    /// How often it has passed the target since the target stands.
    passes: u8,
    /// Whether it has in this tick.
    passed: bool,
}

impl Cycle {
    /// Takes this tick's error; one within `limit` is on no side. `counts` says whether the target stands.
    #[inline]
    pub(crate) fn see(&mut self, counts: bool, error: Position, limit: Position) {
        self.passed = false;
        if !counts {
            *self = Self::default();
        } else if error.saturating_abs() > limit {
            let side = if error > 0 { 1 } else { -1 };
            self.passed = side == -self.side;
            self.passes = self.passes.saturating_add(self.passed.into());
            self.side = side;
        }
    }

    /// Whether the piston has passed the target once more, after it had passed it `often`. Said once, also if no tick of the law follows.
    #[inline]
    pub(crate) fn take_pass(&mut self, often: u8) -> bool {
        core::mem::take(&mut self.passed) && self.passes > often
    }
}
