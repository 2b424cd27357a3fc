//! Hold: a silent valve once the piston rests on its target.

use super::constants::*;
use super::cycle::Cycle;
use super::factor::{Factor, Share};
use super::rig::Rig;
use super::{Acceleration, Jerk, ThresholdScale};
use crate::arithmetic::fixed;
use crate::quantities::{Position, Velocity};

/// Constants of hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HoldLimits {
    /// Enter below this mean error.
    pub(crate) enter: Position,
    /// Leave beyond this one.
    pub(crate) leave: Position,
    /// Leave when the target has moved by this much.
    pub(crate) target: Position,
    /// Leave beyond the long mean: while the place is still on trial, and later. At once beyond
    /// `leave_at_once`.
    pub(crate) leave_slowly: [Position; 2],
    /// See `leave_slowly`.
    pub(crate) leave_at_once: Position,
    /// Ticks after entering until the spool stands in the middle and the means have followed.
    pub(crate) settle_ticks: u16,
    /// Ticks after entering within which the piston may still coast.
    pub(crate) coast_ticks: u16,
    /// Ticks after entering within which the place is on trial.
    pub(crate) trial_ticks: u16,
    /// Change of force that may have moved the piston.
    pub(crate) force: Acceleration,
    /// Force below the Coulomb friction within which the piston counts as held.
    pub(crate) margin: Acceleration,
    /// Force within which the piston counts as held where friction is not told from noise.
    pub(crate) band: Acceleration,
    /// Enter below this mean speed.
    pub(crate) speed: Velocity,
    /// Ticks of rest before entering.
    pub(crate) ticks: u16,
    /// Weights of a new value in the means.
    pub(crate) weights: Weights,
    /// Drift of the force at which a pulse brings it back.
    pub(crate) drift: Acceleration,
    /// Rate of force of a pulse.
    pub(crate) pulse: Jerk,
    /// How fast the noise of the force is learned, per tick.
    pub(crate) noise_follow: Share<Acceleration, Acceleration>,
    /// From the mean size of an innovation of the force to a change of its mean that noise may feign.
    pub(crate) doubt: Factor<Acceleration, Acceleration>,
    /// Whether a drift towards the middle is kept.
    pub(crate) inwards: bool,
}

impl HoldLimits {
    pub(crate) fn new(rig: &Rig) -> Self {
        let Rig { t, observer_w: w_o, coulomb, .. } = *rig;
        Self {
            enter: fixed(HOLD_M[0]),
            leave: fixed(HOLD_M[1]),
            leave_slowly: [fixed(LEAVE[0] * HOLD_M[1]), fixed(LEAVE[1] * HOLD_M[1])],
            leave_at_once: fixed(LEAVE[2] * HOLD_M[1]),
            settle_ticks: rig.ticks(SETTLE_S),
            coast_ticks: rig.ticks(COAST_S),
            trial_ticks: rig.ticks(TRIAL_S),
            force: fixed(MOVING * coulomb),
            margin: fixed(HELD * coulomb),
            // The disturbance's standard deviations: the observer makes `σ² 3 w_o⁵ T / 16` of a position's variance.
            band: fixed(HELD_DEVIATIONS * w_o * w_o * root(3.0 / 16.0 * w_o * t) * 1e-6 * QUIET_UM),
            target: fixed(DEAD_BAND_M),
            speed: fixed(HOLD_SPEED),
            ticks: rig.ticks(REST_S),
            weights: Weights::new(rig),
            drift: fixed(HOLD_DRIFT * coulomb),
            pulse: fixed(HOLD_DRIFT * coulomb / PULSE_S),
            noise_follow: Share::new((FORCE_NOISE_RATE * t).min(1.0)),
            // A mean behind the observer's correction has the variance
            // `T / (2 (1 / L + mean))` of one sample's, a difference of two twice that.
            doubt: Factor::new(DEVIATION * DOUBT * root(t / (1.0 / rig.force_rate + FORCE_MEAN_S))),
            inwards: rig.slips,
        }
    }
}

/// The square root of a number between 1e-4 and 1, by Heron's steps: without a library there is none.
fn root(x: f64) -> f64 {
    (0..12).fold(1.0, |root, _| 0.5 * (root + x / root))
}

/// The weight of a new value, for each quantity that is averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Weights {
    /// Of the error.
    pub(crate) error: Share<Position, Position>,
    /// Of the error, in the long mean while holding.
    pub(crate) slow: Share<Position, Position>,
    /// Of the velocity.
    pub(crate) v: Share<Velocity, Velocity>,
    /// Of the force.
    pub(crate) force: Share<Acceleration, Acceleration>,
}

impl Weights {
    fn new(rig: &Rig) -> Self {
        let weight = mean_weight(rig);
        Self {
            error: Share::new(weight),
            slow: Share::new((rig.t / LONG_MEAN_S).min(1.0)),
            v: Share::new(weight),
            force: Share::new((rig.t / FORCE_MEAN_S).min(1.0)),
        }
    }
}

/// The weight of a new error and of a new velocity in their means.
pub(crate) fn mean_weight(rig: &Rig) -> f64 {
    (rig.t / if rig.slips { SLIPPING_MEAN_S } else { MEAN_S }).min(1.0)
}

/// Error, velocity and force, or their means over the last few ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Means {
    /// Target less position.
    pub error: Position,
    /// Velocity.
    pub v: Velocity,
    /// Force of the chambers, per moving mass.
    pub force: Acceleration,
}

/// Whether the valve is held in the middle of its dead zone.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Hold {
    /// Holding now.
    pub on: bool,
    ticks: u16,
    target: Position,
    force: Acceleration,
    load: Acceleration,
    slow: Position,
    noise: Acceleration,
    pulse: i8,
    cycle: Cycle,
    /// Whether the reference rests and the piston is not held yet.
    waits: bool,
    /// Means over the last few ticks.
    pub mean: Means,
}

impl Hold {
    /// Decides whether to hold this tick. `resting` says that the reference has arrived; the disturbance and the Coulomb
    /// friction are those that were estimated.
    #[inline]
    pub(crate) fn decide(
        &mut self,
        target: Position,
        resting: bool,
        now: Means,
        (disturbance, coulomb): (Acceleration, Acceleration),
        (limits, scale): (&HoldLimits, ThresholdScale),
    ) -> bool {
        let (mean, weights) = (&mut self.mean, &limits.weights);
        mean.error = mean.error.saturating_add(weights.error.of(now.error.saturating_sub(mean.error)));
        mean.v = mean.v.saturating_add(weights.v.of(now.v.saturating_sub(mean.v)));
        mean.force = mean.force.saturating_add(weights.force.of(now.force.saturating_sub(mean.force)));
        let error = mean.error.saturating_abs();
        // At its Coulomb friction a piston creeps on once the valve is closed, or with the first force that leaks.
        let held = mean.force.saturating_add(disturbance).saturating_abs()
            < coulomb.saturating_sub(limits.margin).max(limits.band);
        if self.on {
            self.ticks = self.ticks.saturating_add(1);
            // A piston moves only as long as it coasts or after its force has changed; else the error changes by noise.
            self.slow = self.slow.saturating_add(weights.slow.of(now.error.saturating_sub(self.slow)));
            if self.ticks <= limits.settle_ticks {
                // The force still changes with the valve closing, and its mean lags behind.
                (self.force, self.load) = (mean.force, disturbance);
            }
            let change = mean.force.saturating_sub(self.force).saturating_abs();
            let may_move = self.ticks < limits.coast_ticks || change > self.beyond_noise(limits.force, limits);
            let [on_trial, later] = limits.leave_slowly;
            let slowly = if self.ticks < limits.trial_ticks { on_trial } else { later };
            let off = (may_move && error > scale.of(limits.leave))
                || self.slow.saturating_abs() > scale.of(slowly)
                || error > scale.of(limits.leave_at_once);
            if off || target.saturating_sub(self.target).saturating_abs() > limits.target {
                self.on = false;
                self.ticks = 0;
            }
        } else if resting && held && error < scale.of(limits.enter) && mean.v.saturating_abs() < scale.of(limits.speed)
        {
            self.ticks = self.ticks.saturating_add(1);
            if self.ticks >= limits.ticks {
                (self.on, self.target, self.pulse, self.slow) = (true, target, 0, mean.error);
                (self.force, self.load) = (mean.force, disturbance);
            }
        } else {
            self.ticks = 0;
        }
        self.waits = resting && !self.on;
        self.on
    }

    /// Counts passes of a target at which the reference rests; errors within `leave` are on no side of it.
    #[inline]
    pub(crate) fn see(&mut self, leave: Position) {
        self.cycle.see(self.waits, self.mean.error, leave);
    }

    /// Whether the piston has passed a standing target once more while the reference rested there: overcompensated friction does that. An
    /// overshoot is no cycle.
    #[inline]
    pub(crate) fn take_pass(&mut self) -> bool {
        self.cycle.take_pass(1)
    }

    /// A change of the mean force that counts: the limit, or more where the noise of the force alone could pass it.
    #[inline]
    fn beyond_noise(&self, limit: Acceleration, limits: &HoldLimits) -> Acceleration {
        limit.max(limits.doubt.of(self.noise))
    }

    /// Learns the noise of the force from what of it was not expected, while the valve is closed and the air at rest.
    #[inline]
    pub(crate) fn learn_noise(&mut self, innovation: Acceleration, limits: &HoldLimits) {
        if self.on && self.ticks > limits.settle_ticks {
            let size = innovation.saturating_abs();
            self.noise = self.noise.saturating_add(limits.noise_follow.of(size.saturating_sub(self.noise)));
        }
    }

    /// Rate of force that brings back what leaked away: zero, but for a pulse once the force has drifted away from the middle
    /// of what friction holds. Drift towards the middle only holds the piston safer.
    #[inline]
    pub(crate) fn restoring_rate(&mut self, limits: &HoldLimits) -> Jerk {
        let off_middle = self.mean.force.saturating_add(self.load);
        if limits.inwards && off_middle.saturating_abs() < self.force.saturating_add(self.load).saturating_abs() {
            self.force = self.mean.force;
        }
        let drift = self.force.saturating_sub(self.mean.force);
        let outward = (drift > 0 && off_middle < 0) || (drift < 0 && off_middle > 0);
        if outward && drift.saturating_abs() > self.beyond_noise(limits.drift, limits) {
            self.pulse = if drift > 0 { 1 } else { -1 };
        }
        if (self.pulse > 0 && drift <= 0) || (self.pulse < 0 && drift >= 0) {
            self.pulse = 0;
        }
        match self.pulse {
            0 => Jerk::ZERO,
            1.. => limits.pulse,
            _ => -limits.pulse,
        }
    }
}
