//! Ties: the effects that explain the log as well in the place of a cause.

use super::exchange::Alternatives;
use super::penalty::penalised_cost;
use super::visibility::candidates;
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use plant_model::Effect;

/// For each cause: the effects tied with it, by penalised cost, structurally or for want of columns, and the growth of the cost without it.
pub(crate) fn ties(problem: &Problem<'_>, best: &Fit, all: Vec<Option<Alternatives>>) -> (Vec<Vec<Effect>>, Vec<f64>) {
    let cost = penalised_cost(problem, best);
    let candidates = candidates(problem);
    // What acts on a balance at hand, but was not tried because columns are missing that would tell it from the cause.
    let untried = |effect: Effect| {
        let alike = effect.confused_with().map(|(other, _)| other);
        alike.filter(|other| !candidates.contains(other) && effects::channels(*other) & problem.judgeable != 0)
    };
    let of = |(effect, alternatives): (&Effect, Option<Alternatives>)| {
        let mut tied = Vec::new();
        let mut loss = 0.0;
        if let Some(Alternatives { without, instead, .. }) = alternatives {
            loss = without.cost(problem) - best.cost(problem);
            let tie = constants::tie().max(constants::tie_of_gain() * loss);
            let as_good = instead.iter().filter(|fit| penalised_cost(problem, fit) < cost + tie);
            for other in as_good.filter_map(|fit| fit.hypothesis.effects.last().copied()) {
                if other != *effect && !tied.contains(&other) {
                    tied.push(other);
                }
            }
        }
        // What no log tells from an effect that fits as well, no log tells from the cause.
        let structural = tied.iter().chain([effect]).flat_map(|tied| tied.structural_ties());
        let alike: Vec<Effect> = structural.chain(untried(*effect)).filter(|other| other != effect).collect();
        for other in alike {
            if !tied.contains(&other) && !best.hypothesis.effects.contains(&other) {
                tied.push(other);
            }
        }
        (tied, loss)
    };
    best.hypothesis.effects.iter().zip(all).map(of).unzip()
}
