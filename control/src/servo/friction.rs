//! Feedforward of friction: where a streamed target turns round, the piston sticks until the force of the chambers has
//! travelled from one end of the Coulomb friction to the other. The valve takes tens of milliseconds for that, in which the
//! target moves on. When it turns is known, so the force sets out before.

use super::constants::{GAIN_DELAY, TICK_DELAY};
use super::factor::{Factor, quotient};
use super::reference::Motion;
use super::rig::Rig;
use super::{Acceleration, Jerk, Ratio, Tick, Ticks};
use crate::arithmetic::{bits, limit, product};
use crate::quantities::Velocity;

/// Gain times dead time, in ticks.
const GAIN: Ticks = Ticks::from_bits(bits(GAIN_DELAY, Ticks::FRAC_NBITS));
/// [`TICK_DELAY`] in their format.
const TICK: Ticks = Ticks::from_bits(bits(TICK_DELAY, Ticks::FRAC_NBITS));

/// Constants of the feedforward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FrictionGains {
    /// `T σ_0 / M`: from velocity to the change of the bristles' force in a tick.
    pub(crate) bristle: Factor<Velocity, Acceleration>,
    /// `1 / T`.
    pub(crate) per_tick: Factor<Acceleration, Jerk>,
    /// Delay of the command by tick, output and hoses.
    pub(crate) delay: Ticks,
}

impl FrictionGains {
    pub(crate) fn new(rig: &Rig) -> Self {
        Self {
            bristle: Factor::new(rig.bristle / rig.hz),
            per_tick: Factor::new(rig.hz),
            delay: TICK + Ticks::from_num(rig.delay_ticks),
        }
    }
}

/// The friction that the target's motion meets when the force that is asked for now will act, per moving mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feedforward {
    force: Acceleration,
}

impl Feedforward {
    /// A piston that rests at this friction.
    #[inline]
    pub(crate) fn at(force: Acceleration) -> Self {
        Self { force }
    }

    /// Rate of force beyond the law's, which takes the estimated `friction` for granted, for a target that moves like `aim`.
    /// The bristles are stretched by its velocity and slide at the `coulomb` force; `full` is the rate of force of the open
    /// valve, `lag` that of its spool.
    #[inline]
    pub(crate) fn rate(
        &mut self,
        aim: &Motion,
        (friction, coulomb): (Acceleration, Acceleration),
        full: Jerk,
        lag: Ticks,
        (gains, tick): (&FrictionGains, &Tick),
    ) -> Jerk {
        let delay = lag.saturating_add(gains.delay);
        // The force travels by twice the friction at full flow; half of that before the target turns, half after it.
        let full: Acceleration = tick.change(full);
        let travel = quotient(coulomb.to_bits(), full.to_bits().unsigned_abs(), Ticks::FRAC_NBITS);
        let change: Velocity = tick.change(aim.a);
        let v_ahead = aim.v.saturating_add(product(change, delay.saturating_add(Ticks::from_bits(travel))));
        let before = limit(self.force, -coulomb, coulomb);
        self.force = limit(before.saturating_add(gains.bristle.of(v_ahead)), -coulomb, coulomb);
        let share = Ratio::from_bits(quotient(GAIN.to_bits(), delay.to_bits().unsigned_abs(), Ratio::FRAC_NBITS));
        let step: Acceleration = product(self.force.saturating_sub(friction), share);
        gains.per_tick.of((self.force - before).saturating_add(step))
    }
}
