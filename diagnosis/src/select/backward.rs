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

/// Backward elimination: removes the most dispensable cause, one at a time, while its removal costs less than the
/// required gain.
pub(crate) fn prune(problem: &Problem<'_>, mut fit: Fit) -> Pruned {
    loop {
        let mut without = without_each(problem, &fit);
        let shortfall = |(place, smaller): (usize, &Option<Fit>)| {
            let shortfall = shortfall(problem, &fit, smaller.as_ref()?, fit.hypothesis.effects[place]);
            (shortfall >= 0.0).then_some((shortfall, place))
        };
        let needless = without.par_iter().enumerate().filter_map(shortfall).max_by(|a, b| a.0.total_cmp(&b.0));
        match needless.and_then(|(_, place)| without[place].take()) {
            Some(smaller) => fit = smaller,
            None => return Pruned { fit, without },
        }
    }
}

/// For each cause of a fit: the fit without it.
pub(crate) fn without_each(problem: &Problem<'_>, fit: &Fit) -> Vec<Option<Fit>> {
    fit.hypothesis.effects.par_iter().map(|effect| refit_without(problem, fit, *effect)).collect()
}

/// The fit without one of its causes, everything else fitted anew.
pub(crate) fn refit_without(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let smaller = fit.hypothesis.without(effect, problem.nominal);
    let goal = fit.cost(problem) + required_gain(problem, fit, effect);
    problem.fit_and_search(smaller, effects::channels(effect), constants::iterations(), goal)
}
