//! Backward elimination: causes that the others make needless.

use super::penalty::{required_gain, shortfall};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use plant_model::Effect;
use rayon::prelude::*;

/// What backward elimination leaves.
pub(crate) struct Pruned {
    pub(crate) fit: Fit,
    /// For each cause, in the order of the fit's effects: the fit without it, by which it was found needed.
    pub(crate) without: Vec<Option<Fit>>,
}

/// Errors of one kind in both pressure sensors: together they change next to nothing of flow and force, so that each alone seems needed.
const COMPENSATING: [[Effect; 2]; 2] =
    [[Effect::PressureAGain, Effect::PressureBGain], [Effect::PressureAOffset, Effect::PressureBOffset]];

/// Backward elimination: removes the most dispensable cause, one at a time, while its removal costs less than the
/// required gain; and two that compensate each other, while the removal of both does.
pub(crate) fn prune(problem: &Problem<'_>, fit: Fit) -> Pruned {
    let mut pruned = prune_before(problem, fit, 0);
    for pair in COMPENSATING {
        if let Some(smaller) = without_both(problem, &pruned.fit, pair) {
            pruned = prune_before(problem, smaller, 0);
        }
    }
    pruned
}

/// The same among a fit's earlier causes: the last one was just added because it gains enough.
pub(crate) fn prune_earlier(problem: &Problem<'_>, fit: Fit) -> Fit {
    prune_before(problem, fit, 1).fit
}

/// Backward elimination that spares the last causes.
fn prune_before(problem: &Problem<'_>, mut fit: Fit, spared: usize) -> Pruned {
    loop {
        let effects = &fit.hypothesis.effects;
        let mut without = without_each(problem, &fit, &effects[..effects.len().saturating_sub(spared)]);
        let shortfall = |(place, smaller): (usize, &Option<Fit>)| {
            let shortfall = shortfall(problem, &fit, smaller.as_ref()?, effects[place]);
            (shortfall >= 0.0).then_some((shortfall, place))
        };
        let needless = without.par_iter().enumerate().filter_map(shortfall).max_by(|a, b| a.0.total_cmp(&b.0));
        match needless.and_then(|(_, place)| without[place].take()) {
            Some(smaller) => fit = smaller,
            None => return Pruned { fit, without },
        }
    }
}

impl Pruned {
    /// A fit whose causes all stay, with the fits without each of them.
    pub(crate) fn as_it_is(problem: &Problem<'_>, fit: Fit) -> Self {
        Self { without: without_each(problem, &fit, &fit.hypothesis.effects), fit }
    }
}

/// For each of some causes of a fit: the fit without it.
fn without_each(problem: &Problem<'_>, fit: &Fit, effects: &[Effect]) -> Vec<Option<Fit>> {
    effects.par_iter().map(|effect| refit_without(problem, fit, *effect)).collect()
}

/// The fit without two of its causes, if both together gain less over it than is required of them.
fn without_both(problem: &Problem<'_>, fit: &Fit, pair: [Effect; 2]) -> Option<Fit> {
    if !pair.iter().all(|effect| fit.hypothesis.effects.contains(effect)) {
        return None;
    }
    let [one, other] = pair;
    let smaller = fit.hypothesis.without(one, problem.nominal).without(other, problem.nominal);
    let allowed = required_gain(problem, fit, one) + required_gain(problem, fit, other);
    let goal = fit.cost(problem) + allowed;
    let changed = effects::channels(one) | effects::channels(other);
    let smaller = problem.fit_and_search(smaller, changed, constants::iterations(), goal)?;
    (smaller.cost(problem) <= goal).then_some(smaller)
}

/// The fit without one of its causes, everything else fitted anew.
pub(crate) fn refit_without(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let smaller = fit.hypothesis.without(effect, problem.nominal);
    let goal = fit.cost(problem) + required_gain(problem, fit, effect);
    problem.fit_and_search(smaller, effects::channels(effect), constants::iterations(), goal)
}
