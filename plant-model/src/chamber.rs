//! A chamber's pressure balance (3.6, 3.7) and its volume, which never reaches zero.

use crate::real::Real;

/// Volume of a chamber and whether it still follows the piston.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Volume<R> {
    pub(crate) inverse_per_m3: R,
    /// Rate of volume by piston velocity towards this chamber's growth: the area, or zero where the minimum volume rules.
    pub(crate) area_m2: R,
}

/// Rate of a chamber's pressure and its partial derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PressureRate<R> {
    pub(crate) rate: R,
    pub(crate) by_pressure: R,
    /// By the velocity with which the chamber grows.
    pub(crate) by_growth: R,
    /// By the piston's displacement in the direction in which the chamber grows.
    pub(crate) by_displacement: R,
    /// Factor from mass flow to pressure rate, Pa/kg.
    pub(crate) by_mass_flow: R,
}

impl<R: Real> Volume<R> {
    #[inline]
    pub(crate) fn of(volume_m3: R, area_m2: R, minimum_m3: R) -> Self {
        if volume_m3 > minimum_m3 {
            Self { inverse_per_m3: R::ONE / volume_m3, area_m2 }
        } else {
            Self { inverse_per_m3: R::ONE / minimum_m3, area_m2: R::ZERO }
        }
    }

    /// `p' = (-A n v p + R n T q) / V`; `growth` is the piston velocity in the direction in which the chamber grows,
    /// `mass_flow` the sum of all flows into it with derivative `by_p` by its own pressure, `energy = R n T`.
    #[inline]
    pub(crate) fn pressure_rate(
        &self,
        exponent: R,
        energy: R,
        p: R,
        growth: R,
        mass_flow: R,
        by_p: R,
    ) -> PressureRate<R> {
        let rate = (-self.area_m2 * exponent * growth * p + energy * mass_flow) * self.inverse_per_m3;
        PressureRate {
            rate,
            by_pressure: (-self.area_m2 * exponent * growth + energy * by_p) * self.inverse_per_m3,
            by_growth: -self.area_m2 * exponent * p * self.inverse_per_m3,
            by_displacement: -self.area_m2 * rate * self.inverse_per_m3,
            by_mass_flow: energy * self.inverse_per_m3,
        }
    }
}
