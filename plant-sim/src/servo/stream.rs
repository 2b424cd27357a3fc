//! The target as a motion: a streamed target gets a velocity and an acceleration, a step gets none.

use super::reference::{CALM_JERK, Limits, Motion};

/// Follows a target that arrives as positions only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stream {
    motion: Motion,
    jerk: f64,
    used: f64,
    last: f64,
    last_change: f64,
    arrived: bool,
}

/// The target as the reference follows it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Aim {
    /// Where it is at the next tick.
    pub motion: Motion,
    /// Its jerk, m/s3.
    pub jerk: f64,
    /// Part of the limits that its motion takes up, peaks of the last second included.
    pub used: f64,
    /// Whether it stands where the reference has not yet arrived.
    pub new: bool,
}

/// Bandwidth with which the derivatives follow, rad/s.
const BANDWIDTH: f64 = 150.0;
/// Bandwidth of the jerk, rad/s: one fifth, for it is the third derivative of a target that may come in codes.
const JERK_BANDWIDTH: f64 = 30.0;
/// Part of the limits that a target's own motion may take up and still be followed with all its derivatives; at
/// `LOST_PART` none is left.
pub const FOLLOWED_PART: f64 = 0.25;
const LOST_PART: f64 = 0.4;
/// How long a peak of that part counts, s: about a period of the slowest sine that takes up so much.
const PEAK_HELD_S: f64 = 1.0;

impl Stream {
    /// A target that stands.
    #[must_use]
    pub fn at(target: f64) -> Self {
        Self { motion: Motion { y: target, ..Motion::default() }, last: target, ..Self::default() }
    }

    /// The reference has arrived.
    pub fn arrive(&mut self) {
        self.arrived = true;
    }

    /// Takes this tick's target and predicts it for the next. A change of the target's velocity by more than four times
    /// what the acceleration limit allows is a step.
    pub fn take(&mut self, target: f64, limits: &Limits, t: f64) -> Aim {
        let change = target - self.last;
        let allowed = 4.0 * limits.acceleration * t * t;
        let smooth = (change - self.last_change).abs() <= allowed;
        let off = target - self.motion.y;
        self.arrived &= smooth;
        if !smooth || change == 0.0 && self.last_change == 0.0 {
            (self.motion, self.jerk, self.used) = (Motion { y: target, ..Motion::default() }, 0.0, 0.0);
        } else if self.motion.v == 0.0 {
            // It has just begun to move.
            (self.motion, self.jerk, self.used) = (Motion { y: target, v: change / t, a: 0.0 }, 0.0, 0.0);
        } else if off.abs() > limits.acceleration / (BANDWIDTH * BANDWIDTH) {
            // It moves faster than the derivatives follow.
            (self.motion, self.jerk, self.used) = (Motion { y: target, v: change / t, a: 0.0 }, 0.0, 1.0);
        } else {
            let (w, m) = (BANDWIDTH, &mut self.motion);
            m.y += 3.0 * w * t * off;
            m.v += 3.0 * w * w * t * off;
            m.a = (m.a + w * w * w * t * off).clamp(-4.0 * limits.acceleration, 4.0 * limits.acceleration);
            self.jerk += (JERK_BANDWIDTH * t).min(1.0) * (w * w * w * off - self.jerk);
        }
        (self.last, self.last_change) = (target, change);
        self.motion = self.motion.after(0.0, t);
        // What the rig cannot follow is a row of targets without motion: else the reference, planned as seen from a target
        // that itself uses up the limits, would swing beyond it.
        let Motion { y, v, a } = self.motion;
        let used = (FOLLOWED_PART * v.abs() / limits.speed)
            .max(a.abs() / limits.acceleration)
            .max(self.jerk.abs() / (CALM_JERK * limits.jerk));
        // The peaks count: acceleration and jerk of a sine come in turn.
        self.used = used.max(self.used - t / PEAK_HELD_S * self.used);
        self.arrived |= self.used > 0.0;
        let followed = ((LOST_PART - self.used) / (LOST_PART - FOLLOWED_PART)).clamp(0.0, 1.0);
        Aim {
            motion: Motion { y, v: followed * v, a: followed * a },
            jerk: followed * self.jerk,
            used: self.used,
            new: !self.arrived,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits { speed: 1.4, acceleration: 10.0, jerk: 80.0 };

    #[test]
    fn a_step_has_no_velocity_and_a_sine_has_its_own() {
        let mut stream = Stream::at(0.0);
        for _ in 0..5 {
            assert_eq!(stream.take(0.045, &LIMITS, 1e-3).motion, Motion { y: 0.045, v: 0.0, a: 0.0 });
        }
        let mut stream = Stream::at(0.0);
        let w = std::f64::consts::PI;
        for tick in 0..2000 {
            let (now, next) = (f64::from(tick) * 1e-3, f64::from(tick + 1) * 1e-3);
            let motion = stream.take(0.05 * (w * now).sin(), &LIMITS, 1e-3).motion;
            if tick > 200 {
                assert!((motion.y - 0.05 * (w * next).sin()).abs() < 2e-6, "{motion:?} at {next}");
                assert!((motion.v - 0.05 * w * (w * next).cos()).abs() < 2e-3, "{motion:?} at {next}");
            }
        }
    }
}
