//! Hold: a silent valve once the piston rests on its target.

use super::tuning::Tuning;

/// Whether the valve is held in the middle of its dead zone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hold {
    /// Holding now.
    pub on: bool,
    ticks: u32,
    target: f64,
    force: f64,
    pulse: f64,
    load: f64,
    slow: f64,
    /// Mean error, velocity and force over the last few ticks.
    pub mean: [f64; 3],
}

impl Hold {
    /// Decides whether to hold this tick. `resting` says that the reference has arrived.
    pub fn decide(&mut self, target: f64, resting: bool, now: [f64; 3], disturbance: f64, tuning: &Tuning) -> bool {
        for (mean, now) in self.mean.iter_mut().zip(now) {
            *mean += tuning.hold_weight * (now - *mean);
        }
        let [error, v, force] = self.mean;
        let [enter, leave] = tuning.hold_m;
        if self.on {
            self.ticks = self.ticks.saturating_add(1);
            // A piston moves only as long as it coasts or after its force has changed; else the error changes by noise.
            self.slow += tuning.hold_weight / 8.0 * (now[0] - self.slow);
            let may_move = self.ticks < tuning.coast_ticks || (force - self.force).abs() > tuning.hold_force;
            let off = may_move && error.abs() > leave || self.slow.abs() > 1.2 * leave || error.abs() > 2.0 * leave;
            if (target - self.target).abs() > 5e-6 || off {
                self.on = false;
                self.ticks = 0;
            }
        } else if resting && error.abs() < enter && v.abs() < tuning.hold_speed {
            self.ticks += 1;
            if self.ticks >= tuning.hold_ticks {
                (self.on, self.target, self.force, self.pulse) = (true, target, force, 0.0);
                (self.load, self.slow) = (disturbance, error);
            }
        } else {
            self.ticks = 0;
        }
        self.on
    }

    /// Rate of force that brings back what leaked away, N/s: zero, but for a pulse when the force has drifted by
    /// `allowed` newton away from the middle of what friction holds. Drift towards the middle only holds the piston safer.
    pub fn restoring_rate(&mut self, allowed: f64, inwards: bool) -> f64 {
        if inwards && (self.mean[2] + self.load).abs() < (self.force + self.load).abs() {
            self.force = self.mean[2];
        }
        let drift = self.force - self.mean[2];
        let outward = drift * (self.mean[2] + self.load) < 0.0;
        if drift.abs() > allowed && outward {
            self.pulse = drift.signum();
        }
        if drift * self.pulse <= 0.0 {
            self.pulse = 0.0;
        }
        self.pulse * allowed / 0.010
    }
}
