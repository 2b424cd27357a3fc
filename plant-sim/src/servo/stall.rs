//! Stall: the piston stands against something, and the force grows. It grows slowly then, because an obstacle that gives way lets go of
//! all the force at once, while a load that is only unknown yet is lifted a little later.

use super::tuning::Tuning;
use control::servo::constants::{STANDS_M, SUSPECTED};

/// Tells a piston that does not follow its force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stall {
    place: f64,
    force: f64,
    ticks: u32,
    grown: f64,
}

impl Stall {
    /// At rest.
    #[must_use]
    pub fn at(place: f64, force: f64) -> Self {
        Self { place, force, ..Self::default() }
    }

    /// Takes this tick's position in m and force of the chambers in N.
    pub fn see(&mut self, y: f64, force: f64, tuning: &Tuning) {
        if (y - self.place).abs() > STANDS_M {
            *self = Self::at(y, force);
        } else if (force - self.force).abs() > tuning.stall_force {
            self.ticks = self.ticks.saturating_add(1);
        } else if self.ticks < tuning.stall_ticks {
            self.ticks = 0;
        }
    }

    /// Whether more force is applied than friction takes for a quarter of the time in which the piston counts as blocked. A piston that is free
    /// but slow to set out has moved by then.
    #[must_use]
    pub fn suspected(&self, tuning: &Tuning) -> bool {
        f64::from(self.ticks) > SUSPECTED * f64::from(tuning.stall_ticks)
    }

    /// Rate of force, N/s, while the piston is blocked on the way to its target.
    #[must_use]
    pub fn rate(&mut self, error: f64, force: f64, tuning: &Tuning) -> Option<f64> {
        if self.ticks < tuning.stall_ticks {
            return None;
        }
        if (force > self.force) != (error > 0.0) {
            *self = Self::at(self.place, force);
            return None;
        }
        self.grown += tuning.stall_rate * tuning.tick_s;
        let asked = self.force + (tuning.stall_force + self.grown).copysign(error);
        Some(tuning.stick_force_rate * (asked - force))
    }
}
