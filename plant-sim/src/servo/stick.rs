//! Stick: the piston stands off its target. The force is then led to where it breaks away, without the noise of velocity
//! and acceleration, which would throw the valve across its dead zone each tick and let no air through.

use super::tuning::Tuning;
use control::servo::constants::{STICK_CREEP, STICK_MOST};

/// The force that is asked for while the piston sticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stick {
    ticks: u32,
    force: f64,
}

impl Stick {
    /// Rate of force, N/s, while the piston sticks off its target; `None` while it moves or has arrived. `mean` is error,
    /// velocity and force over the last few ticks.
    pub fn rate(&mut self, resting: bool, mean: &[f64; 3], force: f64, tuning: &Tuning) -> Option<f64> {
        let ([error, v, _], w) = (*mean, tuning.law_w);
        if !resting || v.abs() > tuning.stick_speed {
            *self = Self::default();
            return None;
        }
        self.ticks += 1;
        if self.ticks < tuning.stick_ticks {
            self.force = force;
            return None;
        }
        // The law without acceleration and with means, sped up; the force may fall behind by the dead zone's error.
        // Below half its limit the mean velocity is mostly noise and would keep the valve awake.
        let noise = 0.5 * tuning.stick_speed;
        let creep = v - v.clamp(-noise, noise);
        let rate = tuning.stick_gain * tuning.mass * w * w * (w * error - STICK_CREEP * creep);
        let most = STICK_MOST * tuning.coulomb;
        self.force = (self.force + rate * tuning.tick_s).clamp(force - most, force + most);
        Some(rate + tuning.stick_force_rate * (self.force - force))
    }
}
