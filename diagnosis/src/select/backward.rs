//! Backward elimination: causes that the others make needless.

use super::penalty::{gate, negligible, wanting};
use crate::estimate::optimiser::ITERATIONS;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use plant_model::Effect;
use rayon::prelude::*;

/// A cause that gains this many times what it must is there whatever its standard error.
pub(crate) const BEYOND_DOUBT: f64 = 10.0;
/// So many extensions are pruned to the end, most likely first.
pub(crate) const MOST_PRUNED: usize = 2;

/// Takes out every cause whose removal costs less than its charge.
pub(crate) fn prune(problem: &Problem<'_>, mut fit: Fit) -> Fit {
    let (thinned, _) = problem.thinned();
    loop {
        if fit.hypothesis.effects.is_empty() {
            return fit;
        }
        let base = thinned.judge(fit.hypothesis.clone());
        let needless = fit.hypothesis.effects.par_iter().filter_map(|effect| {
            if base.as_ref().is_some_and(|base| needed(&thinned, base, *effect)) {
                return None;
            }
            let smaller = refit_without(problem, &fit, *effect)?;
            let wanting = wanting(problem, &fit, &smaller, *effect);
            (wanting >= 0.0).then_some((wanting, smaller))
        });
        match needless.max_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((_, smaller)) => fit = smaller,
            None => return fit,
        }
    }
}

/// The fit without one of its causes.
pub(crate) fn refit_without(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let smaller = fit.hypothesis.without(effect, problem.nominal);
    let goal = fit.cost(problem) + gate(problem, fit, effect);
    problem.settle(smaller, effects::channels(effect), ITERATIONS, goal)
}

/// Whether a part of the data shows already, beyond doubt, that a fit needs a cause.
fn needed(thinned: &Problem<'_>, fit: &Fit, effect: Effect) -> bool {
    if negligible(fit, effect) {
        return false;
    }
    let least = BEYOND_DOUBT * gate(thinned, fit, effect);
    let smaller = fit.hypothesis.without(effect, thinned.nominal);
    let without = thinned.settle(smaller, effects::channels(effect), ITERATIONS, fit.cost(thinned) + least);
    without.is_some_and(|without| without.cost(thinned) - fit.cost(thinned) > least)
}
