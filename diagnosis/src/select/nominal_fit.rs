//! The fit of the nominal values alone, within their tolerances.

use super::penalty::beyond_noise_in;
use crate::balances::observers::Mechanics;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use rayon::prelude::*;

/// A minimum beside the truth leaves most of what it leaves for nothing: less than this part is left where mechanics begin by momentum. Of three
/// such logs 0.07 to 0.23 were left, beside a hidden piston area 0.96.
const BESIDE: f64 = 0.25;

/// The fit of the nominal values; what leads astray from far away joins last.
pub(super) fn fitted(problem: &Problem<'_>, nominal: &Hypothesis) -> Option<Fit> {
    let coarse = problem.fit(nominal.coarse(), constants::iterations())?;
    let fit = if coarse.hypothesis.parameters.len() == nominal.parameters.len() {
        coarse
    } else {
        problem.fit(nominal.refining(&coarse.hypothesis), constants::iterations())?
    };
    let noise = problem.noise_cost(Channel::Position.bit());
    let excess = |fit: &Fit| fit.channel_cost[Channel::Position as usize] - noise;
    let open = beyond_noise_in(problem, &fit, Channel::Position.bit());
    let other = if open { by_momentum(problem, &fit) } else { None };
    let better = other.filter(|other| other.cost(problem) < fit.cost(problem) && excess(other) < BESIDE * excess(&fit));
    Some(better.unwrap_or(fit))
}

/// The same with mechanics fitted first as an equation error, which has one minimum, then as predictions: friction that is known to a
/// third may end in a minimum beside the truth.
fn by_momentum(problem: &Problem<'_>, fit: &Fit) -> Option<Fit> {
    let position = Channel::Position.bit();
    let mut anew = fit.hypothesis.clone();
    let mechanics = anew.parameters.iter().zip(&mut anew.values).filter(|(p, _)| p.channels == position);
    mechanics.for_each(|(p, value)| *value = p.neutral);
    let sliding = problem.judging(Mechanics::Momentum).refit(anew, position, constants::iterations())?;
    let fit = from_best_breakaway(problem, sliding.hypothesis, position, constants::iterations())?;
    problem.fit_and_search(best_breakaway(problem, fit.hypothesis), position, constants::iterations(), f64::INFINITY)
}

/// A fit that begins with the static friction at which mechanics cost least, after something `changed` in some channels.
pub(super) fn from_best_breakaway(
    problem: &Problem<'_>,
    hypothesis: Hypothesis,
    changed: Channels,
    iterations: usize,
) -> Option<Fit> {
    problem.refit(best_breakaway(problem, hypothesis), changed, iterations)
}

/// The same hypothesis with the static friction at which mechanics cost least: sliding says little of it, and a fit does not come from one
/// valley to another.
fn best_breakaway(problem: &Problem<'_>, hypothesis: Hypothesis) -> Hypothesis {
    let of = |p: &Parameter| matches!(p.slot, Slot::Nominal(key) if key.path == "friction.static_n");
    let Some(place) = hypothesis.parameters.iter().position(of) else { return hypothesis };
    let p = hypothesis.parameters[place];
    let levels: Vec<f64> =
        std::iter::successors(Some(p.min.max(1.0e-3)), |level| Some(level * constants::level_step()))
            .take_while(|level| *level <= p.max)
            .collect();
    let cost = |level: &f64| {
        let mut values = hypothesis.values.clone();
        values[place] = *level;
        let residuals = problem.evaluate(&hypothesis, &values, Channel::Position.bit())?;
        Some((problem.total(&residuals, &hypothesis, &values), *level))
    };
    let all: Vec<(f64, f64)> = levels.par_iter().chain([&hypothesis.values[place]]).filter_map(cost).collect();
    let best = all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    let mut out = hypothesis;
    if let Some((_, level)) = best {
        out.values[place] = level;
    }
    out
}
