//! Stall: the piston stands although its force has grown by more than friction takes: something blocks it. The force then grows slowly,
//! because an obstacle that gives way lets go of all of it at once. A load that is unknown yet is lifted all the same, a little later.

use super::air::Areas;
use super::constants::{STALL_GROWTH_S, STALL_S, STANDS_M, STICK_FORCE, SUSPECTED};
use super::factor::Factor;
use super::rig::Rig;
use super::{Acceleration, Jerk};
use crate::arithmetic::fixed;
use crate::parameters::Parameters;
use crate::quantities::Position;

/// Constants of stall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StallLimits {
    /// A piston that has moved by less stands.
    pub(crate) stands: Position,
    /// Growth of the force that any friction takes, per moving mass.
    pub(crate) force: Acceleration,
    /// Ticks with more than that until the piston counts as blocked.
    pub(crate) ticks: u16,
    /// Ticks from which on neither friction nor load is learned.
    pub(crate) suspected: u16,
    /// By how much the force grows in a tick, per moving mass.
    pub(crate) growth: Acceleration,
    /// How fast the force follows.
    pub(crate) follow: Factor<Acceleration, Jerk>,
}

impl StallLimits {
    pub(crate) fn new(p: &Parameters, rig: &Rig, areas: &Areas) -> Self {
        let coulomb = rig.coulomb;
        Self {
            stands: fixed(STANDS_M),
            // From one end of the friction to the other, and half as much again, or what makes a free piston turn round and leave its
            // place meanwhile.
            force: fixed(2.0 * coulomb + coulomb.max(8.0 * STANDS_M / (STALL_S * STALL_S))),
            ticks: rig.ticks(STALL_S),
            suspected: rig.ticks(SUSPECTED * STALL_S),
            growth: fixed(
                areas.per_mass[0] * f64::from(p.servo_supply_pa - p.servo_atmosphere_pa).max(0.0) * rig.t
                    / STALL_GROWTH_S,
            ),
            follow: Factor::new(STICK_FORCE * rig.w),
        }
    }
}

/// Tells a piston that does not follow its force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stall {
    /// Where the piston stands, and the force with which it came there.
    place: Position,
    force: Acceleration,
    /// Ticks in which more was applied than friction takes.
    ticks: u16,
    /// By how much the force has grown since the piston counts as blocked.
    grown: Acceleration,
}

impl Stall {
    /// At rest.
    #[inline]
    pub(crate) fn at(place: Position, force: Acceleration) -> Self {
        Self { place, force, ..Self::default() }
    }

    /// Takes this tick's position, and the force of the chambers per moving mass.
    #[inline]
    pub(crate) fn see(&mut self, y: Position, force: Acceleration, limits: &StallLimits) {
        if y.saturating_sub(self.place).saturating_abs() > limits.stands {
            *self = Self::at(y, force);
        } else if force.saturating_sub(self.force).saturating_abs() > limits.force {
            self.ticks = self.ticks.saturating_add(1);
        } else if self.ticks < limits.ticks {
            self.ticks = 0;
        }
    }

    /// Whether more is applied than friction takes for [`SUSPECTED`] of the time after which the piston counts as blocked: that teaches nothing
    /// about friction and load.
    #[inline]
    pub(crate) fn suspected(&self, limits: &StallLimits) -> bool {
        self.ticks > limits.suspected
    }

    /// Rate of force while the piston is blocked on the way to its target; `None` while it is free.
    #[inline]
    pub(crate) fn rate(&mut self, error: Position, force: Acceleration, limits: &StallLimits) -> Option<Jerk> {
        if self.ticks < limits.ticks {
            return None;
        }
        if (force > self.force) != (error > 0) {
            *self = Self::at(self.place, force);
            return None;
        }
        self.grown = self.grown.saturating_add(limits.growth);
        let most = limits.force.saturating_add(self.grown);
        let asked = if error > 0 { self.force.saturating_add(most) } else { self.force.saturating_sub(most) };
        Some(limits.follow.of(asked.saturating_sub(force)))
    }
}
