//! The reference: a target becomes a motion within limits of speed, acceleration and jerk, planned anew each tick.
//!
//! Nothing of a plan is stored. Each tick asks where the motion would stop if it braked from now on, and picks the
//! jerk whose stopping point is the target. So a new target in mid-move, or a motion that was taken back because the
//! valve could not follow, needs no case of its own.
//!
//! The plan is made in units in which the limits `A` of acceleration and `J` of jerk are one: time `A/J`, speed `A²/J`,
//! length `A³/J²`. Then stopping takes no division, and every rig uses the same range of numbers. They have 26 fractional
//! bits and end at ±32: a target farther away is as good as one there.

use super::factor::{Factor, quotient, root_q26};
use super::stream::Aim;
use super::{Acceleration, Jerk, Tick};
use crate::arithmetic::{limit, saturate};
use crate::quantities::{Position, Velocity};
use fixed::types::I6F26;

/// Fractional bits of a motion's own position: at 20,000 ticks a second slow motion is less than a bit of [`Position`] a tick.
const FINE: u32 = 44 - Position::FRAC_NBITS;
const ONE: i32 = 1 << 26;

/// Limits of the motion, and how to convert to units in which they are one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Limits {
    /// Highest speed, in those units.
    pub(crate) speed: I6F26,
    /// The tick, in those units.
    pub(crate) tick: I6F26,
    /// To their length.
    pub(crate) length: Factor<Position, I6F26>,
    /// To their speed.
    pub(crate) velocity: Factor<Velocity, I6F26>,
    /// To their acceleration.
    pub(crate) acceleration: Factor<Acceleration, I6F26>,
    /// To their jerk.
    pub(crate) aim_jerk: Factor<Jerk, I6F26>,
    /// From a change of acceleration in a tick to the jerk.
    pub(crate) jerk: Factor<I6F26, Jerk>,
    /// What one tick's jerk makes up for: acceleration, velocity, position.
    pub(crate) near: (Acceleration, Velocity, Position),
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

/// A point as the plan sees it: from the aim, in units of the limits, 26 fractional bits.
#[derive(Clone, Copy)]
struct Seen {
    y: i64,
    v: i32,
    a: i32,
}

/// A product with 26 fractional bits.
#[inline]
fn times(a: i64, b: i32) -> i64 {
    (a * i64::from(b)) >> 26
}

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
        let change = tick.jerk.of(jerk);
        let mean = Acceleration::from_bits(self.a.to_bits().saturating_add(change.to_bits() / 2));
        let gain = tick.acceleration.of(mean);
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

    /// The jerk of the next tick on the way to the aim, planned as seen from it and with the limits that its motion leaves.
    #[inline]
    pub(crate) fn jerk_towards(&self, aim: &Aim, limits: &Limits) -> Jerk {
        // Beyond these a motion is pushed back with all that the limits allow anyway.
        let within = |x: i64, most: i32| limit(x, -i64::from(most), i64::from(most)) as i32;
        let (speed, tick) = (limits.speed.to_bits(), limits.tick.to_bits());
        let left = |used: I6F26| (ONE - used.to_bits().saturating_abs().min(ONE)).max(LEAST_LEFT);
        let jerk = left(limits.aim_jerk.of(aim.jerk));
        let most = left(limits.acceleration.of(aim.motion.a));
        let used = limits.velocity.of(aim.motion.v).to_bits().saturating_abs();
        let frame = Frame {
            speed: (speed - used.min(speed)).max(speed / 10),
            most,
            jerk,
            per_most: inverse(most),
            per_jerk: inverse(jerk),
            tick,
        };
        let seen = Seen {
            y: limits.length.wide(self.from(&aim.motion)),
            v: within(limits.velocity.wide(self.v.saturating_sub(aim.motion.v)), 4 * ONE),
            a: within(limits.acceleration.wide(self.a.saturating_sub(aim.motion.a)), 2 * ONE),
        };
        aim.jerk.saturating_add(limits.jerk.of(I6F26::from_bits(seen.change(&frame))))
    }
}

/// The least that a moving aim leaves of a limit.
const LEAST_LEFT: i32 = ONE / 4;

/// `1 / x` of a part of one.
#[inline]
fn inverse(x: i32) -> i32 {
    if x == ONE { ONE } else { quotient(ONE, x.unsigned_abs(), 26) }
}

/// The limits as seen from the aim, in the units of the limits, 26 fractional bits.
struct Frame {
    speed: i32,
    /// Of the acceleration, from [`LEAST_LEFT`] to one, and its reciprocal.
    most: i32,
    per_most: i32,
    /// Of the jerk, likewise.
    jerk: i32,
    per_jerk: i32,
    tick: i32,
}

impl Seen {
    /// After a tick in which the acceleration changes evenly to `a`.
    #[inline]
    fn after(&self, a: i32, tick: i32) -> Self {
        let v = self.v + times(i64::from(self.a) + i64::from(a), tick / 2) as i32;
        Self { y: self.y + times(i64::from(self.v) + i64::from(v), tick / 2), v, a }
    }

    /// Where the motion comes to rest if it brakes from now on within the limits.
    #[inline]
    fn stopping_point(&self, frame: &Frame) -> i64 {
        let &Frame { most, per_most, jerk, per_jerk, .. } = frame;
        // |v| <= 6 and |a| <= 3, the reciprocals at most 4: nothing below leaves 64 bits, and only sums of ways leave 32.
        let half_square = times(times(i64::from(self.a), self.a) / 2, per_jerk);
        // The speed left once the acceleration has gone to zero tells which way to brake.
        let left = i64::from(self.v) + if self.a < 0 { -half_square } else { half_square };
        let (v, a) = if left >= 0 { (self.v, self.a) } else { (-self.v, -self.a) };
        let squared = times((i64::from(v) + half_square).max(0), jerk);
        let full = squared >= times(i64::from(most), most);
        let peak = if full { most } else { root_q26(squared as u32) as i32 };
        let change = a + peak;
        let t_1 = times(i64::from(change), per_jerk) as i32;
        let half_peak = times(times(i64::from(peak), peak) / 2, per_jerk);
        let v_1 = i64::from(v) + half_square - half_peak;
        let t_2 = if full { times((v_1 - half_peak).max(0), per_most) as i32 } else { 0 };
        let third = |x: i64| times(x, const { ONE / 3 });
        let way = times(i64::from(v) + times((i64::from(a) - third(i64::from(change))) / 2, t_1), t_1)
            + times((v_1 + half_peak) / 2, t_2)
            + third(times(times(half_peak, peak), per_jerk));
        self.y + if left >= 0 { way } else { -way }
    }

    /// The change of acceleration in the next tick whose stopping point is the aim.
    #[inline]
    fn change(&self, frame: &Frame) -> i32 {
        let &Frame { speed, most, jerk, per_jerk, tick, .. } = frame;
        // The acceleration after the tick from which the speed limit is just reached, either way.
        let half_tick = tick / 2;
        let quarter = times(i64::from(half_tick), half_tick) as i32;
        let to_speed = |speed: i32| {
            let room = speed - self.v - times(i64::from(half_tick), self.a) as i32;
            let twice = saturate(times(2 * i64::from(room).abs(), per_jerk));
            let root =
                times(i64::from(root_q26(quarter.saturating_add(twice).unsigned_abs())) - i64::from(half_tick), jerk);
            if room < 0 { -root as i32 } else { root as i32 }
        };
        let step = times(i64::from(tick), jerk) as i32;
        let low = (self.a - step).max(to_speed(-speed).max(-most));
        let high = (self.a + step).min(to_speed(speed).min(most));
        // Beyond a limit (it was pushed there), go back with full jerk.
        let mut low = low.min(self.a + step);
        let mut high = high.max(self.a - step).max(low);
        let beyond = |a: i32| saturate(self.after(a, tick).stopping_point(frame));
        let (mut at_low, mut at_high) = (beyond(low), beyond(high));
        if at_high <= 0 {
            return high - self.a;
        }
        if at_low >= 0 {
            return low - self.a;
        }
        // Regula falsi with halved ends (Illinois). at_low < 0 < at_high.
        let mut a = low;
        for _ in 0..6 {
            let whole = (i64::from(at_high) - i64::from(at_low)) >> 1;
            let part = quotient(-(at_low >> 1), whole as u32, 26);
            a = low + times(i64::from(high - low), part) as i32;
            let at = beyond(a);
            if at.saturating_abs() <= 1 {
                break;
            }
            if at > 0 {
                (high, at_high) = (a, at);
                at_low /= 2;
            } else {
                (low, at_low) = (a, at);
                at_high /= 2;
            }
        }
        a - self.a
    }
}
