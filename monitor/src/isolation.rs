//! Is it the position that contradicts the rest? By structured residuals: each fault leaves its own pattern in the checks (R. Isermann,
//! Fault-Diagnosis Systems, 2006).
//!
//! | wrong is | balance of A | balance of B | the reading's course |
//! | --- | --- | --- | --- |
//! | the position | motion is missing | the same motion | bent as no piston can, or frozen |
//! | one pressure | motion, or none | none, or motion | the piston's |
//! | valve or supply | motion is missing | about the same | the piston's: it goes where the air pushes it |
//!
//! Balances alone do not tell a wrong position from a jammed valve: less air on one side and more on the other looks like motion.

use crate::Check;

/// Farthest that the motions of both balances may be apart, as a factor. Of the reliability study's runs (seed 4711 with 5 runs, seed 99
/// with 15) that trip with a bent or frozen reading, they are apart by up to 2.2 in all but three where the position is wrong, and by
/// 2.7, 4.1 and more where a pressure is.
const APART: f32 = 2.5;
/// How long a reading repeats before it is frozen, s: three times as long as an implausible one is bridged.
const FROZEN_S: f32 = 0.015;

/// Watches the reading's course.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Isolation {
    frozen_ticks: u16,
    repeats: u16,
}

impl Isolation {
    pub(crate) fn new(tick_s: f32) -> Self {
        Self { frozen_ticks: (FROZEN_S / tick_s + 0.5) as u16, repeats: 0 }
    }

    pub(crate) fn restart(&mut self) {
        self.repeats = 0;
    }

    /// One tick: the reading's change, the motion that each chamber misses in m, and the check of bends.
    pub(crate) fn advance(&mut self, step_m: f32, [a_m, b_m]: [f32; 2], kink: &Check) -> bool {
        self.repeats = if step_m == 0.0 { self.repeats.saturating_add(1) } else { 0 };
        let (a, b) = (a_m.abs(), b_m.abs());
        let same = a_m * b_m > 0.0 && a <= APART * b && b <= APART * a;
        same && (!kink.holds() || self.repeats >= self.frozen_ticks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BENT: Check = Check { residual: 1.1, threshold: 1.0 };
    const STRAIGHT: Check = Check { residual: 0.9, threshold: 1.0 };

    #[test]
    fn the_position_is_named_only_where_both_balances_miss_the_same_motion_and_no_piston_moves_like_its_reading() {
        for (missing_m, kink, named) in [
            ([2e-3, 2e-3], BENT, true),
            ([-2e-3, -1e-3], BENT, true),
            ([2e-3, 2e-3], STRAIGHT, false),
            ([2e-3, 0.7e-3], BENT, false),
            ([0.7e-3, 2e-3], BENT, false),
            ([2e-3, -2e-3], BENT, false),
            ([2e-3, 0.0], BENT, false),
            ([0.0, 0.0], BENT, false),
            ([f32::NAN, 2e-3], BENT, false),
        ] {
            let mut isolation = Isolation::new(1e-3);
            assert_eq!(isolation.advance(1e-4, missing_m, &kink), named, "{missing_m:?}, {kink:?}");
        }
    }

    #[test]
    fn a_reading_that_repeats_for_15_ms_is_as_good_as_bent_until_it_moves() {
        let mut isolation = Isolation::new(1e-3);
        let mut named = |step_m: f32| isolation.advance(step_m, [2e-3, 2e-3], &STRAIGHT);
        for tick in 1..40 {
            assert_eq!(named(0.0), tick >= 15, "{tick}");
        }
        assert!(!named(1e-5) && !named(0.0));
    }
}
