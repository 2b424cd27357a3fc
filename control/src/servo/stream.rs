//! The target as a motion: a streamed target gets a velocity, an acceleration and a jerk, a step gets none.

use super::constants::{
    CALM_JERK, DEAD_BAND_M, FOLLOWED, JERK_BANDWIDTH, LONGEST_HOLD_S, MOST_ACCELERATION, MOST_PER_CHANGE, NOT_FOLLOWED,
    PEAK_HELD_S, STREAM_BANDWIDTH,
};
use super::factor::{Factor, Share, quotient};
use super::reference::{Aim, Motion};
use super::rig::Rig;
use super::{Acceleration, Jerk, Part, Ratio, Tick};
use crate::arithmetic::{fixed, limit, multiply, product};
use crate::parameters::Parameters;
use crate::quantities::{Position, Velocity};
use fixed::traits::Fixed;

/// Constants of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StreamGains {
    /// A standing target that changes by no more is the same.
    pub(crate) dead_band: Position,
    /// Ticks after which a target within the dead band stands.
    pub(crate) longest_hold: u16,
    /// Ticks between changes of the target up to which its derivatives follow with the whole bandwidth `w`.
    pub(crate) whole: u16,
    /// Distance to the target at which the derivatives do not follow any more, beyond what it moves while it is held.
    pub(crate) off: Position,
    /// Largest acceleration of a stream.
    pub(crate) acceleration: Acceleration,
    /// `1 / T`.
    pub(crate) per_tick: Factor<Position, Velocity>,
    /// `3 w h`, with `h` the time of `whole` ticks.
    pub(crate) y: Factor<Position, Position>,
    /// `3 w² h`.
    pub(crate) v: Factor<Position, Velocity>,
    /// `w³ h`.
    pub(crate) a: Factor<Position, Acceleration>,
    /// `w³`.
    pub(crate) jerk: Factor<Position, Jerk>,
    /// How fast the jerk follows, per tick.
    pub(crate) jerk_follow: Share<Jerk, Jerk>,
    /// What part of the limits velocity, acceleration and jerk take up.
    pub(crate) used: (Factor<Velocity, Part>, Factor<Acceleration, Part>, Factor<Jerk, Part>),
    /// How fast a peak of it is forgotten, per tick.
    pub(crate) forget: Share<Part, Part>,
    /// Part of the limits at which a target's own derivatives are not followed any more.
    pub(crate) lost: Part,
    /// Part up to which they are followed in full.
    pub(crate) followed_part: Part,
    /// From what is left until then to the part of the derivatives that is followed.
    pub(crate) followed: Factor<Part, Part>,
}

impl StreamGains {
    /// Beside a reference within limits of speed, acceleration and jerk.
    pub(crate) fn new(p: &Parameters, rig: &Rig) -> Self {
        let [speed, acceleration, jerk] =
            [p.servo_speed_m_per_s, p.servo_acceleration_m_per_s2, p.servo_jerk_m_per_s3].map(f64::from);
        let t = rig.t;
        let whole = rig.ticks(MOST_PER_CHANGE / STREAM_BANDWIDTH).max(1);
        let whole_s = f64::from(whole) * t;
        let w = STREAM_BANDWIDTH.min(MOST_PER_CHANGE / whole_s);
        Self {
            dead_band: fixed(DEAD_BAND_M),
            longest_hold: rig.ticks(LONGEST_HOLD_S),
            whole,
            off: fixed(acceleration / (w * w)),
            acceleration: fixed(MOST_ACCELERATION * acceleration),
            per_tick: Factor::new(rig.hz),
            y: Factor::new(3.0 * w * whole_s),
            v: Factor::new(3.0 * w * w * whole_s),
            a: Factor::new(w * w * w * whole_s),
            jerk: Factor::new(w * w * w),
            jerk_follow: Share::new((JERK_BANDWIDTH * t).min(1.0)),
            used: (
                Factor::new(FOLLOWED / speed),
                Factor::new(1.0 / acceleration),
                Factor::new(1.0 / (CALM_JERK * jerk)),
            ),
            forget: Share::new(t / PEAK_HELD_S),
            lost: fixed(NOT_FOLLOWED),
            followed_part: fixed(FOLLOWED),
            followed: Factor::new(1.0 / (NOT_FOLLOWED - FOLLOWED)),
        }
    }
}

/// Follows a target that arrives as positions only: anew each tick or held for some by a slower sender, in codes, with noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stream {
    motion: Motion,
    jerk: Jerk,
    used: Part,
    /// The target at its last change, while it moves.
    last: Position,
    /// Where the target was when it last left the dead band.
    anchor: Position,
    /// Velocity by the last change; zero where it had stood before.
    change_v: Velocity,
    /// Ticks since the last change.
    since: u16,
    /// Ticks since the target left the dead band.
    quiet: u16,
    moves: bool,
    arrived: bool,
}

impl Stream {
    /// A target that stands.
    pub(crate) fn at(target: Position) -> Self {
        Self { motion: Motion::at(target), last: target, anchor: target, ..Self::default() }
    }

    /// The reference has arrived.
    #[inline]
    pub(crate) fn arrive(&mut self) {
        self.arrived = true;
    }

    #[inline]
    fn stand(&mut self, target: Position) {
        (self.motion, self.jerk, self.used, self.moves) = (Motion::at(target), Jerk::ZERO, Part::ZERO, false);
    }

    /// Takes this tick's target and predicts it for the next.
    #[inline]
    pub(crate) fn take(&mut self, target: Position, gains: &StreamGains, tick: &Tick) -> Aim {
        (self.since, self.quiet) = (self.since.saturating_add(1), self.quiet.saturating_add(1));
        if target.saturating_sub(self.anchor).saturating_abs() > gains.dead_band {
            (self.anchor, self.quiet) = (target, 0);
        }
        // Ticks since the last change. Held for longer a target stands.
        let n = i32::from(self.since.min(gains.longest_hold));
        let change = target.saturating_sub(self.last);
        let changed = if self.moves { change != 0 } else { self.quiet == 0 };
        let travelled = |v: Velocity| tick.change::<_, Position>(v).saturating_mul_int(n);
        if self.moves {
            let off = target.saturating_sub(self.motion.position());
            // A target that is held stays behind its own motion. What the derivatives do not follow is a step.
            let held = travelled(self.motion.v.saturating_abs());
            if self.quiet > gains.longest_hold {
                self.stand(target);
            } else if off.saturating_abs() > gains.off.saturating_add(held) {
                (self.arrived, self.change_v) = (false, Velocity::ZERO);
                self.stand(target);
            } else if changed {
                self.follow(off, n, gains);
            }
        } else if changed {
            let before = self.change_v;
            let again = self.since <= gains.longest_hold;
            let v = Velocity::from_bits(gains.per_tick.of(change).to_bits() / n.max(1));
            self.change_v = if again { v } else { Velocity::ZERO };
            if again && before != 0 && change.saturating_sub(travelled(before)).saturating_abs() <= gains.off {
                (self.moves, self.motion) = (true, Motion { v, ..Motion::at(target) });
            } else {
                self.arrived = false;
                self.stand(target);
            }
        }
        if changed {
            (self.last, self.since) = (target, 0);
        }
        self.motion = self.motion.after(Jerk::ZERO, tick);
        // What the rig cannot follow is a row of targets without motion: else the reference, planned as seen from a target
        // that itself uses up the limits, would swing beyond it.
        let Motion { v, a, .. } = self.motion;
        let (per_v, per_a, per_jerk) = gains.used;
        let used =
            per_v.of(v.saturating_abs()).max(per_a.of(a.saturating_abs())).max(per_jerk.of(self.jerk.saturating_abs()));
        // The peaks count: acceleration and jerk of a sine come in turn.
        self.used = used.max(self.used.saturating_sub(gains.forget.of(self.used)));
        self.arrived |= self.used > 0;
        let followed = limit(gains.followed.of(gains.lost.saturating_sub(self.used)), Part::ZERO, Part::ONE);
        Aim {
            motion: Motion { v: part_of(v, followed), a: part_of(a, followed), ..self.motion },
            jerk: part_of(self.jerk, followed),
            used: self.used,
            new: !self.arrived,
            target: if self.moves { target } else { self.motion.position() },
        }
    }

    /// Corrects the motion by a target that is `off` it, `n` ticks after the one before: with a bandwidth that falls as a slow sender's
    /// interval grows.
    #[inline]
    fn follow(&mut self, off: Position, n: i32, gains: &StreamGains) {
        let (n, whole) = (n.max(1), i32::from(gains.whole));
        let per = |a: i32, b: i32| Ratio::from_bits(quotient(a.min(b), b.unsigned_abs(), Ratio::FRAC_NBITS));
        let (time, slower) = (per(n, whole), per(whole, n));
        let m = &mut self.motion;
        m.shift(product(gains.y.of(off), time));
        let time: Ratio = product(time, slower);
        m.v = m.v.saturating_add(product(gains.v.of(off), time));
        let a = m.a.saturating_add(product(gains.a.of(off), product::<_, _, Ratio>(time, slower)));
        m.a = limit(a, -gains.acceleration, gains.acceleration);
        let jerk: Jerk =
            product(gains.jerk.of(off), product::<_, _, Ratio>(product::<_, _, Ratio>(slower, slower), slower));
        let follow = gains.jerk_follow.of(jerk.saturating_sub(self.jerk));
        self.jerk = self.jerk.saturating_add(follow.saturating_mul_int(n));
    }
}

/// A part of a quantity.
#[inline]
fn part_of<T: Fixed<Bits = i32>>(x: T, part: Part) -> T {
    T::from_bits(multiply(x.to_bits(), part.to_bits(), Part::FRAC_NBITS))
}
