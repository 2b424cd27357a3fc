//! Equalise: in a controlled stop the forces of both chambers are brought to those of a piston at rest, weight and the rod's
//! atmosphere included.
//!
//! Air that the motion compresses counts like any other: it brakes, because the bandwidth is small, and is let out in the end.

use super::air::Air;
use super::law::angle_for;
use super::{Acceleration, ServoState, Tuning};
use crate::quantities::Voltage;

/// The valve's command and its effective voltage for this tick.
#[inline]
pub(crate) fn command(tuning: &Tuning, state: &ServoState, air: &Air) -> [Voltage; 2] {
    // As measured, where it is: the estimate holds what a wrong position has made of it.
    let [f_a, f_b, _] = state.forces;
    let missing: Acceleration = tuning.chambers.rest_force().saturating_sub(f_a.saturating_sub(f_b));
    let rate = tuning.equalise.of(missing);
    let theta = angle_for(rate, state.valve.slope(rate >= 0, air), tuning.valve.most_angle(&state.valve));
    tuning.valve.command(&state.valve, theta)
}
