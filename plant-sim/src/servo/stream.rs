//! The target as a motion: a streamed target gets a velocity and an acceleration, a step gets none.

use super::reference::Motion;

/// Follows a target that arrives as positions only.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stream {
    /// The target with its derivatives.
    pub motion: Motion,
    last: f64,
    last_change: f64,
}

/// Bandwidth with which the derivatives follow, rad/s.
const BANDWIDTH: f64 = 150.0;

impl Stream {
    /// A target that stands.
    #[must_use]
    pub fn at(target: f64) -> Self {
        Self { motion: Motion { y: target, ..Motion::default() }, last: target, last_change: 0.0 }
    }

    /// Takes this tick's target and predicts it for the next. A change of the target's velocity by more than
    /// `acceleration` allows is a step.
    pub fn take(&mut self, target: f64, acceleration: f64, t: f64) -> Motion {
        let change = target - self.last;
        let allowed = acceleration * t * t;
        let smooth = (change - self.last_change).abs() <= allowed;
        let off = target - self.motion.y;
        if !smooth || change == 0.0 && self.last_change == 0.0 {
            self.motion = Motion { y: target, ..Motion::default() };
        } else if off.abs() > 2.0 * allowed {
            self.motion = Motion { y: target, v: change / t, a: 0.0 };
        } else {
            let (w, m) = (BANDWIDTH, &mut self.motion);
            m.y += 3.0 * w * t * off;
            m.v += 3.0 * w * w * t * off;
            m.a = (m.a + w * w * w * t * off).clamp(-acceleration, acceleration);
        }
        (self.last, self.last_change) = (target, change);
        self.motion = self.motion.after(0.0, t);
        self.motion
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_has_no_velocity_and_a_sine_has_its_own() {
        let mut stream = Stream::at(0.0);
        for _ in 0..5 {
            assert_eq!(stream.take(0.045, 8.0, 1e-3), Motion { y: 0.045, v: 0.0, a: 0.0 });
        }
        let mut stream = Stream::at(0.0);
        let w = std::f64::consts::PI;
        for tick in 0..2000 {
            let (now, next) = (f64::from(tick) * 1e-3, f64::from(tick + 1) * 1e-3);
            let motion = stream.take(0.05 * (w * now).sin(), 8.0, 1e-3);
            if tick > 200 {
                assert!((motion.y - 0.05 * (w * next).sin()).abs() < 2e-6, "{motion:?} at {next}");
                assert!((motion.v - 0.05 * w * (w * next).cos()).abs() < 2e-3, "{motion:?} at {next}");
            }
        }
    }
}
