//! The reference: a target becomes a motion within limits of speed, acceleration and jerk, planned anew each tick.
//!
//! Nothing of a plan is stored. Each tick asks where the motion would stop if it braked from now on, and picks the
//! jerk whose stopping point is the target. So a new target in mid-move, or a motion that was taken back because the
//! valve could not follow, needs no case of its own.
//!
//! The plan is made in units in which the limits `A` of acceleration and `J` of jerk are one: time `A/J`, speed `A²/J`,
//! length `A³/J²`. Then stopping takes no division, and every rig uses the same range of numbers. They have 26 fractional
//! bits and end at ±32: a target farther away is as good as one there.

use super::constants::{CALM_JERK, NEAR_M, RESERVE};
use super::factor::{Factor, quotient, root_q26};
use super::rig::Rig;
use super::{Acceleration, Jerk, Part, Tick};
use crate::arithmetic::{bits, fixed, limit, saturate};
use crate::config_error::{ConfigError, demand};
use crate::parameters::{Key, Parameters};
use crate::quantities::{Position, Velocity};
use fixed::types::I6F26;

/// Fractional bits of a motion's own position: at 20,000 ticks a second slow motion is less than a bit of [`Position`] a tick.
const FINE: u32 = 44 - Position::FRAC_NBITS;
const ONE: i32 = 1 << 26;
/// Shortest time for which a jerk is planned, s.
const PLANNED_S: f64 = 1e-3;
/// Longest unit of length of the plan, m, in which 26 fractional bits are a micrometre.
const MOST_UNIT_M: f64 = 67.0;

/// Limits of the motion, and how to convert to units in which they are one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// Highest speed, in those units.
    pub(crate) speed: I6F26,
    /// The time for which a jerk is planned, in those units: a tick, but no less than a millisecond. In less, full jerk changes
    /// the stopping point by a few bits only, and the jerk would alternate between its ends.
    pub(crate) tick: I6F26,
    /// From m to their length, `J²/A³`.
    pub(crate) length: Factor<Position, I6F26>,
    /// From m/s to their speed, `J/A²`.
    pub(crate) velocity: Factor<Velocity, I6F26>,
    /// From m/s2 to their acceleration, `1/A`.
    pub(crate) acceleration: Factor<Acceleration, I6F26>,
    /// From m/s3 to their jerk, `1/J`.
    pub(crate) aim_jerk: Factor<Jerk, I6F26>,
    /// From a change of acceleration in a tick to the jerk.
    pub(crate) jerk: Factor<I6F26, Jerk>,
    /// What one tick's jerk makes up for: acceleration, velocity, position.
    pub(crate) near: (Acceleration, Velocity, Position),
}

impl Limits {
    /// From the limits of speed, acceleration and jerk.
    ///
    /// # Errors
    /// Limits that do not fit each other or the tick.
    pub(crate) fn new(p: &Parameters, rig: &Rig) -> Result<Self, ConfigError> {
        let [speed, acceleration, jerk] =
            [p.servo_speed_m_per_s, p.servo_acceleration_m_per_s2, p.servo_jerk_m_per_s3].map(f64::from);
        let planned = rig.t.max(PLANNED_S);
        let natural = speed * jerk / (acceleration * acceleration);
        demand(
            natural <= 3.0 && planned * jerk <= 0.5 * acceleration,
            Key::servo_jerk_m_per_s3,
            jerk,
            "be at most 3 times the square of servo_acceleration_m_per_s2 over servo_speed_m_per_s, and at most half that \
             acceleration in a tick or a millisecond (metres per second cubed)",
        )?;
        let unit_m = acceleration * acceleration * acceleration / (jerk * jerk);
        demand(
            unit_m <= MOST_UNIT_M,
            Key::servo_jerk_m_per_s3,
            jerk,
            "be more, or servo_acceleration_m_per_s2 less: its cube over the square of the jerk must be at most 67 m (metres per second \
             cubed)",
        )?;
        Ok(Self {
            speed: fixed(natural),
            tick: fixed(planned * jerk / acceleration),
            length: Factor::new(jerk * jerk / (acceleration * acceleration * acceleration)),
            velocity: Factor::new(jerk / (acceleration * acceleration)),
            aim_jerk: Factor::new(1.0 / jerk),
            acceleration: Factor::new(1.0 / acceleration),
            jerk: Factor::new(acceleration / planned),
            near: (
                fixed(jerk * planned),
                fixed(jerk * planned * planned),
                fixed(NEAR_M + jerk * planned * planned * planned),
            ),
        })
    }
}

/// A point of the motion: position and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    pub(super) y_q44: i64,
    /// Velocity.
    pub v: Velocity,
    /// Acceleration.
    pub a: Acceleration,
}

/// The target as the reference follows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Aim {
    /// Where it is at the next tick.
    pub(crate) motion: Motion,
    /// Its jerk.
    pub(crate) jerk: Jerk,
    /// Part of the limits that its motion takes up, peaks of the last second included.
    pub(crate) used: Part,
    /// Whether it stands where the reference has not yet arrived.
    pub(crate) new: bool,
    /// Where it is now; where it stands, without what of it is noise.
    pub(crate) target: Position,
}

/// A point as the plan sees it: from the aim, in units of the limits, 26 fractional bits.
#[derive(Clone, Copy)]
struct Seen {
    y: i64,
    v: i32,
    a: i32,
}

/// [`CALM_JERK`] and [`RESERVE`] with 26 fractional bits.
const CALM: i32 = bits(CALM_JERK, 26);
const MORE: i32 = bits(RESERVE, 26);

/// A product with 26 fractional bits.
#[inline]
fn wide(a: i32, b: i32) -> i64 {
    (i64::from(a) * i64::from(b)) >> 26
}

/// The same where it is below 32.
#[inline]
fn times(a: i32, b: i32) -> i32 {
    wide(a, b) as i32
}

/// Stopping points looked at between the ends of the search for the jerk; one more secant follows unseen. What is left is made up
/// by the plan of the next tick.
const STEPS: u32 = 3;
/// Distance to the aim at which the search ends, 11 nm on the paper's case (a): shortly before the aim a micrometre is full jerk.
const NEAR: i32 = 8;

impl Motion {
    /// At rest.
    #[inline]
    pub(crate) fn at(y: Position) -> Self {
        Self { y_q44: i64::from(y.to_bits()) << FINE, v: Velocity::ZERO, a: Acceleration::ZERO }
    }

    /// The position.
    #[inline]
    #[must_use]
    pub fn position(&self) -> Position {
        Position::from_bits(saturate((self.y_q44 + (1 << (FINE - 1))) >> FINE))
    }

    /// Moves it.
    #[inline]
    pub(crate) fn shift(&mut self, by: Position) {
        self.set(self.y_q44 + (i64::from(by.to_bits()) << FINE));
    }

    #[inline]
    fn set(&mut self, y_q44: i64) {
        self.y_q44 = limit(y_q44, -(1 << 47), 1 << 47);
    }

    /// After a tick of constant jerk.
    #[inline]
    pub(crate) fn after(&self, jerk: Jerk, tick: &Tick) -> Self {
        let change: Acceleration = tick.change(jerk);
        let mean = Acceleration::from_bits(self.a.to_bits().saturating_add(change.to_bits() / 2));
        let gain: Velocity = tick.change(mean);
        // The jerk's own part of the way, T³ J / 12, is below a nanometre.
        let mean = i64::from(self.v.to_bits()) + i64::from(gain.to_bits() / 2);
        let mut next = *self;
        // 2^32 · 2^27 at most, as a tick is no longer than 2 ms.
        next.set(self.y_q44 + ((mean * i64::from(tick.q32)) >> 12));
        next.v = self.v.saturating_add(gain);
        next.a = self.a.saturating_add(change);
        next
    }

    /// The motion itself, or the `aim` once one tick's jerk makes up the difference: else it would go on around its aim.
    #[inline]
    pub(crate) fn arrived(&self, aim: &Self, limits: &Limits) -> Self {
        let (a, v, y) = limits.near;
        let near = self.a.saturating_sub(aim.a).saturating_abs() <= a
            && self.v.saturating_sub(aim.v).saturating_abs() <= v
            && self.from(aim).saturating_abs() <= y;
        if near { *aim } else { *self }
    }

    /// The way from `other` to here.
    #[inline]
    pub(crate) fn from(&self, other: &Self) -> Position {
        Position::from_bits(saturate((self.y_q44 - other.y_q44) >> FINE))
    }

    /// The jerk of the next tick on the way to the aim, planned as seen from it and with what its motion leaves of a part
    /// (at most one) of the limits.
    #[inline]
    pub(crate) fn jerk_towards(&self, aim: &Aim, limits: &Limits, part: I6F26) -> Jerk {
        if *self == aim.motion {
            return aim.jerk;
        }
        // Beyond these a motion is pushed back with all that the limits allow anyway.
        let within = |x: i64, most: i32| limit(x, -i64::from(most), i64::from(most)) as i32;
        let (speed, tick) = (limits.speed.to_bits(), limits.tick.to_bits());
        let part = part.to_bits();
        let left =
            |whole: i32, used: I6F26| times(part, whole - used.to_bits().saturating_abs().min(whole)).max(whole / 2);
        let still = aim.motion.v == 0 && aim.used == 0;
        let jerk = left(if aim.new { ONE } else { CALM }, limits.aim_jerk.of(aim.jerk));
        let most = left(ONE, limits.acceleration.of(aim.motion.a));
        let used = limits.velocity.of(aim.motion.v).to_bits().saturating_abs();
        let frame = Frame {
            speed: times(part, speed - used.min(speed)).max(speed / 10),
            most,
            jerk,
            back: if still { times(jerk, MORE) } else { jerk },
            per_most: inverse(most),
            per_jerk: inverse(jerk),
            tick,
            most_square: times(most, most),
        };
        let seen = Seen {
            y: limits.length.wide(self.from(&aim.motion)),
            v: within(limits.velocity.wide(self.v.saturating_sub(aim.motion.v)), 4 * ONE),
            a: within(limits.acceleration.wide(self.a.saturating_sub(aim.motion.a)), ONE + ONE / 2),
        };
        aim.jerk.saturating_add(limits.jerk.of(I6F26::from_bits(seen.change(&frame))))
    }
}

/// `1 / x` of a part of one.
#[inline]
fn inverse(x: i32) -> i32 {
    if x == ONE { ONE } else { quotient(ONE, x.unsigned_abs(), 26) }
}

/// The limits as seen from the aim, in the units of the limits, 26 fractional bits.
struct Frame {
    speed: i32,
    /// Of the acceleration, from a half to one, and its reciprocal: half of a limit is left by any moving aim and any valve.
    most: i32,
    per_most: i32,
    /// Of the jerk, likewise; from half of [`CALM`] on.
    jerk: i32,
    per_jerk: i32,
    /// Of the jerk while braking. More than the plan has: late by a little, the motion would otherwise pass its target.
    back: i32,
    tick: i32,
    /// Square of the acceleration's.
    most_square: i32,
}

impl Seen {
    /// After a tick in which the acceleration changes evenly to `a`.
    #[inline]
    fn after(&self, a: i32, half_tick: i32) -> Self {
        let v = self.v + times(self.a + a, half_tick);
        Self { y: self.y + i64::from(times(self.v + v, half_tick)), v, a }
    }

    /// Where the motion comes to rest if it brakes from now on within the limits.
    #[inline]
    fn stopping_point(&self, frame: &Frame) -> i64 {
        let &Frame { most, per_most, jerk, per_jerk, .. } = frame;
        // |a| <= 2 and |v| <= 5, the reciprocals at most 2.4: all below 32 but the sum of ways, which has 64 bits.
        let half_square = times(times(self.a, self.a) >> 1, per_jerk);
        // The speed left once the acceleration has gone to zero tells which way to brake.
        let left = self.v + if self.a < 0 { -half_square } else { half_square };
        let (v, a) = if left >= 0 { (self.v, self.a) } else { (-self.v, -self.a) };
        let squared = times((v + half_square).max(0), jerk);
        let full = squared >= frame.most_square;
        let peak = if full { most } else { root_q26(squared as u32) as i32 };
        let change = a + peak;
        let t_1 = times(change, per_jerk);
        let half_peak = times(times(peak, peak) >> 1, per_jerk);
        let v_1 = v + half_square - half_peak;
        let t_2 = if full { times((v_1 - half_peak).max(0), per_most) } else { 0 };
        let third = |x: i32| times(x, const { ONE / 3 });
        let way = wide(v + times((a - third(change)) >> 1, t_1), t_1)
            + wide((v_1 + half_peak) >> 1, t_2)
            + i64::from(third(times(times(half_peak, peak), per_jerk)));
        self.y + if left >= 0 { way } else { -way }
    }

    /// The change of acceleration in the next tick whose stopping point is the aim.
    #[inline]
    fn change(&self, frame: &Frame) -> i32 {
        let &Frame { speed, most, jerk, per_jerk, back, tick, .. } = frame;
        let half_tick = tick >> 1;
        let step = times(tick, jerk);
        let so_far = self.v + times(half_tick, self.a);
        // The acceleration after the tick is at most `a`, and at most that from which the speed limit is just reached. Towards
        // the other side the same with all signs changed. Going back to zero takes a tick at least: `a T / 2` of speed where that
        // is more than `a² / 2 J`. (Without that the acceleration changed its side each tick along the limit.)
        let below = |a: i32, room: i32| {
            let (size, distance) = (a.saturating_abs(), room.saturating_abs());
            let back = times(times(size, size) >> 1, per_jerk).max(times(half_tick, size));
            if times(half_tick, a) + if a < 0 { -back } else { back } <= room {
                return a;
            }
            let most = if distance <= times(tick, step) {
                quotient(distance, tick.unsigned_abs(), 26)
            } else {
                // Below 2 · 9 · 2.4 of 64.
                let twice = times(distance, per_jerk).unsigned_abs() << 1;
                times((root_q26(twice + times(half_tick, half_tick).unsigned_abs()) as i32) - half_tick, jerk)
            };
            if room < 0 { -most } else { most }
        };
        let returning = times(tick, back);
        let side = self.v.signum();
        let up = if side < 0 || (side > 0 && self.a < 0) { returning } else { step };
        let down = if side > 0 || (side < 0 && self.a > 0) { returning } else { step };
        let low = -below((down - self.a).min(most), speed + so_far);
        let high = below((self.a + up).min(most), speed - so_far);
        // Beyond a limit (it was pushed there), go back with full jerk.
        let mut low = low.min(self.a + up);
        let mut high = high.max(self.a - down).max(low);
        let beyond = |a: i32| saturate(self.after(a, half_tick).stopping_point(frame));
        let mut at_high = beyond(high);
        if at_high <= 0 {
            return high - self.a;
        }
        let mut at_low = beyond(low);
        if at_low >= 0 {
            return low - self.a;
        }
        // Regula falsi; an end that stays twice in a row counts half (Illinois).
        let mut side = 0_i32;
        let secant = |low: i32, at_low: i32, high: i32, at_high: i32| {
            let whole = (i64::from(at_high) - i64::from(at_low)) >> 1;
            low + times(high - low, quotient(-(at_low >> 1), whole as u32, 26))
        };
        for _ in 0..STEPS {
            let a = secant(low, at_low, high, at_high);
            let at = beyond(a);
            if at.saturating_abs() <= NEAR {
                return a - self.a;
            }
            if at > 0 {
                (high, at_high) = (a, at);
                at_low >>= u32::from(side > 0);
            } else {
                (low, at_low) = (a, at);
                at_high >>= u32::from(side < 0);
            }
            side = at;
        }
        secant(low, at_low, high, at_high) - self.a
    }
}
