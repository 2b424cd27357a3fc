//! What the air in both chambers does at one instant.
//!
//! ```text
//! K / M = γ (f_a / (l_a + y) + f_b / (l_b − y))                                    f = A p / M, per moving mass
//! G / M = γ (c_fill (f_sup − f_a) / (l_a + y) + c_exh (f_b − f_atm) / (l_b − y))   c = R T β / A,  l = V_0 / A
//! ```

use super::factor::{Factor, Share, quotient};
use super::{Acceleration, Jerk, Stiffness};
use crate::arithmetic::{limit, multiply, saturate};
use crate::quantities::{Position, Pressure, Velocity};

/// Constants of the chambers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Chambers {
    /// Force of a pressure, `A / M`.
    pub(crate) per_pa: Factor<Pressure, Acceleration>,
    /// How fast stiffness and slopes follow the measured pressures, per tick.
    pub(crate) follow: Share<Acceleration, Acceleration>,
    /// Volumes at mid-stroke over the area, `l_a` and `l_b`.
    pub(crate) lengths: [Position; 2],
    /// `γ c_fill` and `γ c_exh`, for one radian of opening.
    pub(crate) flow: [Velocity; 2],
    /// `γ` with 24 fractional bits.
    pub(crate) gamma_q24: i32,
    /// Force of the atmosphere.
    pub(crate) atmosphere: Acceleration,
    /// Force of the nominal supply, where it is not measured.
    pub(crate) nominal_supply: Acceleration,
    /// Force of a chamber at rest, where it is not measured.
    pub(crate) rest: Acceleration,
}

/// The air at this tick: how the force answers to the valve and to motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Air {
    /// Stiffness `K / M`.
    pub(crate) stiffness: Stiffness,
    /// Force slope while chamber A is filled, per radian.
    pub(crate) slope_fill_a: Jerk,
    /// Force slope while chamber B is filled, per radian.
    pub(crate) slope_fill_b: Jerk,
}

impl Chambers {
    /// The forces of chamber A, chamber B and supply, with those that are not measured from the modelled force.
    #[inline]
    pub(crate) fn complete(
        &self,
        [f_a, f_b]: [Option<Acceleration>; 2],
        supply: Acceleration,
        force: Acceleration,
    ) -> [Acceleration; 3] {
        let half = Acceleration::from_bits(force.to_bits() / 2);
        let [a, b] = match (f_a, f_b) {
            (Some(a), Some(b)) => [a, b],
            (Some(a), None) => [a, a.saturating_sub(force)],
            (None, Some(b)) => [b.saturating_add(force), b],
            (None, None) => [self.rest.saturating_add(half), self.rest.saturating_sub(half)],
        };
        let inside = |f: Acceleration| limit(f, self.atmosphere, supply.max(self.atmosphere));
        [inside(a), inside(b), supply]
    }

    /// At a position, with the forces of chamber A, chamber B and supply.
    #[inline]
    pub(crate) fn air(&self, y: Position, [f_a, f_b, f_sup]: [Acceleration; 3]) -> Air {
        let [l_a, l_b] = self.lengths;
        let per_a = per_length(l_a.saturating_add(y), l_a);
        let per_b = per_length(l_b.saturating_sub(y), l_b);
        // A tenth of the way to equal pressures no valve is; the estimate of a full chamber must not close it.
        let small = Acceleration::from_bits(multiply(f_sup.to_bits(), const { (0.03 * 65536.0) as i32 }, 16));
        let slope = |fill: Acceleration, per_fill: i32, exhaust: Acceleration, per_exhaust: i32| {
            let share = |drive: Acceleration, per: i32, flow: Velocity| {
                i64::from(multiply(drive.max(small).to_bits(), per, 28)) * i64::from(flow.to_bits())
            };
            let [c_fill, c_exhaust] = self.flow;
            let fill = share(f_sup.saturating_sub(fill), per_fill, c_fill);
            let exhaust = share(exhaust.saturating_sub(self.atmosphere), per_exhaust, c_exhaust);
            // Both below 2^62, and positive.
            Jerk::from_bits(saturate((fill >> 24) + (exhaust >> 24)).max(1))
        };
        let [k_a, k_b] = [(f_a, per_a), (f_b, per_b)].map(|(f, per)| multiply(f.to_bits(), per, 28));
        Air {
            stiffness: Stiffness::from_bits(multiply(k_a.saturating_add(k_b).max(0), self.gamma_q24, 24)),
            slope_fill_a: slope(f_a, per_a, f_b, per_b),
            slope_fill_b: slope(f_b, per_b, f_a, per_a),
        }
    }
}

/// `1 / l` in 1/m with 20 fractional bits; no shorter than a tenth of the chamber at mid-stroke.
#[inline]
fn per_length(length: Position, at_middle: Position) -> i32 {
    let least = multiply(at_middle.to_bits(), const { (0.1 * 65536.0) as i32 }, 16);
    quotient(1 << 20, length.to_bits().max(least).unsigned_abs(), 28)
}
