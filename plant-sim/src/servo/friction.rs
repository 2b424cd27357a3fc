//! Feedforward of friction: where a streamed target turns round, the piston sticks until the force of the chambers has
//! travelled from one end of the Coulomb friction to the other. The valve takes tens of milliseconds for that, in which the
//! target moves on. When it turns is known, so the force sets out before.

use super::tuning::Tuning;
use control::servo::constants::GAIN_DELAY;

/// The friction that the target's motion meets when the force that is asked for now will act.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Feedforward {
    force: f64,
}

impl Feedforward {
    /// A piston that rests at a friction of `force` in N.
    #[must_use]
    pub fn at(force: f64) -> Self {
        Self { force }
    }

    /// Rate of force in N/s beyond the law's, which takes the estimated `friction` in N for granted. The bristles are
    /// stretched by the target's velocity `v` in m/s, as it will be, and slide at the `coulomb` force in N; valve and tick
    /// take `delay_s`.
    pub fn rate(&mut self, v: f64, friction: f64, coulomb: f64, delay_s: f64, tuning: &Tuning) -> f64 {
        let t = tuning.tick_s;
        let before = self.force.clamp(-coulomb, coulomb);
        self.force = (before + t * tuning.bristle_stiffness * v).clamp(-coulomb, coulomb);
        (self.force - before) / t + GAIN_DELAY / delay_s * (self.force - friction)
    }
}
