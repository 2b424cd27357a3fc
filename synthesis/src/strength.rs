//! How strong an everyday fault is: the ranges from which hidden effects are drawn, scaled so that rigs compare.
//!
//! The ranges of catalogue effects stand in their files, those of foreign ones beside their names.

use crate::cause::{Cause, Which};
use crate::effects::{self, Everyday};
use crate::foreign::Foreign;
use plant_model::{Effect, Rig};
use rand::rngs::Xoshiro256PlusPlus;

/// Whether an effect can be made weak: some replace an equation as a whole, so that neutral lies outside their bounds.
#[must_use]
pub fn scales_to_neutral(effect: Effect) -> bool {
    let neutral = effect.neutral(&Rig::<f64>::paper_a());
    effect.info().parameters.iter().zip(neutral).all(|(info, value)| (info.min..=info.max).contains(&value))
}

/// Draws an effect of `scale` times everyday strength: 1 is everyday, 0 neutral.
#[must_use]
pub fn draw(which: Which, rig: &Rig<f64>, scale: f64, rng: &mut Xoshiro256PlusPlus) -> Cause {
    let mut at = Everyday { rig, scale, rng };
    match which {
        Which::Catalogue(effect) => Cause::Catalogue(effect, effects::draw(effect, &mut at)),
        Which::Foreign(foreign) => Cause::Foreign(foreign, draw_foreign(foreign, &mut at)),
    }
}

fn draw_foreign(foreign: Foreign, at: &mut Everyday<'_>) -> [f64; 2] {
    foreign.parameters().map(|parameter| {
        let [low, high] = parameter.range;
        let value = if low < 0.0 { at.sign() * at.between(0.4 * high, high) } else { at.between(low, high) };
        // Sizes scale; frequencies, exponents, shares and time constants are what they are.
        let is_size = parameter.name.ends_with("ratio") || parameter.name == "total_k" || parameter.name == "gap_m";
        if is_size { at.scale * value } else { value }
    })
}
