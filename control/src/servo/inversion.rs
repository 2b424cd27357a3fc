//! Inversion of the valve: from the rate of force asked for to the command, through flow, arc tangent and dead zone.

use super::air::Air;
use super::angle::{angle, effective_voltage};
use super::{Angle, Jerk, Ratio};
use crate::arithmetic::{limit, multiply};
use crate::quantities::Voltage;

/// Constants of the valve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Valve {
    /// Middle of the dead zone.
    pub(crate) centre: Voltage,
    /// Slopes behind the dead zone, to the right and to the left, I16F16, and their reciprocals.
    pub(crate) slopes_q16: [i32; 2],
    /// See `slopes_q16`.
    pub(crate) per_slopes_q16: [i32; 2],
    /// Lowest and highest command.
    pub(crate) ends: [Voltage; 2],
    /// What the smaller of both leaves on either side of the centre.
    pub(crate) most: Voltage,
    /// Angle below which the dead zone is crossed on a straight line.
    pub(crate) blend: Angle,
    /// Its reciprocal, I16F16.
    pub(crate) per_blend_q16: i32,
    /// Nominal half-widths of the dead zone, to the right and to the left.
    pub(crate) zones: [Voltage; 2],
}

/// The valve as learned, one value for each side: filling A (right), filling B (left).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValveModel {
    /// Half-widths of the dead zone, both positive.
    pub zones: [Voltage; 2],
    /// Flow over nominal flow.
    pub gains: [Ratio; 2],
}

impl ValveModel {
    /// Force slope on the side that fills A, or that fills B.
    #[inline]
    pub(crate) fn slope(&self, fills_a: bool, air: &Air) -> Jerk {
        let [gain_a, gain_b] = self.gains;
        let (gain, slope) = if fills_a { (gain_a, air.slope_fill_a) } else { (gain_b, air.slope_fill_b) };
        Jerk::from_bits(multiply(gain.to_bits(), slope.to_bits(), 28).max(1))
    }
}

impl Valve {
    /// Effective voltage of a spool position.
    #[inline]
    pub(crate) fn effective(&self, model: &ValveModel, spool: Voltage) -> Voltage {
        let from = spool.saturating_sub(self.centre);
        let [right, left] = model.zones;
        let (beyond, slope) = if from > right {
            (from - right, self.slopes_q16[0])
        } else if from < -left {
            (from + left, self.slopes_q16[1])
        } else {
            return Voltage::ZERO;
        };
        Voltage::from_bits(multiply(beyond.to_bits(), slope, 16))
    }

    /// The largest angle towards either side.
    #[inline]
    pub(crate) fn most_angle(&self, model: &ValveModel) -> Angle {
        let [right, left] = model.zones;
        let least_slope = self.slopes_q16[0].min(self.slopes_q16[1]);
        let beyond = self.most.saturating_sub(right.max(left)).max(Voltage::ZERO);
        angle(Voltage::from_bits(multiply(beyond.to_bits(), least_slope, 16)))
    }

    /// The command for an angle, and its effective voltage.
    #[inline]
    pub(crate) fn command(&self, model: &ValveModel, theta: Angle) -> [Voltage; 2] {
        let w = effective_voltage(theta);
        let side = usize::from(theta < 0);
        let [zone, per_slope] = [model.zones[side].to_bits(), self.per_slopes_q16[side]];
        let size = theta.to_bits().saturating_abs();
        let zone = if size < self.blend.to_bits() {
            // |θ| / blend is below 1: 16 fractional bits.
            multiply(zone, multiply(size, self.per_blend_q16, 28), 16)
        } else {
            zone
        };
        let zone = Voltage::from_bits(if side == 0 { zone } else { -zone });
        let u =
            self.centre.saturating_add(zone).saturating_add(Voltage::from_bits(multiply(w.to_bits(), per_slope, 16)));
        let [lowest, highest] = self.ends;
        [limit(u, lowest, highest), w]
    }
}
