//! The observer: position, velocity, chamber force, friction and disturbance out of noisy position and pressures.
//!
//! It is a model of the rig that runs one tick ahead of the samples, because the output is one tick late: what it
//! predicts is what the valve will find. The difference to the samples corrects it.

use super::air::Air;
use super::constants::UNSEEN_RATE;
use super::factor::{Factor, Share, falling_q28, quotient};
use super::inversion::{Valve, ValveModel};
use super::rig::Rig;
use super::{Acceleration, Angle, Damping, Jerk, Ratio, Tick, Ticks};
use crate::arithmetic::{bits, limit, multiply, product, saturate};
use crate::config_error::{ConfigError, demand};
use crate::parameters::Key;
use crate::quantities::{Position, Velocity, Voltage};

/// Constants of the observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ObserverGains {
    /// `3 w_o T`.
    pub(crate) y: Factor<Position, Position>,
    /// `3 w_o² T`.
    pub(crate) v: Factor<Position, Velocity>,
    /// `w_o³ T`.
    pub(crate) disturbance: Factor<Position, Acceleration>,
    /// How fast the estimated force follows the measured one, per tick.
    pub(crate) force: Share<Acceleration, Acceleration>,
    /// How fast an unmeasured force takes up what the model does not explain, per tick.
    pub(crate) unseen: Share<Acceleration, Acceleration>,
    /// Stiffness of the bristles, `T² σ_0 / M`, 24 fractional bits.
    pub(crate) bristle_q24: i32,
    /// `T σ_0 / M`: from velocity to the change of the bristles' force.
    pub(crate) bristle: Factor<Velocity, Acceleration>,
}

impl ObserverGains {
    /// Three poles at its bandwidth.
    ///
    /// # Errors
    /// A bandwidth that the tick is too slow for.
    pub(crate) fn new(rig: &Rig) -> Result<Self, ConfigError> {
        let Rig { t, observer_w: w, bristle, .. } = *rig;
        demand(w * t <= 0.5, Key::servo_observer_rad_per_s, w, "be at most half of tick_hz (radians per second)")?;
        Ok(Self {
            y: Factor::new(3.0 * w * t),
            v: Factor::new(3.0 * w * w * t),
            disturbance: Factor::new(w * w * w * t),
            force: Share::new((rig.force_rate * t).min(1.0)),
            unseen: Share::new((UNSEEN_RATE * t).min(1.0)),
            bristle: Factor::new(bristle * t),
            bristle_q24: bits(bristle * t * t, 24),
        })
    }
}

/// The piston and its load as learned; friction per nominal mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Body {
    /// Coulomb friction.
    pub coulomb: Acceleration,
    /// Viscous friction.
    pub viscous: Damping,
    /// Mass over nominal mass.
    pub mass: Ratio,
}

/// What is known of the rig at the next tick. Forces are per moving mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Position.
    pub y: Position,
    /// Velocity.
    pub v: Velocity,
    /// Acceleration.
    pub a: Acceleration,
    /// Force of the chambers on the piston.
    pub force: Acceleration,
    /// Force of the seal's bristles.
    pub bristle: Acceleration,
    /// What the model does not explain.
    pub disturbance: Acceleration,
    /// Force from outside as learned: what of the disturbance is neither friction nor mass.
    pub load: Acceleration,
    /// Spool position.
    pub spool: Voltage,
}

/// What the samples disagree with, before they correct the estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Innovation {
    /// Of the force; `None` where no pressures are measured.
    pub(crate) force: Option<Acceleration>,
    /// Of the position.
    pub(crate) y: Position,
}

/// How far the valve is open while a tick passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Opening {
    /// Effective voltage.
    pub(crate) w: Voltage,
    /// Its angle.
    pub(crate) theta: Angle,
}

/// How the spool follows its command within a tick.
struct Spool {
    /// Part of the distance to the command that the spool still has after the tick.
    keeps: Ratio,
    /// The same, mean over the tick.
    mean: Ratio,
}

impl Spool {
    #[inline]
    fn of(lag: Ticks) -> Self {
        if lag <= 0 {
            return Self { keeps: Ratio::ZERO, mean: Ratio::ZERO };
        }
        let keeps = Ratio::from_bits(falling_q28(quotient(1 << 16, lag.to_bits().unsigned_abs(), 26).unsigned_abs()));
        Self { keeps, mean: product(lag, Ratio::ONE - keeps) }
    }
}

impl Estimate {
    /// Corrects the prediction by this tick's samples, `samples` with these, while the piston stands: before the valve can have moved
    /// it. Its velocity is zero, and what balances the force is whatever that is. So position and force are means over all
    /// samples, and the disturbance takes back what the force is corrected by.
    #[inline]
    pub(crate) fn correct_standing(&mut self, y: Position, force: Option<Acceleration>, samples: u16) -> Innovation {
        let samples = i32::from(samples.max(1));
        let e = y.saturating_sub(self.y);
        self.y = self.y.saturating_add(Position::from_bits(e.to_bits() / samples));
        let force = force.map(|force| force.saturating_sub(self.force));
        if let Some(wrong) = force {
            let part = Acceleration::from_bits(wrong.to_bits() / samples);
            self.force = self.force.saturating_add(part);
            self.disturbance = self.disturbance.saturating_sub(part);
        }
        Innovation { force, y: e }
    }

    /// Corrects the prediction by this tick's samples.
    #[inline]
    pub(crate) fn correct(&mut self, y: Position, force: Option<Acceleration>, gains: &ObserverGains) -> Innovation {
        let e = y.saturating_sub(self.y);
        self.y = self.y.saturating_add(gains.y.of(e));
        self.v = self.v.saturating_add(gains.v.of(e));
        self.disturbance = self.disturbance.saturating_add(gains.disturbance.of(e));
        let force = force.map(|force| force.saturating_sub(self.force));
        if let Some(wrong) = force {
            self.force = self.force.saturating_add(gains.force.of(wrong));
        }
        Innovation { force, y: e }
    }

    /// Takes a force that is measured again for the estimate; what it was off by is no longer a disturbance.
    #[inline]
    pub(crate) fn take_force(&mut self, force: Acceleration) {
        self.disturbance = self.disturbance.saturating_sub(force.saturating_sub(self.force));
        self.force = force;
    }

    /// Without a measured force, what the model does not explain is slowly taken for force, on which stiffness and
    /// slopes depend; the sum of both stays.
    #[inline]
    pub(crate) fn unseen_force(&mut self, gains: &ObserverGains) {
        let part = gains.unseen.of(self.disturbance);
        self.force = self.force.saturating_add(part);
        self.disturbance = self.disturbance.saturating_sub(part);
    }

    /// Predicts the next tick with the command `u` acting meanwhile; returns how far that opens the valve.
    #[inline]
    pub(crate) fn predict(
        &mut self,
        u: Voltage,
        air: &Air,
        (valve, model): (&Valve, &ValveModel),
        (lag, body): (Ticks, &Body),
        (gains, tick): (&ObserverGains, &Tick),
    ) -> Opening {
        let distance = self.spool.saturating_sub(u);
        let spool = Spool::of(lag);
        let mean = u.saturating_add(product(distance, spool.mean));
        self.spool = u.saturating_add(product(distance, spool.keeps));
        let w = valve.effective(model, mean);
        let theta = valve.opening.angle(w);
        let slope = model.slope(theta >= 0, air);
        let by_valve: Jerk = product(slope, theta);
        let by_motion = product(air.stiffness, self.v);
        let force_now = self.force;
        self.force = force_now.saturating_add(tick.change(by_valve.saturating_sub(by_motion)));
        // Bristles are stiff: implicit, as if they held or as if they slid.
        let mean = (i64::from(force_now.to_bits()) + i64::from(self.force.to_bits()) + 1) >> 1;
        let push = Acceleration::from_bits(saturate(mean)).saturating_add(self.disturbance);
        // v' = (m v + T (push − friction)) / (m + T (viscous + T stiffness)), m over the nominal mass.
        let mass = body.mass.to_bits() >> 4;
        let damped = mass.saturating_add(tick.change::<_, Velocity>(body.viscous).to_bits());
        let momentum = i64::from(multiply(mass, self.v.to_bits(), 24));
        let momentum = |friction: Acceleration| {
            let gain: Velocity = tick.change(push.saturating_sub(friction));
            saturate(momentum + i64::from(gain.to_bits()))
        };
        let speed = |momentum: i32, inertia: i32| Velocity::from_bits(quotient(momentum, inertia.unsigned_abs(), 24));
        let before = self.v;
        let (held, inertia) = (momentum(self.bristle), damped.saturating_add(gains.bristle_q24));
        // They slide where `bristle + T stiffness v'` is beyond the Coulomb force: times T and the inertia, to save a division.
        let stretch = i64::from(gains.bristle_q24) * i64::from(held);
        let room = |end: Acceleration| {
            let room: Velocity = tick.change(end.saturating_sub(self.bristle));
            i64::from(room.to_bits()) * i64::from(inertia)
        };
        if stretch > room(body.coulomb) {
            self.bristle = body.coulomb;
            self.v = speed(momentum(self.bristle), damped);
        } else if stretch < room(-body.coulomb) {
            self.bristle = -body.coulomb;
            self.v = speed(momentum(self.bristle), damped);
        } else {
            self.v = speed(held, inertia);
            let bristle = self.bristle.saturating_add(gains.bristle.of(self.v));
            self.bristle = limit(bristle, -body.coulomb, body.coulomb);
        }
        let mean = (i64::from(before.to_bits()) + i64::from(self.v.to_bits()) + 1) >> 1;
        self.y = self.y.saturating_add(tick.change(Velocity::from_bits(saturate(mean))));
        let viscous: Acceleration = product(body.viscous, self.v);
        let force = self.force.saturating_add(self.disturbance).saturating_sub(self.bristle).saturating_sub(viscous);
        self.a = Acceleration::from_bits(quotient(force.to_bits(), body.mass.to_bits().unsigned_abs(), 28));
        Opening { w, theta }
    }
}
