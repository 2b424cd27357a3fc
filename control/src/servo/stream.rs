//! The target as a motion: a streamed target gets a velocity and an acceleration, a step gets none.

use super::factor::Factor;
use super::reference::Motion;
use super::{Acceleration, Tick};
use crate::arithmetic::limit;
use crate::quantities::{Position, Velocity};

/// Constants of the stream.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StreamGains {
    /// Largest change of the target's velocity that is not a step, times the tick.
    pub(crate) smooth: Position,
    /// Largest acceleration of a stream.
    pub(crate) acceleration: Acceleration,
    /// `1 / T`.
    pub(crate) per_tick: Factor<Position, Velocity>,
    /// `3 w T`.
    pub(crate) y: Factor<Position, Position>,
    /// `3 w² T`.
    pub(crate) v: Factor<Position, Velocity>,
    /// `w³ T`.
    pub(crate) a: Factor<Position, Acceleration>,
}

/// Follows a target that arrives as positions only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stream {
    motion: Motion,
    last: Position,
    last_change: Position,
}

impl Stream {
    /// A target that stands.
    pub(crate) fn at(target: Position) -> Self {
        Self { motion: Motion::at(target), last: target, last_change: Position::ZERO }
    }

    /// Takes this tick's target and predicts it for the next. A change of the target's velocity beyond the limit is a step.
    #[inline]
    pub(crate) fn take(&mut self, target: Position, gains: &StreamGains, tick: &Tick) -> Motion {
        let change = target.saturating_sub(self.last);
        let smooth = change.saturating_sub(self.last_change).saturating_abs() <= gains.smooth;
        let off = target.saturating_sub(self.motion.position());
        if !smooth || (change == 0 && self.last_change == 0) {
            self.motion = Motion::at(target);
        } else if off.saturating_abs() > gains.smooth.saturating_add(gains.smooth) {
            self.motion = Motion { v: gains.per_tick.of(change), ..Motion::at(target) };
        } else {
            let m = &mut self.motion;
            m.shift(gains.y.of(off));
            m.v = m.v.saturating_add(gains.v.of(off));
            m.a = limit(m.a.saturating_add(gains.a.of(off)), -gains.acceleration, gains.acceleration);
        }
        (self.last, self.last_change) = (target, change);
        self.motion = self.motion.after(super::Jerk::ZERO, tick);
        self.motion
    }
}
