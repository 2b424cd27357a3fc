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

/// A fit extended by each start, after a few iterations, evaluated on all data. Strained nominal values begin at nominal or as
/// fitted, whichever gives the lower cost.
pub(crate) fn by_predictions(
    problem: &Problem<'_>,
    from: &Fit,
    scoring: &Scoring<'_>,
    starts: &[Start<'_>],
) -> Vec<Fit> {
    let few = constants::first_iterations();
    let cost = |fit: &Fit| fit.cost(problem);
    let least = |one: &Fit, other: &Fit| cost(one).total_cmp(&cost(other));
    let strained = from.hypothesis.strained();
    let extended = |(effect, start): &Start<'_>, anew: bool| {
        let extended = from.hypothesis.with(*effect, problem.parameters(*effect), start, anew);
        likeliest(problem, *effect, extended)
    };
    let by_subset = |effect: Effect, extended: Hypothesis, anew: bool| {
        let slopes = scoring.jacobian(anew);
        let fit = scoring.subset().first_steps(extended, effects::channels(effect), few, slopes)?;
        problem.evaluate_as_is(fit.hypothesis)
    };
    let begin = |start: &Start<'_>| {
        let ways: &[bool] = match start.0 {
            effect if effects::moves_nominal_values(effect) => &[false],
            effect if strained & effects::channels(effect) == 0 => &[true],
            _ => &[true, false],
        };
        let fits = ways.par_iter().filter_map(|anew| by_subset(start.0, extended(start, *anew), *anew));
        fits.min_by(least)
    };
    let begun: Vec<Option<Fit>> = starts.par_iter().map(begin).collect();
    let lowest = begun.iter().flatten().map(cost).fold(f64::INFINITY, f64::min);
    // A position scale differs from other nominal values by little more than their priors. That difference shows only on all
    // data; and while a balance is wide open a scale can absorb any error.
    let open = wide_open(problem, from);
    let go_on = |(start, begun): (&Start<'_>, Option<Fit>)| {
        let begun = begun?;
        if open || !effects::moves_nominal_values(start.0) {
            return Some(begun);
        }
        // The subset may lead away from where tolerances like it best, or out of a valley that ends too early.
        let both = [problem.evaluate_as_is(extended(start, false)), Some(begun.clone())].into_par_iter().flatten();
        let promising = both.filter(|fit| promising(cost(fit), lowest, cost(from)));
        let fits = promising.filter_map(|fit| problem.refit(fit.hypothesis, effects::channels(start.0), few));
        Some(fits.min_by(least).unwrap_or(begun))
    };
    starts.par_iter().zip(begun).filter_map(go_on).collect()
}

/// Whether the mechanics of a fit are strained and leave more than noise: a valley of the sticking piston may hold it.
pub(crate) fn may_be_held(problem: &Problem<'_>, fit: &Fit) -> bool {
    let position = Channel::Position.bit();
    fit.hypothesis.strained() & position != 0 && beyond_noise_in(problem, fit, position)
}

/// Candidates that act on mechanics, begun by the momentum of a sliding piston. That balance has one minimum and costs a tenth of a
/// prediction: it tells which of them predictions go on from. What acts before the piston slides it does not see: that is looked for
/// behind mechanics that slide as measured.
pub(crate) fn by_momentum(problem: &Problem<'_>, from: &Fit, scoring: &Scoring<'_>, starts: &[Start<'_>]) -> Vec<Fit> {
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
        problem.evaluate_as_is(fit.hypothesis)
    };
    let chosen = begun.par_iter().filter(|(_, fit)| promising(cost(fit), lowest, cost(&without)));
    let look = |k: usize| {
        let (begun, channels) = (extended(k, &without.hypothesis, false), effects::channels(starts[k].0));
        from_best_stribeck(problem, scoring.subset(), &begun, channels, iterations)
    };
    chosen.filter_map(go_on).chain(resting.into_par_iter().filter_map(look)).collect()
}
