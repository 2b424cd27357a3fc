//! Setpoints over time, evaluated once a tick in integers: no float, no division.

use board_link::{Generator, GeneratorError};
use control::Position;

/// Fractional bits of a ramp's own position.
const FINE_SHIFT: u32 = 28;

/// A generator made ready for ticks of one length, and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Course {
    shape: Shape,
    /// Ticks since the shape began, wraps.
    tick: u32,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Hold(Position),
    Step {
        low: Position,
        high: Position,
        half_ticks: u32,
    },
    Ramp {
        target: Position,
        ticks_left: u32,
        ticks: u32,
        begun: bool,
        fine: i64,
        slope: i64,
    },
    Sine(Wave),
    Identification {
        centre: Position,
        amplitude: Position,
        tick_hz: u32,
        segment: u8,
        left: u32,
        wave: Wave,
        slope: i64,
        fine: i64,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Wave {
    centre: Position,
    amplitude: Position,
    phase: u32,
    phase_step: u32,
}

/// One part of the identification sequence. Levels and amplitudes are in eighths of the generator's amplitude.
enum Segment {
    /// Jump to a level and stay.
    Level { eighths: i8, ms: u32 },
    /// Travel at constant speed to a level.
    Travel { eighths: i8, ms: u32 },
    /// Sine about the centre.
    Sine { eighths: i8, millihertz: u32, ms: u32 },
}

/// Forty seconds: steps of three sizes both ways (flow coefficients, volumes, dead zone), rests (leaks, offsets), slow
/// travel both ways through the whole stroke (friction by direction, position and pressure), sines of rising frequency
/// (mass, lag, delay).
const SEQUENCE: [Segment; 22] = [
    Segment::Level { eighths: 0, ms: 1000 },
    Segment::Level { eighths: 8, ms: 2000 },
    Segment::Level { eighths: -8, ms: 2500 },
    Segment::Level { eighths: 4, ms: 2000 },
    Segment::Level { eighths: -4, ms: 2000 },
    Segment::Level { eighths: 1, ms: 1500 },
    Segment::Level { eighths: -1, ms: 1500 },
    Segment::Level { eighths: 0, ms: 1000 },
    Segment::Travel { eighths: 8, ms: 4000 },
    Segment::Level { eighths: 8, ms: 1000 },
    Segment::Travel { eighths: -8, ms: 6000 },
    Segment::Level { eighths: -8, ms: 1000 },
    Segment::Travel { eighths: 0, ms: 2000 },
    Segment::Sine { eighths: 6, millihertz: 500, ms: 4000 },
    Segment::Sine { eighths: 4, millihertz: 1000, ms: 3000 },
    Segment::Sine { eighths: 2, millihertz: 2000, ms: 1500 },
    Segment::Sine { eighths: 1, millihertz: 4000, ms: 1000 },
    Segment::Level { eighths: 2, ms: 500 },
    Segment::Level { eighths: -2, ms: 500 },
    Segment::Level { eighths: 6, ms: 700 },
    Segment::Level { eighths: -6, ms: 800 },
    Segment::Level { eighths: 0, ms: 500 },
];

impl Course {
    /// Checks a generator and prepares it. Divides: for the background, not for the tick.
    ///
    /// # Errors
    /// If a number of the generator is out of range.
    pub fn prepare(generator: &Generator, tick_hz: u32) -> Result<Self, GeneratorError> {
        generator.check()?;
        let shape = match *generator {
            Generator::Hold { position_um } => Shape::Hold(metres(position_um)),
            Generator::Step { low_um, high_um, period_ms } => Shape::Step {
                low: metres(low_um),
                high: metres(high_um),
                half_ticks: (ticks(period_ms, tick_hz) / 2).max(1),
            },
            Generator::Ramp { target_um, duration_ms } => {
                let ticks = ticks(duration_ms, tick_hz).max(1);
                Shape::Ramp { target: metres(target_um), ticks_left: ticks, ticks, begun: false, fine: 0, slope: 0 }
            }
            Generator::Sine { centre_um, amplitude_um, frequency_mhz } => Shape::Sine(Wave {
                centre: metres(centre_um),
                amplitude: metres(amplitude_um),
                phase: 0,
                phase_step: phase_step(frequency_mhz, tick_hz),
            }),
            Generator::Identification { centre_um, amplitude_um } => {
                let (centre, amplitude) = (metres(centre_um), metres(amplitude_um));
                let wave = Wave { centre, amplitude, phase: 0, phase_step: 0 };
                Shape::Identification { centre, amplitude, tick_hz, segment: u8::MAX, left: 0, wave, slope: 0, fine: 0 }
            }
        };
        Ok(Self { shape, tick: 0 })
    }

    /// Stays at a position.
    #[must_use]
    pub fn hold(position: Position) -> Self {
        Self { shape: Shape::Hold(position), tick: 0 }
    }

    /// The setpoint of the coming tick. `present` is where a ramp begins.
    #[inline]
    pub fn next(&mut self, present: Position) -> Position {
        let tick = self.tick;
        self.tick = self.tick.wrapping_add(1);
        match &mut self.shape {
            Shape::Hold(position) => *position,
            Shape::Step { low, high, half_ticks } => {
                if tick >= 2 * *half_ticks {
                    self.tick = 1;
                    *low
                } else if tick >= *half_ticks {
                    *high
                } else {
                    *low
                }
            }
            Shape::Ramp { target, ticks_left, ticks, begun, fine, slope } => {
                if !*begun {
                    *begun = true;
                    *fine = fine_of(present);
                    *slope = slope_of(fine_of(*target) - *fine, *ticks);
                }
                *ticks_left = ticks_left.saturating_sub(1);
                *fine += *slope;
                if *ticks_left == 0 { *target } else { coarse(*fine) }
            }
            Shape::Sine(wave) => wave.next(),
            Shape::Identification { centre, amplitude, tick_hz, segment, left, wave, slope, fine } => {
                if *left == 0 {
                    *segment = if usize::from(*segment) + 1 < SEQUENCE.len() { *segment + 1 } else { 0 };
                    let level = |eighths: i8| {
                        // |amplitude · 8| < 2^31: the amplitude is at most 2 m of the format's 8.
                        let part = (i64::from(amplitude.to_bits()) * i64::from(eighths)) >> 3;
                        Position::from_bits(part as i32)
                    };
                    let Some(next) = SEQUENCE.get(usize::from(*segment)) else { return *centre };
                    let (Segment::Level { ms, .. } | Segment::Travel { ms, .. } | Segment::Sine { ms, .. }) = next;
                    *left = ticks(*ms, *tick_hz).max(1);
                    (*slope, wave.phase_step) = (0, 0);
                    match *next {
                        Segment::Level { eighths, .. } => *fine = fine_of(centre.saturating_add(level(eighths))),
                        Segment::Travel { eighths, .. } => {
                            *slope = slope_of(fine_of(centre.saturating_add(level(eighths))) - *fine, *left);
                        }
                        Segment::Sine { eighths, millihertz, .. } => {
                            *fine = fine_of(*centre);
                            *wave = Wave {
                                centre: *centre,
                                amplitude: level(eighths),
                                phase: 0,
                                phase_step: phase_step(millihertz, *tick_hz),
                            };
                        }
                    }
                }
                *left -= 1;
                *fine += *slope;
                if wave.phase_step == 0 { coarse(*fine) } else { wave.next() }
            }
        }
    }
}

impl Wave {
    #[inline]
    fn next(&mut self) -> Position {
        let sine = i64::from(sine_q30(self.phase));
        self.phase = self.phase.wrapping_add(self.phase_step);
        // |amplitude| < 2^29 (2 m), |sine| <= 2^30.
        let deviation = (i64::from(self.amplitude.to_bits()) * sine) >> 30;
        self.centre.saturating_add(Position::from_bits(deviation as i32))
    }
}

/// Micrometres → metres, to the nearest bit: multiplies by 2^50 / 10^6 instead of dividing.
fn metres(um: i32) -> Position {
    // |um| <= 2 000 000 after the generator's check: the product stays below 2^52.
    Position::from_bits(((i64::from(um) * 1_125_899_907 + (1 << 21)) >> 22) as i32)
}

/// Milliseconds → ticks without a 64-bit division: ms · hz / 1000 with ms = 1000 q + r.
fn ticks(ms: u32, tick_hz: u32) -> u32 {
    // One hour at 10 kHz is 36 million: no overflow.
    (ms / 1000) * tick_hz + (ms % 1000) * tick_hz / 1000
}

/// Phase per tick, one turn being 2^32: `2^32 f / tick_hz` in two 32-bit divisions, to 2^-16 of a step.
fn phase_step(millihertz: u32, tick_hz: u32) -> u32 {
    // 2^32 / (1000 hz) = 4_294_967.296 / hz; first the turns per millihertz in 16 more bits, then the multiple.
    let quotient = 4_294_967_u32 / tick_hz;
    let remainder = 4_294_967_u32 % tick_hz;
    let fraction = (remainder << 16) / tick_hz + (19_399 / tick_hz); // 0.296 · 65536 = 19 399
    ((u64::from(millihertz) * ((u64::from(quotient) << 16) + u64::from(fraction))) >> 16) as u32
}

fn fine_of(position: Position) -> i64 {
    i64::from(position.to_bits()) << FINE_SHIFT
}

#[inline]
fn coarse(fine: i64) -> Position {
    Position::from_bits(((fine + (1 << (FINE_SHIFT - 1))) >> FINE_SHIFT) as i32)
}

/// `distance / ticks` without a 64-bit division: a reciprocal of 32 bits, good to one part in `ticks`/2^32 of the way, and
/// the end of the ramp lands on its target anyway.
#[inline]
fn slope_of(distance: i64, ticks: u32) -> i64 {
    let reciprocal = u32::MAX / ticks.max(1);
    // distance < 2^58: split so that neither product overflows.
    ((distance >> 27) * i64::from(reciprocal)) >> 5
}

/// `sin(2 π phase / 2^32)` in Q30; worst error 2e-6.
#[inline]
fn sine_q30(phase: u32) -> i32 {
    // Fold into a quarter: x in -1…1 quarter turns, Q30.
    let quarter = (phase << 1) as i32; // half-turn sawtooth, Q31 of a half turn
    let folded = phase.wrapping_add(1 << 30) >> 31 == 1;
    let x = if folded { (quarter as u32).wrapping_neg() as i32 } else { quarter } >> 1;
    let x = i64::from(x);
    let square = (x * x) >> 30;
    // Minimax of degree 7 on the quarter turn (coefficients in Q30).
    const C1: i64 = 1_686_624_492; // 1.57079148
    const C3: i64 = -693_521_360; // -0.64589411 (refined below by the test's bound)
    const C5: i64 = 85_290_411; // 0.0794328
    const C7: i64 = -4_652_617; // -0.00433309
    let mut sum = C7;
    sum = C5 + ((sum * square) >> 30);
    sum = C3 + ((sum * square) >> 30);
    sum = C1 + ((sum * square) >> 30);
    ((sum * x) >> 30).clamp(-(1 << 30), 1 << 30) as i32
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;

    #[test]
    fn the_integer_sine_is_a_sine() {
        for step in 0..100_000_u32 {
            let phase = step.wrapping_mul(42_949);
            let exact = (f64::from(phase) / 4_294_967_296.0 * std::f64::consts::TAU).sin();
            let error = f64::from(sine_q30(phase)) / f64::from(1 << 30) - exact;
            assert!(error.abs() < 2.0e-6, "phase {phase}: {error}");
        }
    }

    #[test]
    fn the_identification_sequence_lasts_forty_seconds() {
        let total: u32 = SEQUENCE
            .iter()
            .map(|(Segment::Level { ms, .. } | Segment::Travel { ms, .. } | Segment::Sine { ms, .. })| ms)
            .sum();
        assert_eq!(total, 40_000);
    }

    #[test]
    fn a_sine_has_the_frequency_asked_for() {
        for (millihertz, tick_hz) in [(1, 1000), (500, 1000), (2_000, 10_000), (50_000, 1_000), (1, 10_000)] {
            let exact = f64::from(millihertz) / 1000.0 / f64::from(tick_hz) * 4_294_967_296.0;
            let relative = f64::from(phase_step(millihertz, tick_hz)) / exact - 1.0;
            assert!(relative.abs() < 3.0e-3, "{millihertz} mHz at {tick_hz} Hz: {relative}");
        }
    }
}
