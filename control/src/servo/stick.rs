//! Stick: the piston stands off its target. The force is then led to where it breaks away, without the noise of velocity
//! and acceleration, which would throw the valve across its dead zone each tick and let no air through.

use super::constants::{REST_S, STICK_CREEP, STICK_FORCE, STICK_MOST, STICK_SPEED};
use super::factor::Factor;
use super::hold::Means;
use super::rig::Rig;
use super::{Acceleration, Jerk, ThresholdScale, Tick};
use crate::arithmetic::{fixed, limit, saturate};
use crate::quantities::{Position, Velocity};

/// Constants of stick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct StickGains {
    /// Mean speed below which the piston sticks.
    pub(crate) speed: Velocity,
    /// Ticks before the force is led.
    pub(crate) ticks: u16,
    /// Farthest that the asked force may be from the force there is.
    pub(crate) most: Acceleration,
}

impl StickGains {
    pub(crate) fn new(rig: &Rig) -> Self {
        Self { speed: fixed(STICK_SPEED), ticks: rig.ticks(REST_S), most: fixed(STICK_MOST * rig.coulomb) }
    }

    /// Whether the piston stands, by its mean velocity.
    #[inline]
    pub(crate) fn sticks(&self, mean: &Means, scale: ThresholdScale) -> bool {
        mean.v.saturating_abs() <= scale.of(self.speed)
    }
}

/// What of it goes with the law's bandwidth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LeadGains {
    /// `g w³`.
    pub(crate) error: Factor<Position, Jerk>,
    /// `6 g w²`.
    pub(crate) creep: Factor<Velocity, Jerk>,
    /// How fast the force follows.
    pub(crate) force: Factor<Acceleration, Jerk>,
}

impl LeadGains {
    /// Of the bandwidth `w`, with `gain` times the law's rate of force.
    pub(crate) fn new(w: f64, gain: f64) -> Self {
        Self {
            error: Factor::new(gain * w * w * w),
            creep: Factor::new(gain * STICK_CREEP * w * w),
            force: Factor::new(STICK_FORCE * w),
        }
    }
}

/// The force that is asked for while the piston sticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stick {
    ticks: u16,
    force: Acceleration,
}

impl Stick {
    /// Rate of force while the piston sticks off its target; `None` while it moves or has arrived.
    #[inline]
    pub(crate) fn rate(
        &mut self,
        resting: bool,
        mean: &Means,
        force: Acceleration,
        (stick, lead, tick): (&StickGains, &LeadGains, &Tick),
        scale: ThresholdScale,
    ) -> Option<Jerk> {
        if !resting || !stick.sticks(mean, scale) {
            *self = Self::default();
            return None;
        }
        self.ticks = self.ticks.saturating_add(1);
        if self.ticks < stick.ticks {
            self.force = force;
            return None;
        }
        // Below half its limit the mean velocity is mostly noise and would keep the valve awake.
        let noise = Velocity::from_bits(scale.of(stick.speed).to_bits() / 2);
        let creep = mean.v.saturating_sub(limit(mean.v, -noise, noise));
        let rate = lead.error.wide(mean.error).saturating_sub(lead.creep.wide(creep));
        let rate = Jerk::from_bits(saturate(rate));
        let asked = self.force.saturating_add(tick.change(rate));
        self.force = limit(asked, force.saturating_sub(stick.most), force.saturating_add(stick.most));
        Some(rate.saturating_add(lead.force.of(self.force.saturating_sub(force))))
    }
}
