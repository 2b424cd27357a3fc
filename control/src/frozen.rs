//! A position that freezes in mid-move, for sensors too quiet to be judged by their noise.
//!
//! A piston cannot stop within a tick. If the code moved briskly (at least 0.05 m/s and 8 codes over the last 4 ms) and
//! then repeats to the bit for the whole stuck time, either the piston hit something or the sensor is frozen. The pressures tell
//! which: against an obstacle the valve's flow piles up in the chambers, under way it goes into motion. So the reading is
//! called stuck only if `p_a − p_b` has changed by less than 1 kPa since the code froze, and only away from the ends of
//! the setpoint range, where end stops are.
//!
//! This is deliberately timid: no trip for a freeze at rest, in slow motion or in the middle of an acceleration. Those are left to the
//! model monitor, which knows the cylinder.

use crate::codes::AdcCode;

/// Samples of history; one every millisecond.
const HISTORY: usize = 4;
/// Least travel in codes before a freeze, so that a coarse sensor's steps do not look like motion and rest.
pub(crate) const LEAST_CODES: u16 = 8;
/// Change of `p_a − p_b` in Pa that speaks for an obstacle.
pub(crate) const OBSTACLE_PA: i32 = 1000;

/// What the test needs, precomputed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FreezeLimits {
    /// Ticks between samples of history.
    pub(crate) spacing_ticks: u16,
    /// Codes that the position must have travelled within the history.
    pub(crate) travel_codes: u16,
    /// Repeats that make a freeze.
    pub(crate) freeze_ticks: u16,
    /// [`OBSTACLE_PA`] in the bits of a pressure.
    pub(crate) obstacle: i32,
    /// Codes between which no end stop is expected.
    pub(crate) low: u16,
    /// See `low`.
    pub(crate) high: u16,
}

/// What the test remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FreezeWatch {
    history: [u16; HISTORY],
    samples: u8,
    tick: u16,
    last: u16,
    run: u16,
    brisk: bool,
    difference: i32,
}

impl FreezeWatch {
    /// Takes the position's code and `p_a − p_b`; true when the position froze in mid-move.
    #[inline]
    pub(crate) fn frozen(&mut self, limits: &FreezeLimits, code: AdcCode, difference: i32) -> bool {
        let code = code.0;
        if code == self.last && usize::from(self.samples) >= HISTORY {
            if self.run == 0 {
                self.brisk = self.history[HISTORY - 1].abs_diff(code) >= limits.travel_codes;
                self.difference = difference;
            }
            self.run = self.run.saturating_add(1);
            self.brisk &= difference.abs_diff(self.difference) <= limits.obstacle.unsigned_abs();
        } else {
            self.run = 0;
            self.brisk = false;
        }
        self.last = code;
        self.tick += 1;
        if self.tick >= limits.spacing_ticks {
            self.tick = 0;
            self.history = [code, self.history[0], self.history[1], self.history[2]];
            self.samples = self.samples.saturating_add(1);
        }
        self.brisk && self.run >= limits.freeze_ticks && code > limits.low && code < limits.high
    }
}
