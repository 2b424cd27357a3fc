//! Backward elimination: causes that the others make needless.

use super::penalty::{required_gain, shortfall};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use plant_model::Effect;
use rayon::prelude::*;

/// Backward elimination: removes the most dispensable cause, one at a time, while its removal costs less than the
/// required gain.
pub(crate) fn prune(problem: &Problem<'_>, mut fit: Fit) -> Fit {
    loop {
        if fit.hypothesis.effects.is_empty() {
            return fit;
        }
        let needless = fit.hypothesis.effects.par_iter().filter_map(|effect| {
            let smaller = refit_without(problem, &fit, *effect)?;
            let shortfall = shortfall(problem, &fit, &smaller, *effect);
            (shortfall >= 0.0).then_some((shortfall, smaller))
        });
        match needless.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, smaller)) => fit = smaller,
            None => return fit,
        }
    }
}

/// The fit without one of its causes, everything else fitted anew.
pub(crate) fn refit_without(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let smaller = fit.hypothesis.without(effect, problem.nominal);
    let goal = fit.cost(problem) + required_gain(problem, fit, effect);
    problem.fit_and_search(smaller, effects::channels(effect), constants::iterations(), goal)
}
