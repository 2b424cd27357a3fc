//! The target as a motion: a streamed target gets a velocity and an acceleration, a step gets none.

use super::reference::{Limits, Motion};
use control::servo::constants::{
    CALM_JERK, DEAD_BAND_M, FOLLOWED, JERK_BANDWIDTH, LONGEST_HOLD_S, MOST_ACCELERATION, MOST_PER_CHANGE, NOT_FOLLOWED,
    PEAK_HELD_S, STREAM_BANDWIDTH,
};

/// Follows a target that arrives as positions only: anew each tick, or held for some by a slower sender; in codes, with noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stream {
    motion: Motion,
    jerk: f64,
    used: f64,
    /// The target at its last change.
    last: f64,
    /// Ticks since then.
    since: u32,
    /// Velocity by the last two changes; zero at rest.
    change_v: f64,
    /// Whether the target moves.
    moves: bool,
    /// Where the target was when it last left the dead band.
    anchor: f64,
    /// Ticks since then.
    quiet: u32,
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
    /// Where it is now; where it stands, without what of it is noise, m.
    pub target: f64,
}

impl Stream {
    /// A target that stands.
    #[must_use]
    pub fn at(target: f64) -> Self {
        Self { motion: Motion { y: target, ..Motion::default() }, last: target, anchor: target, ..Self::default() }
    }

    /// The reference has arrived.
    pub fn arrive(&mut self) {
        self.arrived = true;
    }

    fn stand(&mut self, target: f64) {
        (self.motion, self.jerk, self.used, self.moves) = (Motion { y: target, ..Motion::default() }, 0.0, 0.0, false);
    }

    /// Takes this tick's target and predicts it for the next.
    pub fn take(&mut self, target: f64, limits: &Limits, t: f64) -> Aim {
        let longest = (LONGEST_HOLD_S / t) as u32;
        (self.since, self.quiet) = (self.since.saturating_add(1), self.quiet.saturating_add(1));
        let leaves = (target - self.anchor).abs() > DEAD_BAND_M;
        if leaves {
            (self.anchor, self.quiet) = (target, 0);
        }
        // What the derivatives do not follow is a step.
        let fastest = STREAM_BANDWIDTH.min(MOST_PER_CHANGE / t);
        let allowed = limits.acceleration / (fastest * fastest);
        let h = f64::from(self.since) * t;
        let change = target - self.last;
        let changed = if self.moves { change != 0.0 } else { leaves };
        if self.moves {
            let off = target - self.motion.y;
            // A target that is held stays behind its own motion.
            let held = self.motion.v.abs() * h;
            if self.quiet > longest {
                self.stand(target);
            } else if off.abs() > allowed + held {
                self.arrived = false;
                self.stand(target);
                self.change_v = 0.0;
            } else if changed {
                let w = STREAM_BANDWIDTH.min(MOST_PER_CHANGE / h);
                let m = &mut self.motion;
                m.y += 3.0 * w * h * off;
                m.v += 3.0 * w * w * h * off;
                let most = MOST_ACCELERATION * limits.acceleration;
                m.a = (m.a + w * w * w * h * off).clamp(-most, most);
                self.jerk += (JERK_BANDWIDTH * h).min(1.0) * (w * w * w * off - self.jerk);
            }
        } else if changed {
            let again = self.since <= longest && self.change_v != 0.0;
            if again && (change - self.change_v * h).abs() <= allowed {
                (self.moves, self.motion) = (true, Motion { y: target, v: change / h, a: 0.0 });
            } else {
                self.arrived = false;
                self.stand(target);
            }
            self.change_v = if self.since <= longest { change / h } else { 0.0 };
        }
        if changed {
            (self.last, self.since) = (target, 0);
        }
        self.motion = self.motion.after(0.0, t);
        // What the rig cannot follow is a row of targets without motion: else the reference, planned as seen from a target
        // that itself uses up the limits, would swing beyond it.
        let Motion { y, v, a } = self.motion;
        let used = (FOLLOWED * v.abs() / limits.speed)
            .max(a.abs() / limits.acceleration)
            .max(self.jerk.abs() / (CALM_JERK * limits.jerk));
        // The peaks count: acceleration and jerk of a sine come in turn.
        self.used = used.max(self.used - t / PEAK_HELD_S * self.used);
        self.arrived |= self.used > 0.0;
        let followed = ((NOT_FOLLOWED - self.used) / (NOT_FOLLOWED - FOLLOWED)).clamp(0.0, 1.0);
        Aim {
            motion: Motion { y, v: followed * v, a: followed * a },
            jerk: followed * self.jerk,
            used: self.used,
            new: !self.arrived,
            target: if self.moves { target } else { self.motion.y },
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
