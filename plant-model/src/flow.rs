//! A mass flow with its derivatives, and what an orifice of the linear law connects a chamber to.

use crate::real::Real;

/// A mass flow into a chamber and its partial derivatives, for the integrator's Jacobian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Flow<R> {
    /// Flow into the chamber, kg/s.
    pub mass_flow: R,
    /// Derivative by the chamber's pressure, kg/(s Pa).
    pub by_chamber: R,
    /// Derivative by the supply pressure, kg/(s Pa).
    pub by_supply: R,
    /// Derivative by the piston's distance from the chamber's end, kg/(s m): a cushion's.
    pub by_distance: R,
    /// `d ln q / d ln opening`: 1 without a hose, less where the hose holds back more than the valve.
    pub opening_exponent: R,
}

/// What an open orifice of the linear law connects a chamber to: flow is `conductance (pressure - p)` into the chamber.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Connection<R> {
    /// kg/(s Pa).
    pub(crate) conductance: R,
    /// Supply or atmosphere, Pa absolute.
    pub(crate) pressure_pa: R,
}

impl<R: Real> Connection<R> {
    /// Flow into a chamber at pressure `p`.
    #[inline(always)]
    pub(crate) fn inflow(&self, filling: bool, p: R) -> Flow<R> {
        Flow {
            mass_flow: self.conductance * (self.pressure_pa - p),
            by_chamber: -self.conductance,
            by_supply: if filling { self.conductance } else { R::ZERO },
            by_distance: R::ZERO,
            opening_exponent: R::ONE,
        }
    }
}
