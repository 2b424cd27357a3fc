//! The last simplification: causes whose parameters may as well be neutral, and halves of effects that are not needed.

use super::backward::refit_without;
use super::exchange::Alternatives;
use super::penalty::{negligible, required_gain, uncertain};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use plant_model::Effect;

/// Leaves out causes whose parameters may as well be neutral: they soak up noise. What is left has standard errors.
pub(crate) fn drop_uncertain(
    problem: &Problem<'_>,
    mut best: Fit,
    mut alternatives: Vec<Option<Alternatives>>,
) -> (Fit, Vec<Option<Alternatives>>) {
    loop {
        best = problem.with_errors(best);
        let place = best.hypothesis.effects.iter().position(|effect| uncertain(&best, *effect));
        let Some(place) = place else { return (best, alternatives) };
        let effect = best.hypothesis.effects[place];
        let smaller = refit_without(problem, &best, effect);
        // Far beyond doubt, it is the standard error that is wrong.
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

/// Leaves out the half of position-dependent friction that the log does not ask for: a slope along the stroke and a
/// ripple of a long wavelength are nearly the same.
pub(crate) fn drop_needless_half(problem: &Problem<'_>, best: Fit) -> Fit {
    const EFFECT: Effect = Effect::FrictionPosition;
    if !best.hypothesis.effects.contains(&EFFECT) {
        return best;
    }
    let halves: [&[usize]; 2] = [&[0], &[1, 2]];
    let penalised_cost =
        |fit: &Fit| fit.cost(problem) + constants::penalty_per_parameter() * fit.hypothesis.parameters.len() as f64;
    let fits =
        halves.into_iter().filter_map(|kept| problem.fit(best.hypothesis.only(EFFECT, kept), constants::iterations()));
    let least =
        fits.filter(|fit| !negligible(fit, EFFECT)).min_by(|a, b| penalised_cost(a).total_cmp(&penalised_cost(b)));
    match least {
        Some(fit) if penalised_cost(&fit) <= penalised_cost(&best) => fit,
        _ => best,
    }
}
