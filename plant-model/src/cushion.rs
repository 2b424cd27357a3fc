//! A cushion at the end of the stroke: on its last part the air leaves a chamber through a needle only.
//!
//! ```text
//!              distance from the end <  length: flow out  = in series with the needle
//!  chamber ──┬──( bore, closed by the spear )──┬── hose ── valve      flow in = past the check valve, as without cushion
//!            └──( needle, C_n )────────────────┘
//! ```
//!
//! - The needle is in series with hose and valve by the rules of [`hose`](crate::hose); its conductance is what a screw
//!   sets, and seldom known.
//! - The spear enters its seal over the first tenth of the length, on which the flow goes over linearly from one to
//!   the other: spears are conical at the tip, and a jump would be a kink that no step of the integrator meets.
//! - Air that flows in takes the check valve, which counts as wide open (Beater, Pneumatic Drives, 2007, chapter 6).
//!
//! Left out: the volume that the spear cuts off, which counts to the chamber, and leaks past the spear's seal.

use crate::flow::Flow;
use crate::hose::Resistance;
use crate::real::Real;

/// The part of the length on which the spear closes the bore.
pub const MOUTH: f64 = 0.1;

/// A cushion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cushion<R> {
    /// Distance from the end of the stroke at which it begins, m; positive.
    pub length_m: R,
    /// The needle, and what else is in series with the valve.
    pub needle: Resistance<R>,
}

impl<R: Real> Cushion<R> {
    /// How far the bore is closed at a distance from the end, 0 to 1, and the derivative by the distance.
    #[inline]
    pub(crate) fn closed(&self, distance_m: R) -> (R, R) {
        let mouth_m = R::of(MOUTH) * self.length_m;
        let part = (self.length_m - distance_m) / mouth_m;
        if part >= R::ONE { (R::ONE, R::ZERO) } else { (part.at_least(R::ZERO), -R::ONE / mouth_m) }
    }
}

/// The mean of a flow through the bore and one through the needle alone, of which the second has the weight `closed`.
#[inline]
pub(crate) fn between<R: Real>(bore: &Flow<R>, needle: &Flow<R>, (closed, by_distance): (R, R)) -> Flow<R> {
    let mean = |bore: R, needle: R| bore + closed * (needle - bore);
    let mass_flow = mean(bore.mass_flow, needle.mass_flow);
    let by_log = mean(bore.mass_flow * bore.opening_exponent, needle.mass_flow * needle.opening_exponent);
    Flow {
        mass_flow,
        by_chamber: mean(bore.by_chamber, needle.by_chamber),
        by_supply: mean(bore.by_supply, needle.by_supply),
        by_distance: by_distance * (needle.mass_flow - bore.mass_flow),
        opening_exponent: by_log / mass_flow,
    }
}
