//! The target as a motion: a streamed target gets a velocity, an acceleration and a jerk, a step gets none.

use super::factor::{Factor, Share};
use super::reference::{Aim, Motion};
use super::{Acceleration, Jerk, Part, Tick};
use crate::arithmetic::{limit, multiply};
use crate::quantities::{Position, Velocity};
use fixed::traits::Fixed;

/// Constants of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StreamGains {
    /// Largest change of the target's velocity that is not a step, times the tick.
    pub(crate) smooth: Position,
    /// Distance to the target at which the derivatives do not follow any more.
    pub(crate) off: Position,
    /// Largest acceleration of a stream.
    pub(crate) acceleration: Acceleration,
    /// `1 / T`.
    pub(crate) per_tick: Factor<Position, Velocity>,
    /// `3 w T`.
    pub(crate) y: Share<Position, Position>,
    /// `3 w² T`.
    pub(crate) v: Factor<Position, Velocity>,
    /// `w³ T`.
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

/// Follows a target that arrives as positions only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stream {
    motion: Motion,
    jerk: Jerk,
    used: Part,
    last: Position,
    last_change: Position,
    arrived: bool,
}

impl Stream {
    /// A target that stands.
    pub(crate) fn at(target: Position) -> Self {
        Self { motion: Motion::at(target), last: target, ..Self::default() }
    }

    /// The reference has arrived.
    #[inline]
    pub(crate) fn arrive(&mut self) {
        self.arrived = true;
    }

    /// Takes this tick's target and predicts it for the next. A change of the target's velocity beyond the limit is a step.
    #[inline]
    pub(crate) fn take(&mut self, target: Position, gains: &StreamGains, tick: &Tick) -> Aim {
        let change = target.saturating_sub(self.last);
        let smooth = change.saturating_sub(self.last_change).saturating_abs() <= gains.smooth;
        let off = target.saturating_sub(self.motion.position());
        let moving = |used| (Motion { v: gains.per_tick.of(change), ..Motion::at(target) }, Jerk::ZERO, used);
        self.arrived &= smooth;
        if !smooth || (change == 0 && self.last_change == 0) {
            (self.motion, self.jerk, self.used) = (Motion::at(target), Jerk::ZERO, Part::ZERO);
        } else if self.motion.v == 0 {
            // It has just begun to move.
            (self.motion, self.jerk, self.used) = moving(Part::ZERO);
        } else if off.saturating_abs() > gains.off {
            // It moves faster than the derivatives follow.
            (self.motion, self.jerk, self.used) = moving(Part::ONE);
        } else {
            let m = &mut self.motion;
            m.shift(gains.y.of(off));
            m.v = m.v.saturating_add(gains.v.of(off));
            m.a = limit(m.a.saturating_add(gains.a.of(off)), -gains.acceleration, gains.acceleration);
            let follow = gains.jerk_follow.of(gains.jerk.of(off).saturating_sub(self.jerk));
            self.jerk = self.jerk.saturating_add(follow);
        }
        (self.last, self.last_change) = (target, change);
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
        }
    }
}

/// A part of a quantity.
#[inline]
fn part_of<T: Fixed<Bits = i32>>(x: T, part: Part) -> T {
    T::from_bits(multiply(x.to_bits(), part.to_bits(), Part::FRAC_NBITS))
}
