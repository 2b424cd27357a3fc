//! The image of a cause: another that does nearly the same, at a value that can be computed.

use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;
use plant_model::Effect;

/// A fit with one of its causes as another that does nearly the same, at the values that do it: from elsewhere a fit hardly
/// finds its way there. `None` for causes without such an image.
pub(crate) fn image(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Hypothesis> {
    let other = match effect {
        // Mechanics see the difference of the pressures, and the air of one chamber or the other must be a few percent off.
        Effect::PressureAOffset => Effect::PressureBOffset,
        Effect::PressureBOffset => Effect::PressureAOffset,
        // The sum of the pressures may hardly change.
        Effect::CoulombFriction => Effect::FrictionPressure,
        Effect::FrictionPressure => Effect::CoulombFriction,
        // Choked flow has a scale of its own: with it, less in one direction is more in the other.
        Effect::FillCoefficient if fit.hypothesis.effects.contains(&Effect::ChokedFlow) => Effect::ExhaustCoefficient,
        Effect::ExhaustCoefficient if fit.hypothesis.effects.contains(&Effect::ChokedFlow) => Effect::FillCoefficient,
        _ => return None,
    };
    let h = &fit.hypothesis;
    let first = |effect: Effect| problem.parameters(effect).first().copied();
    let (from, to) = (first(effect)?, first(other)?);
    if h.effects.contains(&other) || to.channels == 0 {
        return None;
    }
    let away = h.values_of(effect).first()? - from.neutral;
    let coulomb_n = problem.rig.rig.friction.coulomb_n;
    // What the cause adds to the level of friction, and how the image makes the same.
    let (added_n, start) = match effect {
        Effect::CoulombFriction => (away * coulomb_n, to.neutral + away * coulomb_n / gauge_sum_pa(problem)?),
        Effect::FrictionPressure => {
            let added_n = away * gauge_sum_pa(problem)?;
            (added_n, to.neutral + added_n / coulomb_n)
        }
        Effect::FillCoefficient | Effect::ExhaustCoefficient => (0.0, to.neutral / (1.0 + away / from.neutral)),
        _ => (0.0, to.neutral - away),
    };
    let start = [start.clamp(to.min, to.max)];
    let mut out = h.without(effect, problem.nominal).with(other, problem.parameters(other), &start, false);
    if matches!(effect, Effect::FillCoefficient | Effect::ExhaustCoefficient) {
        out.scale(Slot::Effect(Effect::ChokedFlow, 1), 1.0 + away / from.neutral);
    }
    if added_n == 0.0 {
        return Some(out);
    }
    // A factor on friction multiplies what is stated of breaking away and leaves alone what is fitted; pressure adds to both.
    for (parameter, value) in out.parameters.iter().zip(&mut out.values) {
        match parameter.slot {
            Slot::Effect(Effect::StaticFriction, _) => {
                let by_n = if effect == Effect::CoulombFriction { -added_n } else { added_n };
                *value = (*value + by_n).clamp(parameter.min, parameter.max);
            }
            Slot::Nominal(key) if key.path == "friction.static_n" || key.path == "friction.coulomb_n" => {
                *value = h.value(parameter.slot).unwrap_or(parameter.neutral);
            }
            Slot::Effect(e, 0) if e == other => *value = start[0],
            _ => {}
        }
    }
    Some(out)
}

/// The mean of both chambers' gauge pressures, summed; `None` unless both are measured and above atmosphere.
fn gauge_sum_pa(problem: &Problem<'_>) -> Option<f64> {
    let record = problem.record;
    let atmosphere_pa = problem.rig.rig.supply.atmosphere_pa;
    let mean = |signal: &[f64]| signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    let both = record.available.pressure_a && record.available.pressure_b;
    let sum = mean(&record.p_a_pa) + mean(&record.p_b_pa) - 2.0 * atmosphere_pa;
    (both && sum > 0.1 * atmosphere_pa).then_some(sum)
}
