//! The observer: position, velocity, chamber force, friction and disturbance out of noisy position and pressures.
//!
//! It is a model of the rig that runs one tick ahead of the samples, because the output is one tick late: what it
//! predicts is what the valve will find. The difference to the samples corrects it.

use super::air::Air;
use super::inversion::ValveModel;
use super::tuning::Tuning;
use control::servo::constants::UNSEEN_RATE;

/// The piston and its load as learned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Coulomb friction, N.
    pub coulomb: f64,
    /// Viscous friction, N s/m.
    pub viscous: f64,
    /// Mass, kg.
    pub mass: f64,
}

/// What is known of the rig at the next tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Position, m.
    pub y: f64,
    /// Velocity, m/s.
    pub v: f64,
    /// Acceleration, m/s2.
    pub a: f64,
    /// Force of the chambers on the piston, N.
    pub force: f64,
    /// Deflection of the seal's bristles, m.
    pub bristle: f64,
    /// What the model does not explain, N.
    pub disturbance: f64,
    /// Force from outside as learned, N: what of the disturbance is neither friction nor mass.
    pub load: f64,
    /// Spool position, V.
    pub spool: f64,
}

/// What the samples disagree with, before they correct the estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Innovation {
    /// Force, N.
    pub force: f64,
    /// Position, m.
    pub y: f64,
}

impl Estimate {
    /// Corrects the prediction by this tick's samples.
    pub fn correct(&mut self, y: f64, force: f64, tuning: &Tuning) -> Innovation {
        let innovation = Innovation { force: force - self.force, y: y - self.y };
        let (w, t, e) = (tuning.observer_w, tuning.tick_s, innovation.y);
        self.y += 3.0 * w * t * e;
        self.v += 3.0 * w * w * t * e;
        self.disturbance += tuning.mass * w * w * w * t * e;
        self.force += tuning.force_rate * t * innovation.force;
        innovation
    }

    /// The same while the piston stands, before the valve can have moved it: velocity is zero, and what balances the force is what
    /// does. So position and force are means over the samples so far, and the disturbance takes back what the force is corrected by.
    pub fn correct_standing(&mut self, y: f64, force: f64, samples: u32) -> Innovation {
        let innovation = Innovation { force: force - self.force, y: y - self.y };
        let weight = 1.0 / f64::from(samples);
        self.y += weight * innovation.y;
        self.force += weight * innovation.force;
        self.disturbance -= weight * innovation.force;
        innovation
    }

    /// Takes a force that is measured again for the estimate; what it was off by is no longer a disturbance.
    pub fn take_force(&mut self, force: f64) {
        self.disturbance -= force - self.force;
        self.force = force;
    }

    /// Without a measured force, what the model does not explain is slowly taken for force, on which stiffness and
    /// slopes depend; the sum of both stays.
    pub fn unseen_force(&mut self, tuning: &Tuning) {
        let part = (UNSEEN_RATE * tuning.tick_s).min(1.0) * self.disturbance;
        self.force += part;
        self.disturbance -= part;
    }

    /// Predicts the next tick with the command `u` in V acting meanwhile; returns the valve's angle.
    pub fn predict(&mut self, u: f64, air: &Air, valve: &ValveModel, lag_s: f64, body: &Body, tuning: &Tuning) -> f64 {
        let &Body { coulomb, viscous, mass } = body;
        let t = tuning.tick_s;
        let spool_keeps = if lag_s > 0.0 { (-t / lag_s).exp() } else { 0.0 };
        let spool_mean = lag_s / t * (1.0 - spool_keeps);
        let mean = u + (self.spool - u) * spool_mean;
        self.spool = u + (self.spool - u) * spool_keeps;
        let theta = valve.angle(mean);
        let slope = valve.slope(theta, air);
        let force_now = self.force;
        self.force += t * (slope * theta - air.stiffness * self.v);
        // Bristles are stiff: implicit, first as if they held, then as if they slid.
        let push = 0.5 * (force_now + self.force) + self.disturbance;
        let per_mass = t / mass;
        let before = self.v;
        let held = (self.v + per_mass * (push - tuning.bristle_stiffness * self.bristle))
            / (1.0 + per_mass * (viscous + t * tuning.bristle_stiffness));
        let most = coulomb / tuning.bristle_stiffness;
        let bristle = self.bristle + t * held;
        if bristle.abs() <= most {
            (self.v, self.bristle) = (held, bristle);
        } else {
            let side = bristle.signum();
            self.bristle = side * most;
            self.v = (self.v + per_mass * (push - side * coulomb)) / (1.0 + per_mass * viscous);
        }
        self.y += t * 0.5 * (before + self.v);
        self.a = (self.force + self.disturbance - tuning.bristle_stiffness * self.bristle - viscous * self.v) / mass;
        theta
    }
}
