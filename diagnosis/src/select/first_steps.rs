//! The first iterations of candidates for one more cause, on a subset of the data.

use super::breakaway::{from_best_breakaway, from_best_stribeck};
use super::penalty::{beyond_noise_in, wide_open};
use super::scoring::Scoring;
use crate::balances::observers::Mechanics;
use crate::constants;
use crate::data::channel::Channel;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::hypothesis::Hypothesis;
use crate::model::nominal::sizes_are_free;
use plant_model::Effect;
use rayon::prelude::*;

/// An effect with initial values.
pub(crate) type Start<'a> = (Effect, &'a [f64]);

/// Whether a cost is so near the lowest one of some candidates, counted from the cost without any, that further iterations may
/// make it the lowest.
pub(crate) fn promising(cost: f64, lowest: f64, without: f64) -> bool {
    cost < lowest + 0.5 * (without - lowest).max(0.0) + 2.0 * constants::tie()
}

/// An effect that takes nominal values with it begins where tolerances like them best: their size is told by nothing else.
pub(crate) fn likeliest(problem: &Problem<'_>, effect: Effect, mut begun: Hypothesis) -> Hypothesis {
    if effects::moves_nominal_values(effect) && sizes_are_free(problem.rig, problem.nominal) {
        begun.scale_to_likeliest_size();
    }
    begun
}

/// A fit extended by each start, after a few iterations, evaluated on all data; lowest cost first.
pub(crate) fn begun(problem: &Problem<'_>, from: &Fit, scoring: &Scoring<'_>, starts: &[Start<'_>]) -> Vec<Fit> {
    let mut begun = by_predictions(problem, from, scoring, starts);
    // Mechanics that were strained without an effect may hold its fit in another valley of the sticking piston.
    let strained = from.hypothesis.strained() & Channel::Position.bit() != 0;
    if strained && beyond_noise_in(problem, from, Channel::Position.bit()) {
        begun.extend(by_momentum(problem, from, scoring, starts));
    }
    begun.sort_by(|a, b| a.1.cost(problem).total_cmp(&b.1.cost(problem)));
    let mut seen = Vec::new();
    begun.retain(|(start, _)| {
        let first = !seen.contains(start);
        seen.push(*start);
        first
    });
    begun.into_iter().map(|(_, fit)| fit).collect()
}

/// Candidates with the number of their start. Strained nominal values begin at nominal or as fitted, whichever gives the lower
/// cost.
fn by_predictions(problem: &Problem<'_>, from: &Fit, scoring: &Scoring<'_>, starts: &[Start<'_>]) -> Vec<(usize, Fit)> {
    let (strained, open) = (from.hypothesis.strained(), wide_open(problem, from));
    let begin = |(effect, start): &Start<'_>| {
        let channels = effects::channels(*effect);
        let ways: &[bool] = if effects::moves_nominal_values(*effect) {
            &[false]
        } else if strained & channels == 0 {
            &[true]
        } else {
            &[true, false]
        };
        // A position scale differs from other nominal values by little more than their priors. That difference shows only on all
        // data; and while a balance is wide open a scale can absorb any error.
        let on_all_data = effects::moves_nominal_values(*effect) && !open;
        let begin = |anew: &bool| {
            let extended = from.hypothesis.with(*effect, problem.parameters(*effect), start, *anew);
            let extended = likeliest(problem, *effect, extended);
            let slopes = scoring.jacobian(*anew);
            let few = constants::first_iterations();
            let by_subset = scoring.subset().first_steps(extended.clone(), channels, few, slopes)?;
            if !on_all_data {
                return problem.evaluate_as_is(by_subset.hypothesis);
            }
            // The subset may lead away from where tolerances like it best, or out of a valley that ends too early.
            let both =
                [extended, by_subset.hypothesis].into_iter().filter_map(|from| problem.refit(from, channels, few));
            both.min_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)))
        };
        ways.par_iter().filter_map(begin).min_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)))
    };
    starts.par_iter().enumerate().filter_map(|(k, start)| Some((k, begin(start)?))).collect()
}

/// Candidates that act on mechanics, begun by the momentum of a sliding piston, with the number of their start. That balance has
/// one minimum and costs a tenth of a prediction: it tells which of them predictions go on from. What acts before the piston slides
/// it does not see: that is looked for behind mechanics that slide as measured.
fn by_momentum(problem: &Problem<'_>, from: &Fit, scoring: &Scoring<'_>, starts: &[Start<'_>]) -> Vec<(usize, Fit)> {
    let iterations = constants::first_iterations();
    let sliding = scoring.subset().judging(Mechanics::Momentum);
    let Some(without) = sliding.refit(from.hypothesis.relaxed(), Channel::Position.bit(), iterations) else {
        return Vec::new();
    };
    let mut acting: Vec<usize> = (0..starts.len()).collect();
    acting.retain(|k| effects::channels(starts[*k].0) & Channel::Position.bit() != 0);
    let (mut resting, seen): (Vec<usize>, Vec<usize>) =
        acting.into_iter().partition(|k| starts[*k].0.identification().starts_form_a_grid);
    resting.dedup_by_key(|k| starts[*k].0);
    let extended = |k: usize, from: &Hypothesis, anew: bool| {
        let (effect, start) = starts[k];
        from.with(effect, problem.parameters(effect), start, anew)
    };
    let begin = |k: usize| {
        Some((k, sliding.refit(extended(k, &from.hypothesis, true), effects::channels(starts[k].0), iterations)?))
    };
    let begun: Vec<(usize, Fit)> = seen.into_par_iter().filter_map(begin).collect();
    let cost = |fit: &Fit| fit.cost(&sliding);
    let lowest = begun.iter().map(|(_, fit)| cost(fit)).fold(f64::INFINITY, f64::min);
    let go_on = |(k, fit): &(usize, Fit)| {
        let channels = effects::channels(starts[*k].0);
        let fit = from_best_breakaway(scoring.subset(), fit.hypothesis.clone(), channels, iterations)?;
        Some((*k, problem.evaluate_as_is(fit.hypothesis)?))
    };
    let chosen = begun.par_iter().filter(|(_, fit)| promising(cost(fit), lowest, cost(&without)));
    let look = |k: usize| {
        let (begun, channels) = (extended(k, &without.hypothesis, false), effects::channels(starts[k].0));
        Some((k, from_best_stribeck(problem, scoring.subset(), &begun, channels, iterations)?))
    };
    chosen.filter_map(go_on).chain(resting.into_par_iter().filter_map(look)).collect()
}
