//! What every rig has a little of: sensors that are somewhat off, seals that rub differently by direction and pressure, a null
//! offset, an incline. Alone each is too small to be found, and together they leave every balance open, so that one effect at
//! a time explains nothing. All of them at once, each with a prior, are an ordinary fit.

use super::breakaway::from_best_breakaway;
use super::penalty::negligible;
use super::visibility::candidates;
use crate::balances::observers::Mechanics;
use crate::constants;
use crate::data::channel::Channel;
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use plant_model::Effect;
use plant_model::effects::identification::StandsFor;
use rig_files::rig_key;

/// The fit of all everyday effects beside those that a hypothesis has.
pub(crate) fn fitted(problem: &Problem<'_>, from: Hypothesis) -> Option<Fit> {
    let mut all = from.relaxed();
    let stated = |effect: &Effect| {
        let of = |p: &Parameter| matches!(p.slot, Slot::Stated(other, _) if other == *effect);
        from.effects.contains(effect) || problem.nominal.iter().any(of)
    };
    for effect in candidates(problem).into_iter().filter(|effect| is_everyday(problem, *effect) && !stated(effect)) {
        let mut parameters = problem.parameters(effect);
        parameters.iter_mut().for_each(|p| p.tolerance = Some(everyday(p)));
        let start: Vec<f64> = parameters.iter().map(|p| p.neutral).collect();
        all = all.extended_by(effect, parameters, &start);
    }
    // Mechanics first as an equation error, which has one minimum; then as predictions. The finest come last, as in the search.
    let coarse = all.coarse();
    let begun = problem.judging(Mechanics::Momentum).refit(coarse, problem.judgeable, constants::iterations())?;
    let predicted = |from: Hypothesis| from_best_breakaway(problem, from, problem.judgeable, constants::iterations());
    let fit = predicted(predicted(all.with_values_of(&begun.hypothesis))?.hypothesis)?;
    let mut fit = match problem.coordinate_search(&fit, Channel::Position.bit()) {
        Some(better) => problem.refit(better, Channel::Position.bit(), constants::support_iterations())?,
        None => fit,
    };
    for effect in fit.hypothesis.effects.clone() {
        if negligible(&fit, effect) {
            fit.hypothesis = fit.hypothesis.without(effect, problem.nominal);
        }
    }
    // A prior was for the fit: an effect of the extended rig has none.
    for p in &mut fit.hypothesis.parameters {
        if matches!(p.slot, Slot::Effect(..)) {
            p.tolerance = None;
        }
    }
    problem.evaluate_as_is(fit.hypothesis)
}

/// What a rig has of an everyday effect, as a standard deviation.
fn everyday(parameter: &Parameter) -> f64 {
    constants::everyday() * parameter.scale
}

/// Effects that vanish smoothly at their neutral values, act everywhere, and are no other word for nominal values that are
/// corrected as far anyway.
pub(super) fn is_everyday(problem: &Problem<'_>, effect: Effect) -> bool {
    let i = effect.identification();
    let parameters = problem.parameters(effect);
    let corrected = |path: &str| {
        let reach = |p: &Parameter| p.max - p.neutral;
        let as_far = |p: &Parameter| match i.stands_for {
            StandsFor::FactorOn(_) => reach(p) / p.neutral >= everyday(&parameters[0]),
            _ => parameters.iter().any(|own| reach(p) >= everyday(own)),
        };
        problem.nominal.iter().any(|p| matches!(p.slot, Slot::Nominal(key) if key.path == path) && as_far(p))
    };
    let corrected_of_a_side = |path: &&str| {
        corrected(path) || rig_key(path).is_some_and(|key| key.sides.iter().any(|side| corrected(side.key().path)))
    };
    i.smooth_at_neutral
        && !i.acts_locally
        && !i.replaces_a_law
        && i.shape_only.is_empty()
        && !i.stands_for.keys().iter().any(corrected_of_a_side)
}
