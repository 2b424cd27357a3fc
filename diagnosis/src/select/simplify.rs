//! The last simplification: removes causes that may as well be neutral, and parts of effects that the log does not
//! need.

use super::backward::refit_without;
use super::exchange::{Alternatives, given_up};
use super::penalty::{negligible, required_gain, uncertain};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};

/// Removes causes within four standard errors of neutral: they only fit noise. Adds standard errors to what is left. Where names are
/// given up nothing is fitted to the end for them.
pub(crate) fn drop_uncertain(
    problem: &Problem<'_>,
    mut best: Fit,
    mut alternatives: Vec<Option<Alternatives>>,
) -> (Fit, Vec<Option<Alternatives>>) {
    if given_up(problem, &best) {
        return (problem.with_errors(best), alternatives);
    }
    loop {
        best = problem.with_errors(problem.down_its_valleys(best));
        let place = best.hypothesis.effects.iter().position(|effect| uncertain(&best, *effect));
        let Some(place) = place else { return (best, alternatives) };
        let effect = best.hypothesis.effects[place];
        let smaller = refit_without(problem, &best, effect);
        // A cause with a gain far above the required one stays: then the standard error is wrong, not the cause.
        let doubtful = |smaller: &Fit| {
            smaller.cost(problem) - best.cost(problem)
                < constants::beyond_doubt() * required_gain(problem, &best, effect)
        };
        let Some(smaller) = smaller.filter(doubtful) else { return (best, alternatives) };
        best = smaller;
        if place < alternatives.len() {
            alternatives.remove(place);
        }
    }
}

/// Removes needless parts of an effect that has several, such as slope and ripple of friction along the stroke: a slope
/// and a ripple of long wavelength are nearly the same.
pub(crate) fn drop_needless_parts(problem: &Problem<'_>, mut best: Fit) -> Fit {
    let penalised_cost =
        |fit: &Fit| fit.cost(problem) + constants::penalty_per_parameter() * fit.hypothesis.parameters.len() as f64;
    for effect in best.hypothesis.effects.clone() {
        let parts = effect.identification().parts.iter();
        let fits = parts.filter_map(|kept| problem.fit(best.hypothesis.only(effect, kept), constants::iterations()));
        let least =
            fits.filter(|fit| !negligible(fit, effect)).min_by(|a, b| penalised_cost(a).total_cmp(&penalised_cost(b)));
        if let Some(fit) = least
            && penalised_cost(&fit) <= penalised_cost(&best)
        {
            best = fit;
        }
    }
    best
}
