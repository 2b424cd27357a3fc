//! The best supported model: all effects of the catalogue that lower the error on the part of the log held back, named or
//! not. A name asks whether an effect is there; this asks which model predicts the rig best.

use super::confirmation::{self, beyond_floor};
use super::hold_out;
use crate::constants;
use crate::data::channel::Channels;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::outcome::PerChannel;
use crate::select::everyday;
use crate::select::forward::ranked_candidates;
use crate::select::penalty::negligible;
use crate::select::scoring::Scoring;
use crate::select::search::Found;
use plant_model::Effect;
use rayon::prelude::*;

/// What some data cost with a fit, see [`confirmation::data_cost`]; infinite where it predicts nothing.
fn data_cost(on: &Problem<'_>, fit: &Fit) -> f64 {
    let cost = confirmation::data_cost(on, &fit.hypothesis);
    cost.filter(|cost| cost.is_finite()).unwrap_or(f64::INFINITY)
}

/// Squared errors of the whole model on the part held back, restarted, over a noise floor; infinite where it predicts nothing,
/// zero where the log does not allow full predictions.
fn whole_model(problem: &Problem<'_>, fit: &Fit, floor: Option<&PerChannel>) -> f64 {
    let errors = hold_out::errors(problem, fit, hold_out::HORIZON_S);
    errors.zip(floor).map_or(0.0, |(errors, floor)| beyond_floor(&errors, floor))
}

/// The best supported model. Effects other than the `named` ones must be confirmed, each by itself, on the part held back; `proven` is
/// the fit with those alone. With `grows` further effects are looked for. Over-dispersion is left out of account: a model that is
/// wrong in a balance should be mended there first, however little its errors say about names. `floor`: what noise makes of a
/// perfect model's predictions.
pub(crate) fn supported(
    problem: &Problem<'_>,
    found: &Found,
    (named, proven): (&[Effect], &Fit),
    floor: Option<&PerChannel>,
    grows: bool,
) -> Fit {
    let problem = &problem.with_white_noise();
    let held = problem.held_back();
    let mut current = found.best.clone();
    if named.is_empty() && !held.stretches.is_empty() && data_cost(&held, &found.forward) < data_cost(&held, &current) {
        current = found.forward.clone();
    }
    let grows = grows && !held.stretches.is_empty();
    let tells_better = |one: &Fit, other: &Fit| {
        data_cost(&held, one) < data_cost(&held, other)
            && whole_model(problem, one, floor) < whole_model(problem, other, floor)
    };
    let unnamed = found.best.hypothesis.effects.iter().filter(|effect| !named.contains(effect));
    let without = unnamed.fold(found.best.hypothesis.clone(), |rest, effect| rest.without(*effect, problem.nominal));
    if !grows {
        return confirmed(problem, &held, current, named, floor);
    }
    // What all everyday effects leave may hide how well they predict: it is added before they are judged.
    let all = everyday::fitted(problem, without).filter(|all| data_cost(&held, all) < data_cost(&held, &current));
    let all = all.map(|all| grown(problem, &held, all, named, floor));
    // Where they tell the part held back better than the unproven ones do, and than none does, none of those is examined.
    if let Some(all) = &all
        && tells_better(all, &current)
        && tells_better(all, proven)
    {
        return all.clone();
    }
    let current = grown(problem, &held, confirmed(problem, &held, current, named, floor), named, floor);
    all.filter(|all| tells_better(all, &current)).unwrap_or(current)
}

/// A fit with all further effects that the part held back confirms, as far as the effort goes, and without those that they make
/// needless.
fn grown(problem: &Problem<'_>, held: &Problem<'_>, from: Fit, named: &[Effect], floor: Option<&PerChannel>) -> Fit {
    let most = problem.effort.millions() + constants::most_effort_supported();
    let mut current = from;
    let mut refused: Vec<Effect> = Vec::new();
    let begun = current.hypothesis.effects.len();
    while current.hypothesis.effects.len() < constants::most_supported() && problem.effort.millions() < most {
        let Some(next) = one_more(problem, held, &current, floor, &mut refused) else { break };
        current = next;
    }
    if current.hypothesis.effects.len() > begun
        && let Some(fitted) = problem.refit(current.hypothesis.clone(), problem.judgeable, constants::iterations())
        && data_cost(held, &fitted) < data_cost(held, &current)
        && whole_model(problem, &fitted, floor) < constants::no_worse() * whole_model(problem, &current, floor)
    {
        current = fitted;
    }
    // What the others made needless once all were fitted together.
    for effect in current.hypothesis.effects.clone() {
        let smaller = || problem.evaluate_as_is(current.hypothesis.without(effect, problem.nominal));
        if !named.contains(&effect)
            && let Some(smaller) = smaller()
            && (negligible(&current, effect) || data_cost(held, &smaller) <= data_cost(held, &current))
        {
            current = smaller;
        }
    }
    current
}

/// A fit without those of its unproven effects that the part held back does not confirm.
fn confirmed(problem: &Problem<'_>, held: &Problem<'_>, fit: Fit, named: &[Effect], floor: Option<&PerChannel>) -> Fit {
    let mut current = fit;
    let unproven: Vec<Effect> = current.hypothesis.effects.iter().copied().filter(|e| !named.contains(e)).collect();
    for effect in unproven {
        let smaller = current.hypothesis.without(effect, problem.nominal);
        let smaller = problem.refit(smaller, effects::channels(effect), constants::support_iterations());
        let Some(smaller) = smaller else { continue };
        let confirmed = !held.stretches.is_empty() && data_cost(held, &current) < data_cost(held, &smaller);
        if !(confirmed
            && whole_model(problem, &current, floor) < constants::no_worse() * whole_model(problem, &smaller, floor))
        {
            current = smaller;
        }
    }
    current
}

/// A fit with one more effect that the part held back confirms. Those it does not confirm are `refused`.
fn one_more(
    all: &Problem<'_>,
    held: &Problem<'_>,
    from: &Fit,
    floor: Option<&PerChannel>,
    refused: &mut Vec<Effect>,
) -> Option<Fit> {
    let scoring = Scoring::new(all, from)?;
    let subset = scoring.subset();
    let (before, error) = (data_cost(held, from), whole_model(all, from, floor));
    let candidates = ranked_candidates(all, from, &scoring, all.judgeable);
    let open =
        candidates.into_iter().filter(|c| !refused.contains(&c.effect) && c.predicted > constants::penalty_per_cause());
    let chosen: Vec<_> = open.take(constants::support_candidates()).collect();
    let begun = chosen.par_iter().filter_map(|c| {
        let extended = from.hypothesis.with(c.effect, all.parameters(c.effect), c.starts.first()?, false);
        let channels: Channels = effects::channels(c.effect);
        let fit = subset.first_steps(extended, channels, constants::support_iterations(), scoring.jacobian(false))?;
        all.refit(fit.hypothesis, channels, constants::first_iterations())
    });
    let mut fits: Vec<Fit> = begun.collect();
    fits.sort_by(|a, b| a.cost(all).total_cmp(&b.cost(all)));
    for fit in fits {
        let Some(added) = fit.hypothesis.effects.last().copied() else { continue };
        if before - data_cost(held, &fit) > constants::penalty_per_cause()
            && whole_model(all, &fit, floor) < constants::no_worse() * error
        {
            return Some(fit);
        }
        refused.push(added);
    }
    None
}

/// For each effect of a fit: the share of the misfit of the balances it acts on that it takes away on the part held back,
/// everything else as it is. NaN where nothing was held back.
pub(crate) fn gains(problem: &Problem<'_>, fit: &Fit) -> Vec<f64> {
    let held = problem.held_back();
    let with = held.evaluate_as_is(fit.hypothesis.clone());
    let gain = |effect: &Effect| {
        let without = held.evaluate_as_is(fit.hypothesis.without(*effect, problem.nominal));
        let channels = effects::channels(*effect);
        match (&with, without, held.stretches.is_empty()) {
            (Some(with), Some(without), false) => {
                1.0 - with.cost_in(&held, channels) / without.cost_in(&held, channels)
            }
            _ => f64::NAN,
        }
    };
    fit.hypothesis.effects.iter().map(gain).collect()
}
