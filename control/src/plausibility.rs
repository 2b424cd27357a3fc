//! Which readings can be believed.
//!
//! Every channel passes three tests, each tick:
//!
//! - **range**: inside the limits of what a healthy sensor delivers;
//! - **rate**: no further from the last good reading than the plant can have moved since, plus noise; a chamber's pressure, where
//!   the positioning law knows the rig, no further than its air can have taken it at that place (`AirStep`);
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
use crate::parameters::Parameters;
use crate::quantities::{Position, Pressure};
use crate::scales::AdcScale;
use core::f64::consts::FRAC_PI_2;

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
        self.check_step(state, code, rail_is_fault, self.step)
    }

    /// The same with another largest change in one tick, from zero to that without noise.
    #[inline]
    pub(crate) fn check_step(
        &self,
        state: &mut ChannelState,
        code: AdcCode,
        rail_is_fault: bool,
        step: i32,
    ) -> Option<Fault> {
        let reading = self.scale.bits(code);
        let at_rail = self.scale.at_rail(code);
        let in_range = reading >= self.low && reading <= self.high && !(at_rail && rail_is_fault);
        let near = !state.seen || reading.abs_diff(state.good) <= state.allowed.unsigned_abs();
        let silent = state.noise.watch(code.0) >= self.stuck_ticks;
        if in_range && near {
            state.good = reading;
            state.seen = true;
            state.allowed = self.noise.saturating_add(step);
            state.bucket = state.bucket.saturating_sub(1);
        } else {
            state.allowed = state.allowed.saturating_add(step);
            state.bucket = state.bucket.saturating_add(GLITCH_WEIGHT).min(self.glitch_limit);
        }
        if state.bucket >= self.glitch_limit {
            return Some(if in_range && !at_rail { Fault::Rate } else { Fault::Range });
        }
        (silent && state.noisy() && !at_rail).then_some(Fault::Stuck)
    }
}

/// Flows that move a chamber's pressure, in widest flows of the rig file: one through the valve, and one for the motion that it holds
/// up, which adds to it where the piston turns back. Both at their most never meet. In random moves of the paper's and the catalogue's
/// rigs, the file right or 10 % wrong, pressures move by up to 1.2 of these flows; the rest is for files that are further off. With 3
/// or 4 of them garbage moves the piston by up to 14 instead of 7 mm.
const FLOWS: f64 = 2.0;

/// How far the air can move a chamber's pressure in one tick, by (3.6, 3.7): `n R T q / V`, `q` being [`FLOWS`] times the widest
/// flow at full supply and `V` the volume at the piston's place. A chamber at its end stop moves a hundred times as fast as at
/// mid-stroke, so one limit for all places would see next to nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AirStep {
    /// The step times the volume over the area, in bits of the pressure and of the length.
    product: u32,
    /// Bits of a position that a length drops.
    shift: u32,
    /// Volume at mid-stroke over the area.
    middle: Position,
}

impl AirStep {
    /// Of chambers A and B.
    pub(crate) fn of(p: &Parameters) -> [Self; 2] {
        let [supply, atmosphere] = [p.servo_supply_pa, p.servo_atmosphere_pa].map(f64::from);
        let chamber = |fill: f32, exhaust: f32, length: f32| {
            let drop = (supply - atmosphere).max(0.0);
            // A choked flow is the full one up to its critical ratio.
            let [filling, exhausting] = [p.servo_fill_critical_ratio, p.servo_exhaust_critical_ratio]
                .map(|critical| if critical.is_some() { supply } else { drop });
            let widest = FRAC_PI_2 * (f64::from(fill) * filling).max(f64::from(exhaust) * exhausting);
            let product = f64::from(p.servo_heat_capacity_ratio) * FLOWS * widest / f64::from(p.tick_hz);
            let in_bits = product * f64::from(1_u32 << Pressure::FRAC_NBITS);
            // As many bits of the length as fit.
            let mut bits = Position::FRAC_NBITS;
            while bits > 0 && in_bits * f64::from(1_u32 << bits) > f64::from(u32::MAX) {
                bits -= 1;
            }
            Self {
                product: (in_bits * f64::from(1_u32 << bits)) as u32,
                shift: Position::FRAC_NBITS - bits,
                middle: Position::saturating_from_num(length),
            }
        };
        let or = |b: Option<f32>, a: f32| b.unwrap_or(a);
        [
            chamber(p.servo_fill_m_per_s, p.servo_exhaust_m_per_s, p.servo_length_a_m),
            chamber(
                or(p.servo_fill_b_m_per_s, p.servo_fill_m_per_s),
                or(p.servo_exhaust_b_m_per_s, p.servo_exhaust_m_per_s),
                p.servo_length_b_m,
            ),
        ]
    }

    /// With the piston `growth` from mid-stroke in the direction in which the chamber grows, in bits of a pressure.
    #[inline]
    pub(crate) fn at(&self, growth: Position) -> i32 {
        let length = self.middle.saturating_add(growth).to_bits().max(0).unsigned_abs() >> self.shift;
        // A length that is dropped bits of is too short, and the step on the safe side.
        self.product.checked_div(length).map_or(i32::MAX, |step| step.min(i32::MAX as u32) as i32)
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
