//! A mass flow with its derivatives.

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
