//! Hold: a silent valve once the piston rests on its target.

use super::cycle::Cycle;
use super::tuning::Tuning;
use control::servo::constants::{DEAD_BAND_M, DEVIATION, HOLD_DRIFT, LEAVE, PULSE_S};

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
    noise: f64,
    slow: f64,
    cycle: Cycle,
    /// Mean error, velocity and force over the last few ticks.
    pub mean: [f64; 3],
}

impl Hold {
    /// Decides whether to hold this tick. `resting` says that the reference has arrived.
    /// Now are error, velocity and force; the disturbance and the Coulomb friction are those that were estimated, N.
    pub fn decide(
        &mut self,
        target: f64,
        resting: bool,
        now: [f64; 3],
        [disturbance, coulomb]: [f64; 2],
        tuning: &Tuning,
    ) -> bool {
        for ((mean, now), weight) in self.mean.iter_mut().zip(now).zip(tuning.hold_weights) {
            *mean += weight * (now - *mean);
        }
        let [error, v, force] = self.mean;
        let [enter, leave] = tuning.hold_m;
        // At its Coulomb friction a piston creeps on once the valve is closed, or with the first force that leaks.
        let held = (force + disturbance).abs() < (coulomb - tuning.hold_margin).max(tuning.hold_band);
        if self.on {
            self.ticks = self.ticks.saturating_add(1);
            // A piston moves only as long as it coasts or after its force has changed; else the error changes by noise.
            self.slow += tuning.slow_weight * (now[0] - self.slow);
            if self.ticks <= tuning.settle_ticks {
                // The force still changes with the valve closing, and its mean lags behind.
                (self.force, self.load) = (force, disturbance);
            }
            let changed = (force - self.force).abs() > self.beyond_noise(tuning.hold_force, tuning);
            let may_move = self.ticks < tuning.coast_ticks || changed;
            let slowly = if self.ticks < tuning.trial_ticks { tuning.trial } else { LEAVE[1] };
            let off =
                may_move && error.abs() > leave || self.slow.abs() > slowly * leave || error.abs() > LEAVE[2] * leave;
            if (target - self.target).abs() > DEAD_BAND_M || off {
                self.on = false;
                self.ticks = 0;
            }
        } else if resting && held && error.abs() < enter && v.abs() < tuning.hold_speed {
            self.ticks += 1;
            if self.ticks >= tuning.hold_ticks {
                (self.on, self.target, self.force, self.pulse) = (true, target, force, 0.0);
                (self.load, self.slow) = (disturbance, error);
            }
        } else {
            self.ticks = 0;
        }
        self.cycle.see(resting && !self.on, error, leave);
        self.on
    }

    /// Whether the piston has passed a standing target once more while the reference rested there: an overshoot is no cycle.
    #[must_use]
    pub fn passed_again(&self) -> bool {
        self.cycle.passed_more_than(1)
    }

    /// A change of the mean force that counts, N: `limit`, or more where the noise of the force alone could pass it.
    fn beyond_noise(&self, limit: f64, tuning: &Tuning) -> f64 {
        limit.max(tuning.doubt * self.noise)
    }

    /// Learns the noise of the force from what of it was not expected, while the valve is closed and the air at rest.
    pub fn learn_noise(&mut self, innovation: f64, tuning: &Tuning) {
        if self.on && self.ticks > tuning.settle_ticks {
            self.noise += tuning.tick_s * tuning.force_noise_rate * (DEVIATION * innovation.abs() - self.noise);
        }
    }

    /// Rate of force that brings back what leaked away, N/s: zero, but for a pulse once the force has drifted away from the
    /// middle of what friction holds. Drift towards the middle only holds the piston safer.
    pub fn restoring_rate(&mut self, tuning: &Tuning) -> f64 {
        let allowed = HOLD_DRIFT * tuning.coulomb;
        if tuning.stick_slip && (self.mean[2] + self.load).abs() < (self.force + self.load).abs() {
            self.force = self.mean[2];
        }
        let drift = self.force - self.mean[2];
        let outward = drift * (self.mean[2] + self.load) < 0.0;
        if drift.abs() > self.beyond_noise(allowed, tuning) && outward {
            self.pulse = drift.signum();
        }
        if drift * self.pulse <= 0.0 {
            self.pulse = 0.0;
        }
        self.pulse * allowed / PULSE_S
    }
}
