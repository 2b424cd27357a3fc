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

    /// The jerk of the next tick on the way to `aim`, planned as seen from it.
    #[inline]
    pub(crate) fn jerk_towards(&self, aim: &Self, limits: &Limits) -> Jerk {
        // Beyond these a motion is pushed back with all that the limits allow anyway.
        let within = |x: i64, most: i32| limit(x, -i64::from(most), i64::from(most)) as i32;
        let aim_v = limits.velocity.of(aim.v).to_bits().saturating_abs();
        let speed = limits.speed.to_bits() - aim_v.min(limits.speed.to_bits() / 2);
        let seen = Seen {
            y: limits.length.wide(self.from(aim)),
            v: within(limits.velocity.wide(self.v.saturating_sub(aim.v)), 4 * ONE),
            a: within(limits.acceleration.wide(self.a.saturating_sub(aim.a)), 2 * ONE),
        };
        let change = seen.change(speed, limits.tick.to_bits());
        limits.jerk.of(I6F26::from_bits(change))
    }
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
    fn stopping_point(&self) -> i64 {
        // |v| <= 6 and |a| <= 3: nothing below leaves 64 bits, and only sums of ways leave 32.
        let half_square = times(i64::from(self.a), self.a) / 2;
        // The speed left once the acceleration has gone to zero tells which way to brake.
        let left = i64::from(self.v) + if self.a < 0 { -half_square } else { half_square };
        let (v, a) = if left >= 0 { (self.v, self.a) } else { (-self.v, -self.a) };
        let squared = (i64::from(v) + half_square).max(0);
        let peak = if squared >= i64::from(ONE) { ONE } else { root_q26(squared as u32) as i32 };
        let t_1 = a + peak;
        let half_peak = times(i64::from(peak), peak) / 2;
        let v_1 = i64::from(v) + half_square - half_peak;
        let t_2 = if peak < ONE { 0 } else { (v_1 - half_peak).max(0) };
        let sixth = |x: i32| times(i64::from(x), const { ONE / 6 });
        let way = times(i64::from(v) + times(i64::from(a / 2) - sixth(t_1), t_1), t_1)
            + times((v_1 + half_peak) / 2, t_2 as i32)
            + times(half_peak / 3, peak);
        self.y + if left >= 0 { way } else { -way }
    }

    /// The change of acceleration in the next tick whose stopping point is the aim.
    #[inline]
    fn change(&self, speed: i32, tick: i32) -> i32 {
        // The acceleration after the tick from which the speed limit is just reached, either way.
        let half_tick = tick / 2;
        let quarter = times(i64::from(half_tick), half_tick) as i32;
        let to_speed = |speed: i32| {
            let room = speed - self.v - times(i64::from(half_tick), self.a) as i32;
            let root = root_q26(quarter.saturating_add(room.saturating_abs().saturating_mul(2)).unsigned_abs()) as i32;
            if room < 0 { half_tick - root } else { root - half_tick }
        };
        let low = (self.a - tick).max(to_speed(-speed).max(-ONE));
        let high = (self.a + tick).min(to_speed(speed).min(ONE));
        // Beyond a limit (it was pushed there), go back with full jerk.
        let mut low = low.min(self.a + tick);
        let mut high = high.max(self.a - tick).max(low);
        let beyond = |a: i32| saturate(self.after(a, tick).stopping_point());
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
