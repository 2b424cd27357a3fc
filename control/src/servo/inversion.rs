//! Inversion of the valve: from the rate of force asked for to the command, through flow, opening and dead zone.

use super::air::Air;
use super::constants::{BLEND, FULL_FLOW};
use super::opening::Opening;
use super::{Angle, Jerk, Ratio};
use crate::arithmetic::{bits, fixed, limit, product};
use crate::dead_zone_inverse::DeadZoneInverse;
use crate::parameters::Parameters;
use crate::quantities::Voltage;
use fixed::types::{I6F26, I16F16};

/// Constants of the valve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Valve {
    /// Middle of the dead zone.
    pub(crate) centre: Voltage,
    /// Slopes behind the dead zone, to the right and to the left, and their reciprocals.
    pub(crate) slopes: [I16F16; 2],
    /// See `slopes`.
    pub(crate) per_slopes: [I16F16; 2],
    /// Lowest and highest command.
    pub(crate) ends: [Voltage; 2],
    /// Largest command about the centre that is available on both sides.
    pub(crate) most: Voltage,
    /// Angle below which the dead zone is crossed on a straight line.
    pub(crate) blend: Angle,
    /// Its reciprocal.
    pub(crate) per_blend: I16F16,
    /// Nominal half-widths of the dead zone, to the right and to the left.
    pub(crate) zones: [Voltage; 2],
    /// How far it is open behind them.
    pub(crate) opening: Opening,
}

/// [`FULL_FLOW`] in the format of a gain.
const FULL: Ratio = Ratio::from_bits(bits(FULL_FLOW, Ratio::FRAC_NBITS));

/// The valve as learned, one value for each side: filling A (right), filling B (left).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValveModel {
    /// Half-widths of the dead zone, both positive.
    pub zones: [Voltage; 2],
    /// Flow over nominal flow.
    pub gains: [Ratio; 2],
}

impl ValveModel {
    /// The valve as it is by its parameters.
    pub(crate) fn nominal(valve: &Valve) -> Self {
        Self { zones: valve.zones, gains: [Ratio::ONE; 2] }
    }

    /// Force slope on the side that fills A, or that fills B.
    #[inline]
    pub(crate) fn slope(&self, fills_a: bool, air: &Air) -> Jerk {
        let [gain_a, gain_b] = self.gains;
        let (gain, slope) = if fills_a { (gain_a, air.slope_fill_a) } else { (gain_b, air.slope_fill_b) };
        product::<_, _, Jerk>(gain, slope).max(Jerk::DELTA)
    }

    /// The part of its limits that the reference uses: speed, acceleration and jerk that the flow holds up are proportional to
    /// it. All of them from [`FULL_FLOW`] on. And no more than a lower `bandwidth` of the law follows.
    #[inline]
    pub(crate) fn part_of_limits(&self, bandwidth: Ratio) -> I6F26 {
        let [gain_a, gain_b] = self.gains;
        let flow = product::<_, _, I6F26>(gain_a.min(gain_b), const { FULL.recip() }).min(I6F26::ONE);
        product(flow, bandwidth)
    }
}

impl Valve {
    /// The valve whose dead zone the paper's law compensates, too.
    pub(crate) fn new(p: &Parameters, inverse: &DeadZoneInverse, opening: Opening) -> Self {
        let DeadZoneInverse { right, left, centre, lowest, highest, .. } = *inverse;
        let slopes = [p.slope_right, p.slope_left].map(f64::from);
        let most = highest.saturating_sub(centre).min(centre.saturating_sub(lowest)).max(Voltage::ZERO);
        Self {
            centre,
            slopes: slopes.map(fixed),
            per_slopes: [inverse.per_slope_right, inverse.per_slope_left],
            ends: [lowest, highest],
            most,
            blend: fixed(BLEND),
            per_blend: fixed(1.0 / BLEND),
            zones: [right.saturating_sub(centre), centre.saturating_sub(left)],
            opening,
        }
    }

    /// Effective voltage of a spool position.
    #[inline]
    pub(crate) fn effective(&self, model: &ValveModel, spool: Voltage) -> Voltage {
        let from = spool.saturating_sub(self.centre);
        let [right, left] = model.zones;
        let (beyond, slope) = if from > right {
            (from - right, self.slopes[0])
        } else if from < -left {
            (from + left, self.slopes[1])
        } else {
            return Voltage::ZERO;
        };
        product(beyond, slope)
    }

    /// The largest angle towards either side.
    #[inline]
    pub(crate) fn most_angle(&self, model: &ValveModel) -> Angle {
        let [right, left] = model.zones;
        let least_slope = self.slopes[0].min(self.slopes[1]);
        let beyond = self.most.saturating_sub(right.max(left)).max(Voltage::ZERO);
        self.opening.angle(product(beyond, least_slope))
    }

    /// The command for an angle, and its effective voltage.
    #[inline]
    pub(crate) fn command(&self, model: &ValveModel, theta: Angle) -> [Voltage; 2] {
        let w = self.opening.voltage(theta);
        let side = usize::from(theta < 0);
        let size = theta.saturating_abs();
        let mut zone = model.zones[side];
        if size < self.blend {
            let part: Ratio = product(size, self.per_blend);
            zone = product(zone, part);
        }
        let zone = if side == 0 { zone } else { -zone };
        let u = self.centre.saturating_add(zone).saturating_add(product(w, self.per_slopes[side]));
        let [lowest, highest] = self.ends;
        [limit(u, lowest, highest), w]
    }
}
