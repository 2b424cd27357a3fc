//! Which sensor contradicts the rest? By structured residuals: each fault leaves its own pattern in the checks (R. Isermann,
//! Fault-Diagnosis Systems, 2006).
//!
//! | wrong is | balance of A | balance of B | the reading's course |
//! | --- | --- | --- | --- |
//! | the position | motion is missing | the same motion | bent as no piston can, or frozen |
//! | one pressure | motion, or none | none, or motion | the piston's |
//! | the valve | motion is missing | about the same | the piston's: it goes where the air pushes it |
//! | the supply, or its sensor | that of the chamber that fills alone | | the piston's |
//!
//! The position is named where both balances miss the same motion and the reading's course is no piston's: balances alone do not tell
//! it from a jammed valve, as less air on one side and more on the other looks like motion.
//!
//! A pressure is named by either of two signs:
//!
//! - **by its steps**: it has stepped as no air can make it (`chamber.rs`); its balance holds without these steps, and so does the
//!   other chamber's. A jammed valve makes no such steps.
//! - **by the other's silence**: its balance is off so far that a wrong opening or a missing motion would show in the other chamber as
//!   well ([`Side::would_be`]), but that one's holds; and the reading of the position is straight. A wrong supply, too, shows in one chamber
//!   alone, the one that fills, so this counts only where the supply is measured or the chamber does not fill. A wrong supply *sensor* may be
//!   taken for a pressure.

use crate::Check;
use crate::chamber::Found;

/// Farthest that the motions of both balances may be apart, as a factor. Of the reliability study's runs (seed 4711 with 5 runs, seed 99
/// with 15) that trip with a bent or frozen reading, they are apart by up to 2.2 in all but three where the position is wrong, and by
/// 2.7, 4.1 and more where a pressure is.
const APART: f32 = 2.5;
/// How long a reading repeats before it is frozen, s: three times as long as an implausible one is bridged.
const FROZEN_S: f32 = 0.015;
/// How much less than a wrong opening or motion would make of it the other balance is off where it is silent, as a factor. In the
/// reliability study (seeds 4711, 99 and 1234 with 15 runs) the shares of their thresholds that the balances reach are apart by 1.0 to 2.2 for
/// 244 jammed valves, and by 3.0 and more for pressures that go wrong without a step, all but one by 4.1.
const QUIET: f32 = 3.0;
/// Part of what the model's errors may make of the other balance that the wrong opening or motion must go beyond there, the noise
/// besides: so a rig file that is wrong by half of what is allowed, a tenth by default, hides next to no jammed valve (1 of 336).
const HIDDEN: f32 = 0.5;

/// Watches the reading's course.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Isolation {
    frozen_ticks: u16,
    repeats: u16,
}

/// What the position's reading tells in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Course {
    /// It is bent as no piston can, or frozen.
    pub(crate) strange: bool,
    /// That, and both balances miss the same motion.
    pub(crate) contradicts: bool,
}

impl Isolation {
    pub(crate) fn new(tick_s: f32) -> Self {
        Self { frozen_ticks: (FROZEN_S / tick_s + 0.5) as u16, repeats: 0 }
    }

    pub(crate) fn restart(&mut self) {
        self.repeats = 0;
    }

    /// One tick: the reading's change, the motion that each chamber misses in m, and the check of bends.
    pub(crate) fn advance(&mut self, step_m: f32, [a_m, b_m]: [f32; 2], kink: &Check) -> Course {
        self.repeats = if step_m == 0.0 { self.repeats.saturating_add(1) } else { 0 };
        let strange = !kink.holds() || self.repeats >= self.frozen_ticks;
        let (a, b) = (a_m.abs(), b_m.abs());
        let same = a_m * b_m > 0.0 && a <= APART * b && b <= APART * a;
        Course { strange, contradicts: strange && same }
    }
}

/// One chamber in the tick of a disagreement.
pub(crate) struct Side<'f> {
    pub(crate) found: &'f Found,
    /// What an opening changes the pressure by, filling and exhausting, in the same unit on both sides; zero where the chamber is the
    /// room's air.
    pub(crate) by_opening: [f32; 2],
    /// It fills from a supply that is not measured.
    pub(crate) in_the_dark: bool,
}

impl Side<'_> {
    /// Whether nothing but this pressure is wrong, the position's `course` being strange or not. Written so that a NaN names none.
    pub(crate) fn is_alone(&self, other: &Self, course: Course) -> bool {
        self.has_stepped(other) || (!course.strange && !self.in_the_dark && self.leaves_silent(other))
    }

    fn has_stepped(&self, other: &Self) -> bool {
        let (found, other) = (self.found, other.found);
        let without_steps = Check { residual: found.check.residual - found.stepped_pa, ..found.check };
        let steps = found.steps_now || !found.check.holds();
        steps && without_steps.holds() && other.check.holds() && !other.steps_now
    }

    fn leaves_silent(&self, other: &Self) -> bool {
        let (would_be_pa, found) = (self.would_be(other), other.found);
        let hidden_pa = found.noise_pa + HIDDEN * (found.check.threshold - found.noise_pa);
        would_be_pa > hidden_pa && QUIET * found.check.residual.abs() <= would_be_pa
    }

    /// What the other balance would be off by at least if this one were by a wrong opening or by motion, Pa. One chamber fills while the
    /// other exhausts, and nobody knows which.
    fn would_be(&self, other: &Self) -> f32 {
        let ([fills, exhausts], [other_fills, other_exhausts]) = (self.by_opening, other.by_opening);
        let by_opening = (other_exhausts / fills).min(other_fills / exhausts);
        let by_motion = self.found.contribution.metres_per_pa / other.found.contribution.metres_per_pa;
        self.found.check.residual.abs() * by_opening.min(by_motion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Contribution;

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
            assert_eq!(isolation.advance(1e-4, missing_m, &kink).contradicts, named, "{missing_m:?}, {kink:?}");
        }
    }

    #[test]
    fn a_reading_that_repeats_for_15_ms_is_as_good_as_bent_until_it_moves() {
        let mut isolation = Isolation::new(1e-3);
        let mut named = |step_m: f32| isolation.advance(step_m, [2e-3, 2e-3], &STRAIGHT).contradicts;
        for tick in 1..40 {
            assert_eq!(named(0.0), tick >= 15, "{tick}");
        }
        assert!(!named(1e-5) && !named(0.0));
    }

    const FLOWS: [f32; 2] = [1.0, 1.0];

    fn found(residual: f32, stepped_pa: f32, steps_now: bool) -> Found {
        let contribution = Contribution { missing_m: 0.0, allowed_m: 0.0, by_lag_m: 0.0, metres_per_pa: 1e-6 };
        // Half of the threshold is for noise.
        Found { check: Check { residual, threshold: 10e3 }, noise_pa: 5e3, stepped_pa, steps_now, contribution }
    }

    fn alone(one: &Found, other: &Found, by_opening: [[f32; 2]; 2], strange: bool, in_the_dark: bool) -> bool {
        let [one, other] = [(one, by_opening[0]), (other, by_opening[1])].map(|(found, by_opening)| Side {
            found,
            by_opening,
            in_the_dark,
        });
        one.is_alone(&other, Course { strange, contradicts: false })
    }

    #[test]
    fn a_pressure_that_has_stepped_is_named_where_its_balance_holds_without_the_steps_and_the_other_does() {
        for (one, other, named) in [
            (found(90e3, 85e3, false), found(9e3, 0.0, false), true),
            (found(-90e3, -85e3, false), found(0.0, 0.0, false), true),
            // Steps to and fro that cancel, in these ticks or before.
            (found(2e3, 3e3, true), found(0.0, 0.0, false), true),
            (found(2e3, 3e3, false), found(0.0, 0.0, false), false),
            // A jam besides, the other balance off, both stepping.
            (found(90e3, 60e3, true), found(9e3, 0.0, false), false),
            (found(90e3, 85e3, true), found(31e3, 0.0, false), false),
            (found(90e3, 85e3, true), found(9e3, 1.0, true), false),
            (found(f32::NAN, 85e3, true), found(0.0, 0.0, false), false),
            (found(90e3, f32::NAN, true), found(31e3, 0.0, false), false),
            (found(90e3, 85e3, true), found(f32::NAN, 0.0, false), false),
        ] {
            assert_eq!(alone(&one, &other, [FLOWS; 2], true, true), named, "{one:?}, {other:?}");
        }
    }

    #[test]
    fn a_pressure_without_steps_is_named_where_valve_or_motion_would_show_in_the_other_chamber_and_do_not() {
        let silent = found(-3e3, 0.0, false);
        for (residual, flows, other, named) in [
            (12e3, FLOWS, &silent, true),
            // More than noise and half of what the model's errors may make, 7.5 kPa, is asked for.
            (7e3, FLOWS, &silent, false),
            // Where a valve hardly exhausts the other chamber, hardly fills it, or neither, it might be the valve.
            (12e3, [1.0, 0.2], &silent, false),
            (12e3, [0.2, 1.0], &silent, false),
            (12e3, [0.0, 0.0], &silent, false),
            (30e3, [1.0, 0.5], &silent, true),
            // As much motion the other way: a jammed valve.
            (12e3, FLOWS, &found(-12e3, 0.0, false), false),
            (12e3, FLOWS, &found(-5e3, 0.0, false), false),
            (f32::NAN, FLOWS, &silent, false),
            (12e3, [f32::NAN; 2], &found(f32::NAN, 0.0, false), false),
        ] {
            let one = found(residual, 0.0, false);
            assert_eq!(alone(&one, other, [FLOWS, flows], false, false), named, "{residual}, {flows:?}, {other:?}");
        }
        let one = found(12e3, 0.0, false);
        assert!(!alone(&one, &silent, [FLOWS; 2], true, false), "the position's reading is strange");
        assert!(!alone(&one, &silent, [FLOWS; 2], false, true), "it may be the supply");
    }
}
