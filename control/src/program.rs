//! References made on the board: steps, ramps, sines, and an identification sequence for the diagnosis.
//!
//! Every program is a list of segments, each a shape driven by one phase accumulator (2^32 per period, which wraps by
//! intent and nowhere else). The tick only adds, multiplies and looks up; all divisions are done when the program is made.
//!
//! The identification sequence takes its whole period once and repeats. What each part shows, for a period `T`:
//!
//! | share | shape | amplitude | for |
//! | --- | --- | --- | --- |
//! | 4 % | rest | 0 | offsets, noise, leaks at rest |
//! | 36 % | random levels, each held `T/40` | 1 | flow coefficients, leaks while holding, volumes |
//! | 20 % | slow triangle, 2 cycles | 1 | Coulomb and viscous friction by direction, friction against position |
//! | 10 % | small triangle, 2 cycles | 0.1 | dead zone, hysteresis, stiction |
//! | 18 % | sine, rising from `8/T` to `80/T` | 0.3 | lag, delay, mass |
//! | 12 % | random two-level, each held `T/200` | 0.15 | everything fast, away from the sine |

use crate::arithmetic::{multiply, saturate};
use crate::config_error::ConfigError;
use crate::parameters::Key;
use crate::quantities::Position;
use parameter_table::{Limits, Must, Value};

/// What the reference looks like over time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Shape {
    /// Square wave between centre + amplitude (first) and centre − amplitude.
    #[default]
    Step,
    /// Triangle wave, starting upwards from the centre.
    Ramp,
    /// Sine, starting upwards from the centre.
    Sine,
    /// The identification sequence.
    Identification,
}

/// A reference program in physical numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ProgramParameters {
    /// The shape; `kind` in scenario files.
    #[cfg_attr(feature = "serde", serde(rename = "kind"))]
    pub shape: Shape,
    /// Centre of the motion, m; within ±3.9.
    pub centre_m: f32,
    /// Half the peak-to-peak motion, m; 0 … 3.9.
    pub amplitude_m: f32,
    /// One period, s; 0.01 … 3600. For the identification sequence, the whole sequence: 40 s suits the diagnosis.
    pub period_s: f32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum SegmentShape {
    Rest,
    Square,
    Triangle,
    Sine,
    /// A new random value in −1 … 1 at each wrap of the phase.
    Levels,
    /// A new random sign at each wrap of the phase.
    TwoLevel,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Segment {
    shape: SegmentShape,
    ticks: u32,
    amplitude: i32,
    phase_step: u32,
    /// Added to the phase step each tick, 2^-16 units: makes a sine a chirp.
    phase_step_rise_q16: i64,
}

const MAX_SEGMENTS: usize = 6;

/// A program ready to run: see [`Program::advance`].
#[derive(Clone, Debug, PartialEq)]
pub struct Program {
    centre: Position,
    segments: [Segment; MAX_SEGMENTS],
}

/// How far a program has run. `Default` is the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProgramState {
    segment: usize,
    tick: u32,
    phase: u32,
    phase_step_q16: i64,
    level: i32,
    random: u32,
}

impl Default for ProgramState {
    fn default() -> Self {
        Self { segment: 0, tick: 0, phase: 0, phase_step_q16: 0, level: 0, random: 0x2F6E_2B15 }
    }
}

impl Program {
    /// Prepares a program.
    ///
    /// # Errors
    /// The first parameter that is not finite or out of range.
    pub fn from_parameters(p: &ProgramParameters, tick_hz: u32) -> Result<Self, ConfigError> {
        let check = |key, value: f32, limits: &'static Limits| {
            if limits.contains(value) {
                Ok(f64::from(value))
            } else {
                Err(ConfigError { key, value: f64::from(value), must: Must::Fit(limits) })
            }
        };
        const FARTHEST: f64 = Key::position_range_m.row().limits.high;
        let centre = check("centre_m", p.centre_m, const { &Limits::new("m", -FARTHEST, FARTHEST) })?;
        let amplitude = check("amplitude_m", p.amplitude_m, const { &Limits::new("m", 0.0, FARTHEST) })?;
        let period = check("period_s", p.period_s, const { &Limits::new("s", 0.01, 3600.0) })?;
        Key::tick_hz.row().check(Value::Number(tick_hz as f32))?;
        let hz = f64::from(tick_hz);
        // `share` of the period, `cycles` of the shape in it, ending at `cycles_end` times the first rate
        let segment = |shape, share: f64, size: f64, cycles: f64, sweep: f64| {
            let ticks = ((period * share * hz) as u32).max(1);
            // Below half a turn per tick, the fastest that is a shape at all.
            let step = (cycles / f64::from(ticks) * 4_294_967_296.0).min(2_147_483_648.0);
            let rise = step * (sweep - 1.0) / f64::from(ticks) * 65_536.0;
            Segment {
                shape,
                ticks,
                amplitude: (amplitude * size * f64::from(1 << 28)) as i32,
                phase_step: step as u32,
                phase_step_rise_q16: rise as i64,
            }
        };
        let none = Segment { shape: SegmentShape::Rest, ticks: 0, amplitude: 0, phase_step: 0, phase_step_rise_q16: 0 };
        let mut segments = [none; MAX_SEGMENTS];
        match p.shape {
            Shape::Step => segments[0] = segment(SegmentShape::Square, 1.0, 1.0, 1.0, 1.0),
            Shape::Ramp => segments[0] = segment(SegmentShape::Triangle, 1.0, 1.0, 1.0, 1.0),
            Shape::Sine => segments[0] = segment(SegmentShape::Sine, 1.0, 1.0, 1.0, 1.0),
            Shape::Identification => {
                segments = [
                    segment(SegmentShape::Rest, 0.04, 0.0, 0.0, 1.0),
                    segment(SegmentShape::Levels, 0.36, 1.0, 0.36 * 40.0, 1.0),
                    segment(SegmentShape::Triangle, 0.20, 1.0, 2.0, 1.0),
                    segment(SegmentShape::Triangle, 0.10, 0.1, 2.0, 1.0),
                    segment(SegmentShape::Sine, 0.18, 0.3, 0.18 * 8.0, 10.0),
                    segment(SegmentShape::TwoLevel, 0.12, 0.15, 0.12 * 200.0, 1.0),
                ];
            }
        }
        Ok(Self { centre: Position::from_bits((centre * f64::from(1 << 28)) as i32), segments })
    }

    /// The reference for this tick; moves the state on by one tick.
    #[inline]
    pub fn advance(&self, state: &mut ProgramState) -> Position {
        let Some(segment) = self.segments.get(state.segment) else { return self.centre };
        let first = state.tick == 0;
        if first {
            state.phase = 0;
            state.phase_step_q16 = i64::from(segment.phase_step) << 16;
        }
        // Signed fraction of the amplitude, 30 fractional bits.
        let fraction = match segment.shape {
            SegmentShape::Rest => 0,
            SegmentShape::Square => {
                if state.phase < 1 << 31 {
                    ONE
                } else {
                    -ONE
                }
            }
            SegmentShape::Triangle => triangle(state.phase),
            SegmentShape::Sine => sine(state.phase),
            SegmentShape::Levels | SegmentShape::TwoLevel => {
                let step = (state.phase_step_q16 >> 16) as u32;
                if first || state.phase < step {
                    state.random = next_random(state.random);
                    state.level = if segment.shape == SegmentShape::Levels {
                        (state.random >> 1) as i32 - ONE
                    } else if state.random & 1 == 0 {
                        ONE
                    } else {
                        -ONE
                    };
                }
                state.level
            }
        };
        state.phase = state.phase.wrapping_add((state.phase_step_q16 >> 16) as u32);
        state.phase_step_q16 = state.phase_step_q16.saturating_add(segment.phase_step_rise_q16);
        state.tick += 1;
        if state.tick >= segment.ticks {
            state.tick = 0;
            state.segment += 1;
            if self.segments.get(state.segment).is_none_or(|next| next.ticks == 0) {
                state.segment = 0;
            }
        }
        let offset = multiply(fraction, segment.amplitude, 30);
        Position::from_bits(saturate(i64::from(self.centre.to_bits()) + i64::from(offset)))
    }
}

/// 1 with 30 fractional bits.
const ONE: i32 = 1 << 30;

/// −1 … 1 with 30 fractional bits, from zero upwards.
#[inline]
fn triangle(phase: u32) -> i32 {
    // Quarter turns: up, down, down, up.
    let within = (phase & (ONE as u32 - 1)) as i32;
    match phase >> 30 {
        0 => within,
        1 => ONE - within,
        2 => -within,
        _ => within - ONE,
    }
}

/// `sin` of a full turn per 2^32, 30 fractional bits, within 2e-8 (Hastings' polynomial of degree nine on a quarter turn).
#[inline]
fn sine(phase: u32) -> i32 {
    const fn q30(value: f64) -> i32 {
        (value * (1_u64 << 30) as f64) as i32
    }
    let x = triangle(phase);
    let square = multiply(x, x, 30);
    let mut sum = const { q30(0.000_151_484_19) };
    sum = multiply(sum, square, 30) + const { q30(-0.004_673_765_57) };
    sum = multiply(sum, square, 30) + const { q30(0.079_689_679_28) };
    sum = multiply(sum, square, 30) + const { q30(-0.645_963_711_06) };
    sum = multiply(sum, square, 30) + const { q30(1.570_796_318_47) };
    multiply(sum, x, 30)
}

/// Marsaglia's xorshift: a sequence that repeats after 2^32 − 1 draws, the same on every machine.
#[inline]
fn next_random(mut x: u32) -> u32 {
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sine_is_within_2e_8_of_the_real_one() {
        for n in 0..100_000_u32 {
            let phase = n.wrapping_mul(42_949);
            let exact = (f64::from(phase) / 4_294_967_296.0 * core::f64::consts::TAU).sin();
            assert!((f64::from(sine(phase)) / f64::from(ONE) - exact).abs() < 2e-8, "phase {phase}");
        }
    }
}
