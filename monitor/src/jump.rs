//! A reading that jumps while its speed stays.
//!
//! A sensor that suddenly shows what was true some time ago, or on another scale, jumps: by the way that the piston makes in that time.
//! Before and after its speed is the same. No piston does that: an impact changes the speed with the place. So a line is drawn through
//! the readings of 8 ms on either side of each instant, and the gap between both is compared with what noise and a change of speed
//! explain. A single wild reading makes no line.

use crate::Check;
use crate::history::{History, PER_METRE};
use crate::parameters::MonitorParameters;
use plant_model::Real;

/// Readings on either side.
const SIDE: usize = 8;
/// From the middle of a side to the first of its readings, in readings.
const HALF: f32 = 3.5;
/// Sum of the squares of the readings' distances from the middle of their side.
const SQUARES: f32 = 42.0;
/// Gap that noise makes at most, over the position's tolerance. Lines through eight readings reach the instant between them with the
/// noise of one reading, which is an eighth of the tolerance in the reliability study.
const GAP_SHARE: f32 = 1.0;
/// Farthest distance of a reading from its line, over the position's tolerance: five standard deviations.
const LINE_SHARE: f32 = 0.6;
/// Readings by which a gap may be wrong because ticks were lost: one more than are bridged in a row.
const LOST: f32 = 3.0;

/// A line through one side, in m and m per reading.
struct Line {
    mean_m: f32,
    per_reading_m: f32,
    farthest_m: f32,
}

impl Line {
    /// Through the readings of `newest_ago` milliseconds ago and before.
    fn through(history: &History, newest_ago: usize) -> Self {
        let origin = history.ago(newest_ago + SIDE - 1);
        let (mut from_origin, mut sum, mut twice_moment) = ([0; SIDE], 0, 0);
        for (n, slot) in from_origin.iter_mut().enumerate() {
            // Whole 2^-20 m of at most 8 m: the sums stay below 2^30.
            *slot = history.ago(newest_ago + SIDE - 1 - n) - origin;
            sum += *slot;
            twice_moment += (2 * n as i32 - (SIDE as i32 - 1)) * *slot;
        }
        let mean = sum as f32 * (1.0 / SIDE as f32);
        let per_reading = twice_moment as f32 * (0.5 / SQUARES);
        let (mut farthest, mut line) = (0.0_f32, mean - HALF * per_reading);
        for reading in from_origin {
            farthest = farthest.at_least((reading as f32 - line).abs());
            line += per_reading;
        }
        const METRE: f32 = 1.0 / PER_METRE;
        Self {
            mean_m: (mean + origin as f32) * METRE,
            per_reading_m: per_reading * METRE,
            farthest_m: farthest * METRE,
        }
    }
}

/// The gap between the lines through the last eight readings and the eight before, and what it may be.
pub(crate) fn check(history: &History, parameters: &MonitorParameters) -> Check {
    if history.filled() < 2 * SIDE {
        return Check::NOTHING;
    }
    let tolerance_m = parameters.position_m;
    // Lines are worth their instructions only where one step is out of line with those behind it, by half of what a gap must be.
    let [newest, first, last] = [0, SIDE - 1, SIDE].map(|age| history.ago(age));
    let step = (first - last) as f32 - (newest - first) as f32 * (1.0 / (SIDE as f32 - 1.0));
    if step.abs() <= 0.5 * GAP_SHARE * PER_METRE * tolerance_m {
        return Check::NOTHING;
    }
    let [before, after] = [SIDE, 0].map(|newest_ago| Line::through(history, newest_ago));
    if before.farthest_m.at_least(after.farthest_m) > LINE_SHARE * tolerance_m {
        return Check::NOTHING;
    }
    let half = 0.5 * SIDE as f32;
    let fastest_m = after.per_reading_m.abs().at_least(before.per_reading_m.abs());
    let faster_m = (after.per_reading_m - before.per_reading_m).abs();
    Check {
        residual: after.mean_m - before.mean_m - half * (after.per_reading_m + before.per_reading_m),
        threshold: GAP_SHARE * tolerance_m + LOST * fastest_m + SIDE as f32 * faster_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest share of the threshold along a course of readings, a millisecond apart.
    fn largest(course_m: impl Fn(f32) -> f32) -> f32 {
        let mut history = History::new(1e-3);
        let mut largest = 0.0_f32;
        for ms in 0..200 {
            history.advance(course_m(ms as f32));
            let check = check(&history, &MonitorParameters::default());
            largest = largest.max(check.residual.abs() / check.threshold);
        }
        largest
    }

    #[test]
    fn a_reading_that_jumps_back_by_the_way_of_50_ms_is_seen_and_what_a_piston_does_is_not() {
        for speed in [0.02e-3, 0.08e-3, -0.5e-3] {
            let late = largest(|ms| speed * if ms < 100.5 { ms } else { ms - 50.0 });
            assert!(late > 1.0, "{speed} m in a millisecond: {late}");
        }
        let even = largest(|ms| 1e-3 * ms);
        assert!(even < 0.01, "{even}");
        // Stopped by an obstacle, thrown back by it, and 300 m/s2 that begin at once.
        let stopped = largest(|ms| 1e-3 * ms.min(100.3));
        let back = largest(|ms| -0.8e-3 * (ms - 100.3).abs());
        let accelerated = largest(|ms| 0.5e-3 * ms + 0.15e-3 * (ms - 100.3).max(0.0).powi(2));
        for (what, share) in [("stopped", stopped), ("thrown back", back), ("accelerated", accelerated)] {
            assert!(share < 0.6, "{what}: {share}");
        }
    }

    #[test]
    fn a_wild_reading_and_lost_ticks_are_no_jump() {
        let wild = largest(|ms| 0.3e-3 * ms + if ms == 100.0 { 3e-3 } else { 0.0 });
        let lost = largest(|ms| 1e-3 * if ms < 100.5 { ms } else { ms + 2.0 });
        // Two readings that repeat the last good one, as a glitch is bridged.
        let bridged = largest(|ms| 1e-3 * if (99.5..101.5).contains(&ms) { 99.0 } else { ms });
        for (what, share) in [("wild", wild), ("lost", lost), ("bridged", bridged)] {
            assert!(share < 0.9, "{what}: {share}");
        }
    }
}
