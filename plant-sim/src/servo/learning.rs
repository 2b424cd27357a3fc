//! Learning: valve gain, dead zone and Coulomb friction, slowly, within bounds, and only where the motion shows them.

use super::air::Air;
use super::inversion::ValveModel;
use super::observer::{Estimate, Innovation};
use super::tuning::Tuning;

/// Angle above which the flow tells the gain, rad.
const GAIN_ANGLE: f64 = 0.4;
/// Effective voltage below which the flow tells the dead zone, V.
const ZONE_V: f64 = 0.25;
/// Speed above which the disturbance tells the friction, m/s.
const SLIDING: f64 = 0.020;
/// The valve's flow over its nominal flow.
const GAIN: [f64; 2] = [0.4, 1.8];
/// The dead zone over its nominal width.
const ZONE: [f64; 2] = [0.75, 1.25];
/// The friction over its nominal value.
const FRICTION: [f64; 2] = [0.3, 1.5];

/// The spool's lag over its nominal lag.
const LAG: [f64; 2] = [0.25, 3.5];
/// How fast the lag is learned while the angle turns, 1/s.
const LAG_RATE: f64 = 20.0;
/// Change of angle above which the force tells the lag, rad/s.
const TURNING: f64 = 50.0;

/// The spool's lag: a spool slower than modelled leaves the force behind by `slope * angle' * excess of lag`.
pub fn learn_lag(lag: &mut Lag, innovation: &Innovation, theta: f64, slope: f64, tuning: &Tuning) {
    let t = tuning.tick_s;
    let turn = (theta - lag.theta) / t;
    lag.theta = theta;
    // The innovation is the model's error behind the correction's own lag; so is what it is compared with.
    lag.turn += (t * tuning.force_rate).min(1.0) * (turn - lag.turn);
    let wrong = tuning.force_rate * innovation.force / slope;
    let part = lag.turn / (lag.turn * lag.turn + TURNING * TURNING);
    lag.seconds = (lag.seconds - LAG_RATE * t * wrong * part).clamp(LAG[0] * tuning.lag_s, LAG[1] * tuning.lag_s);
}

/// Friction as learned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Friction {
    /// Coulomb friction, N.
    pub coulomb: f64,
    /// Viscous friction, N s/m.
    pub viscous: f64,
}

impl Friction {
    /// While sliding at `v` in m/s, N.
    #[must_use]
    pub fn level(&self, v: f64) -> f64 {
        self.coulomb + self.viscous * v.abs()
    }
}

/// The spool's lag as learned.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lag {
    /// The lag, s.
    pub seconds: f64,
    pub(super) theta: f64,
    pub(super) turn: f64,
}

/// Takes what one tick shows.
pub fn learn(
    valve: &mut ValveModel,
    friction: &mut Friction,
    estimate: &mut Estimate,
    innovation: &Innovation,
    theta: f64,
    air: &Air,
    tuning: &Tuning,
) {
    let t = tuning.tick_s;
    let [gain_rate, zone_rate, friction_rate] = tuning.learn;
    let side = usize::from(theta < 0.0);
    let slope = valve.slope(theta, air);
    // A wrong rate of force stands as an innovation of that rate over the correction's.
    let rate = tuning.force_rate * innovation.force;
    let w = 0.5 * theta.tan();
    if theta.abs() > GAIN_ANGLE {
        let wrong = rate / (slope * theta) * valve.gain[side];
        valve.gain[side] = (valve.gain[side] + gain_rate * t * wrong).clamp(GAIN[0], GAIN[1]);
    } else if w.abs() < ZONE_V && theta != 0.0 {
        let wrong_v = rate / slope * (1.0 + 4.0 * w * w) / 2.0;
        let zone = if side == 0 { &mut valve.right } else { &mut valve.left };
        let outward = if side == 0 { wrong_v } else { -wrong_v };
        let nominal = tuning.zone_v[side];
        *zone = (*zone - zone_rate * t * outward).clamp(ZONE[0] * nominal, ZONE[1] * nominal);
    }
    if estimate.v.abs() > SLIDING {
        // Two regressors, one and the viscous part over the Coulomb part; the error in parts of the nominal Coulomb force.
        let direction = estimate.v.signum();
        let before = friction.level(estimate.v);
        let part = tuning.viscous * estimate.v.abs() / tuning.coulomb;
        let step = friction_rate * t * -estimate.disturbance * direction / (1.0 + part * part);
        let within = |value: f64, nominal: f64| value.clamp(FRICTION[0] * nominal, FRICTION[1] * nominal);
        friction.coulomb = within(friction.coulomb + step, tuning.coulomb);
        if tuning.x[4] > 0.0 {
            friction.viscous = within(friction.viscous + step * part * tuning.viscous / tuning.coulomb, tuning.viscous);
        }
        // What friction now explains is no longer a disturbance.
        estimate.disturbance += (friction.level(estimate.v) - before) * direction;
    }
}
