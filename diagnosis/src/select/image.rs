//! The image of a cause: another effect that is nearly equivalent, at a value that can be computed.

use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;
use plant_model::Effect;
use plant_model::effects::identification::{ImageContext, Imaged, StandsFor};

/// A hypothesis with one cause of a fit replaced by its image, at equivalent values: from other initial values a fit
/// rarely converges there. `None` for causes without an image.
pub(crate) fn image(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Hypothesis> {
    let other = effect.image_among(&fit.hypothesis.effects)?;
    let h = &fit.hypothesis;
    let to = problem.parameters(other).first().copied()?;
    if h.effects.contains(&other) || to.channels == 0 {
        return None;
    }
    let imaged = imaged(problem, fit, effect, other)?;
    let start = [imaged.value.clamp(to.min, to.max)];
    let mut out = h.without(effect, problem.nominal).with(other, problem.parameters(other), &start, false);
    if let Some((companion, index, factor)) = imaged.companion {
        out.scale(Slot::Effect(companion, index), factor);
    }
    let added_n = imaged.added_friction_n;
    if added_n == 0.0 {
        return Some(out);
    }
    // A factor on friction multiplies the stated static friction, not one fitted as an effect; friction that grows with
    // pressure adds to both. So the fitted value changes by the difference, and the stated levels keep their values.
    let factor = matches!(effect.identification().stands_for, StandsFor::FactorOn(_));
    let levels = [effect, other].map(|effect| effect.identification().adds_to_levels).concat();
    for (parameter, value) in out.parameters.iter().zip(&mut out.values) {
        match parameter.slot {
            Slot::Effect(e, 0) if e == other => *value = start[0],
            Slot::Effect(e, 0) if e.identification().stands_for == StandsFor::ValuesOf(&["friction.static_n"]) => {
                let by_n = if factor { -added_n } else { added_n };
                *value = (*value + by_n).clamp(parameter.min, parameter.max);
            }
            Slot::Nominal(key) if levels.contains(&key.path) => {
                *value = h.value(parameter.slot).unwrap_or(parameter.neutral);
            }
            _ => {}
        }
    }
    Some(out)
}

/// The values that make another effect equivalent to a cause of a fit.
fn imaged(problem: &Problem<'_>, fit: &Fit, effect: Effect, other: Effect) -> Option<Imaged> {
    let neutral = |effect: Effect| problem.parameters(effect).first().map(|p| p.neutral);
    let neutral_here = neutral(effect)?;
    let context = ImageContext {
        rig: &problem.rig.rig,
        away: fit.hypothesis.values_of(effect).first()? - neutral_here,
        neutral: neutral_here,
        image_neutral: neutral(other)?,
        gauge_sum_pa: problem.gauge_sum_pa(),
    };
    effect.as_image(other, &context)
}

/// The third effect, and the index of its parameter, that has to change when a cause is replaced by its image.
pub(crate) fn companion(problem: &Problem<'_>, fit: &Fit, effect: Effect, other: Effect) -> Option<(Effect, usize)> {
    imaged(problem, fit, effect, other)?.companion.map(|(companion, index, _)| (companion, index))
}
