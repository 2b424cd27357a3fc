//! What the file of an effect's twin states.

use crate::physics::Physics;
use crate::reading::Reading;
use plant_model::Rig;
use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;

/// The chamber volume at which leaks have the strength stated, m3 (the paper's cases (a) and (c)).
pub(super) const REFERENCE_VOLUME_M3: f64 = 2.5e-4;

/// One effect.
pub(super) trait Twin {
    /// Values of everyday strength, times `at.scale`: 1 is what a maintenance engineer would call noticeable, 0 neutral.
    fn draw(at: &mut Everyday<'_>) -> [f64; 3];

    /// Changes the rig's parameters.
    fn apply(_p: &[f64; 3], _rig: &mut Physics) {}

    /// Adds mass flows into A and B, kg/s.
    fn flow(_p: &[f64; 3], _gas: &Gas, _into: &mut [f64; 2]) {}

    /// A force on the piston towards B, N.
    fn push(_p: &[f64; 3], _y: f64, _v: f64) -> f64 {
        0.0
    }

    /// Changes the sliding force.
    fn rub(_p: &[f64; 3], _seal: &Seal, _g: &mut Rubbing) {}

    /// Changes what the sensors show.
    fn show(_p: &[f64; 3], _reading: &mut Reading) {}
}

/// Pressures, Pa absolute.
pub(crate) struct Gas {
    pub(crate) p_a: f64,
    pub(crate) p_b: f64,
    pub(crate) atmosphere: f64,
}

/// What a seal sees.
pub(crate) struct Seal {
    pub(crate) v: f64,
    pub(crate) y: f64,
    pub(crate) half_stroke: f64,
    pub(crate) p_sum: f64,
    pub(crate) atmosphere: f64,
}

/// The sliding force in the making: `loaded direction place`.
pub(crate) struct Rubbing {
    pub(crate) loaded: f64,
    pub(crate) direction: f64,
    pub(crate) place: f64,
}

/// The rig an everyday fault is drawn for. Quantities that scale with the rig are stated relative to it: leaks and dead
/// volume to the chamber volume, forces to `F_c`, mass to the load, droop to full flow.
pub(crate) struct Everyday<'a> {
    pub(crate) rig: &'a Rig<f64>,
    pub(crate) scale: f64,
    pub(crate) rng: &'a mut Xoshiro256PlusPlus,
}

impl Everyday<'_> {
    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.rng.random_range(low..=high)
    }

    pub(crate) fn sign(&mut self) -> f64 {
        if self.rng.random_bool(0.5) { 1.0 } else { -1.0 }
    }

    /// A factor away from one by `low` to `high`, up or down.
    pub(super) fn factor(&mut self, low: f64, high: f64) -> f64 {
        1.0 + self.scale * self.sign() * self.between(low, high)
    }

    /// A factor between `low` and `high`, but outside `gap_low..gap_high`.
    pub(super) fn factor_outside(&mut self, [low, gap_low, gap_high, high]: [f64; 4]) -> f64 {
        let value = if self.rng.random_bool(0.5) { self.between(low, gap_low) } else { self.between(gap_high, high) };
        1.0 + self.scale * (value - 1.0)
    }

    /// Mean volume of a chamber at mid-stroke, m3.
    pub(super) fn chamber_m3(&self) -> f64 {
        0.5 * (self.rig.cylinder.volume_a0_m3 + self.rig.cylinder.volume_b0_m3)
    }
}
