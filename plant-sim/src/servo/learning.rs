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
const FRICTION: [f64; 2] = [0.3, 1.4];

/// Takes what one tick shows.
pub fn learn(
    valve: &mut ValveModel,
    coulomb: &mut f64,
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
        let direction = estimate.v.signum();
        let before = *coulomb;
        let wrong = -estimate.disturbance * direction;
        *coulomb =
            (before + friction_rate * t * wrong).clamp(FRICTION[0] * tuning.coulomb, FRICTION[1] * tuning.coulomb);
        // What friction now explains is no longer a disturbance.
        estimate.disturbance += (*coulomb - before) * direction;
    }
}
