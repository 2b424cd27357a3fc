//! Learning: valve gain, dead zone and Coulomb friction, slowly, within bounds, and only where the motion shows them.

use super::air::Air;
use super::factor::{Factor, quotient};
use super::inversion::{Valve, ValveModel};
use super::observer::{Estimate, Innovation, Opening};
use super::{Acceleration, Angle, Jerk, Ratio};
use crate::arithmetic::{limit, multiply};
use crate::quantities::{Velocity, Voltage};

/// Angle above which the flow tells the gain, rad.
const GAIN_ANGLE: Angle = Angle::lit("0.4");
/// Effective voltage below which the flow tells the dead zone, V.
const ZONE: Voltage = Voltage::lit("0.25");
/// Speed above which the disturbance tells the friction, m/s.
const SLIDING: Velocity = Velocity::lit("0.020");
/// Bounds of the valve's flow over its nominal flow.
const GAIN_BOUNDS: [Ratio; 2] = [Ratio::lit("0.4"), Ratio::lit("1.8")];

/// Constants of learning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LearningRates {
    /// From an innovation of the force to the rate of force that was wrong.
    pub(crate) wrong: Factor<Acceleration, Jerk>,
    /// Per tick: gain, dead zone, friction.
    pub(crate) gain: Factor<Ratio, Ratio>,
    /// See `gain`.
    pub(crate) zone: Factor<Voltage, Voltage>,
    /// See `gain`.
    pub(crate) friction: Factor<Acceleration, Acceleration>,
    /// Bounds of the dead zone's half-widths, right and left.
    pub(crate) zone_bounds: [[Voltage; 2]; 2],
    /// Bounds of the Coulomb friction.
    pub(crate) coulomb_bounds: [Acceleration; 2],
}

/// Takes what one tick shows.
#[inline]
pub(crate) fn learn(
    (valve, model): (&Valve, &mut ValveModel),
    coulomb: &mut Acceleration,
    estimate: &mut Estimate,
    innovation: &Innovation,
    opening: &Opening,
    air: &Air,
    rates: &LearningRates,
) {
    let Opening { w, theta } = *opening;
    let fills_a = theta >= 0;
    let side = usize::from(!fills_a);
    if let Some(force) = innovation.force {
        // A wrong rate of force stands as an innovation of that rate over the correction's.
        let wrong = rates.wrong.of(force).to_bits();
        // Towards a stronger valve on this side.
        let outward = if fills_a { wrong } else { wrong.saturating_neg() };
        let slope = model.slope(fills_a, air).to_bits().unsigned_abs();
        if theta.saturating_abs() > GAIN_ANGLE {
            let asked = multiply(slope as i32, theta.to_bits().saturating_abs(), 28);
            let gain = &mut model.gains[side];
            let part = quotient(outward, asked.unsigned_abs(), 28);
            let change = Ratio::from_bits(multiply(part, gain.to_bits(), 28));
            *gain = limit(gain.saturating_add(rates.gain.of(change)), GAIN_BOUNDS[0], GAIN_BOUNDS[1]);
        } else if w.saturating_abs() < ZONE && theta != 0 {
            // The voltage that makes up the wrong rate: dw = dθ (1 + 4 w²) / 2, and 1 / slope behind the dead zone.
            let radians = quotient(outward, slope, 24);
            let square = 1 << 23;
            let stretch = square + multiply(w.to_bits(), w.to_bits(), 23);
            let volts = multiply(multiply(radians, stretch, 24), valve.per_slopes_q16[side], 16);
            let [least, most] = rates.zone_bounds[side];
            let zone = &mut model.zones[side];
            *zone = limit(zone.saturating_sub(rates.zone.of(Voltage::from_bits(volts))), least, most);
        }
    }
    if estimate.v.saturating_abs() > SLIDING {
        let forwards = estimate.v > 0;
        let wrong = if forwards { estimate.disturbance.saturating_neg() } else { estimate.disturbance };
        let [least, most] = rates.coulomb_bounds;
        let before = *coulomb;
        *coulomb = limit(before.saturating_add(rates.friction.of(wrong)), least, most);
        // What friction now explains is no longer a disturbance.
        let change = *coulomb - before;
        estimate.disturbance = estimate.disturbance.saturating_add(if forwards { change } else { -change });
    }
}
