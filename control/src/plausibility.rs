//! Which readings can be believed.
//!
//! Every channel passes three tests, each tick:
//!
//! - **range**: inside the limits of what a healthy sensor delivers;
//! - **rate**: no further from the last good reading than the plant can have moved since, plus noise;
//! - **stuck**: a channel that has shown sample-to-sample noise must not repeat one code for longer than the stuck time.
//!
//! A reading that fails range or rate is *bridged*: the law goes on with the last good one. Bridging fills a bucket four
//! times as fast as good readings empty it; when it is full the reason is raised. A single spike therefore costs nothing, a lost
//! sensor is caught after the glitch time (5 ms), and an intermittent one too unless four out of five readings are good,
//! when bridging alone keeps the law supplied.
//!
//! **Why stuck is judged by noise.** A resting piston with a quiet sensor repeats its code for hours, rightly; a resting
//! piston with a sensor that has 3 codes of noise repeats a code 15 times about once in 10^16 samples. So the channel's
//! own noise decides: in windows of 64 samples, direction reversals (two in three for noise, next to none for motion) and
//! repeats (few for noise of more than 1.5 codes) are counted. After four noisy windows the channel is known to be noisy, and
//! from then on silence is a fault. When the noise fades gradually, a window with many short repeats makes the channel
//! quiet again and the test is off. A position that freezes in mid-move without ever having been noisy is seen by
//! `frozen.rs`; the rest is left to the on-board model, which sees that pressures and motion no longer agree.

use crate::codes::AdcCode;
use crate::scales::AdcScale;

/// What one channel's readings must satisfy, in the bits of its quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelLimits {
    /// Code → quantity.
    pub(crate) scale: AdcScale,
    /// Lowest believable reading.
    pub(crate) low: i32,
    /// Highest believable reading.
    pub(crate) high: i32,
    /// Largest change in one tick without noise.
    pub(crate) step: i32,
    /// Largest change by noise alone.
    pub(crate) noise: i32,
    /// Level at which the bucket is full: [`GLITCH_WEIGHT`] times the glitch time in ticks.
    pub(crate) glitch_limit: u16,
    /// Repeats of one code that a noisy channel cannot show.
    pub(crate) stuck_ticks: u16,
}

/// How much faster bridging fills the bucket than good readings empty it.
pub const GLITCH_WEIGHT: u16 = 4;
/// Samples per noise window.
const WINDOW: u8 = 64;
/// Reversals that make a window noisy: white noise has 42 on average.
const NOISY_REVERSALS: u8 = 28;
/// Repeats that a noisy window has at most: noise of 1.5 codes has 12 on average.
const NOISY_REPEATS: u8 = 12;
/// Repeats that make a window quiet.
const QUIET_REPEATS: u8 = 24;
/// Noisy windows needed before silence counts as a fault.
const NOISY_WINDOWS: u8 = 4;
/// A run of repeats longer than this is judged by the stuck time, not by the window.
const LONG_RUN: u16 = 8;

/// What is wrong with a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Outside the range for longer than the glitch time.
    Range,
    /// Jumping for longer than the glitch time.
    Rate,
    /// Repeating one code although the channel is noisy.
    Stuck,
}

/// What a channel remembers from tick to tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ChannelState {
    good: i32,
    seen: bool,
    allowed: i32,
    bucket: u16,
    noise: NoiseWatch,
}

impl ChannelState {
    /// The last good reading, in the bits of the channel's quantity; zero before the first.
    #[inline]
    #[must_use]
    pub fn good(&self) -> i32 {
        self.good
    }

    /// Whether there has been a good reading.
    #[inline]
    #[must_use]
    pub fn seen(&self) -> bool {
        self.seen
    }

    /// Whether the channel is known to be noisy, so that silence is a fault.
    #[must_use]
    pub fn noisy(&self) -> bool {
        self.noise.noisy_windows >= NOISY_WINDOWS
    }

    /// Forgets implausible readings, keeps what is known of the noise.
    pub(crate) fn clear(&mut self) {
        self.bucket = 0;
        self.seen = false;
        self.noise.run = 0;
    }
}

impl ChannelLimits {
    /// Takes one code. `rail_is_fault` says whether a code at the converter's end is a fault even when it was reached
    /// continuously.
    #[inline]
    pub fn check(&self, state: &mut ChannelState, code: AdcCode, rail_is_fault: bool) -> Option<Fault> {
        let reading = self.scale.bits(code);
        let at_rail = self.scale.at_rail(code);
        let in_range = reading >= self.low && reading <= self.high && !(at_rail && rail_is_fault);
        let near = !state.seen || reading.abs_diff(state.good) <= state.allowed.unsigned_abs();
        let silent = state.noise.watch(code.0) >= self.stuck_ticks;
        if in_range && near {
            state.good = reading;
            state.seen = true;
            state.allowed = self.noise.saturating_add(self.step);
            state.bucket = state.bucket.saturating_sub(1);
        } else {
            state.allowed = state.allowed.saturating_add(self.step);
            state.bucket = state.bucket.saturating_add(GLITCH_WEIGHT).min(self.glitch_limit);
        }
        if state.bucket >= self.glitch_limit {
            return Some(if in_range && !at_rail { Fault::Rate } else { Fault::Range });
        }
        (silent && state.noisy() && !at_rail).then_some(Fault::Stuck)
    }
}

/// Tells noise from silence and from motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct NoiseWatch {
    last: u16,
    rising: bool,
    run: u16,
    samples: u8,
    repeats: u8,
    reversals: u8,
    noisy_windows: u8,
}

impl NoiseWatch {
    /// Takes one code; returns how often it has been repeated in a row.
    #[inline]
    fn watch(&mut self, code: u16) -> u16 {
        if code == self.last {
            self.run = self.run.saturating_add(1);
            if self.run > LONG_RUN {
                return self.run;
            }
            self.repeats += 1;
        } else {
            let rising = code > self.last;
            self.reversals += u8::from(rising != self.rising);
            self.rising = rising;
            self.last = code;
            self.run = 0;
        }
        self.samples += 1;
        if self.samples >= WINDOW {
            if self.reversals >= NOISY_REVERSALS && self.repeats <= NOISY_REPEATS {
                self.noisy_windows = (self.noisy_windows + 1).min(NOISY_WINDOWS);
            } else if self.repeats > QUIET_REPEATS {
                self.noisy_windows = 0;
            }
            (self.samples, self.repeats, self.reversals) = (0, 0, 0);
        }
        self.run
    }
}
