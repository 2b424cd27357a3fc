//! Whether the part of the log held back confirms the causes found on the rest.

use super::hold_out::{HORIZON_S, Predictions};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::outcome::PerChannel;
use crate::select::penalty::required_gain;
use crate::select::search::Found;

/// Whether the causes together, as fitted, lower the misfit of the part of the log that took no part in the fit, and predict it
/// no worse. By data alone: priors know nothing of that part. True where nothing was held back. `predictions`: of the best fit.
pub(crate) fn confirmed_together(problem: &Problem<'_>, found: &Found, predictions: Option<&Predictions<'_>>) -> bool {
    let held = problem.held_back();
    let effects = &found.best.hypothesis.effects;
    if held.stretches.is_empty() || effects.is_empty() {
        return true;
    }
    let Some(best) = data_cost(&held, &found.best.hypothesis) else { return false };
    // Where all causes act only on a part of the stroke that the part held back does not reach, nothing there can tell.
    if (0..effects.len()).all(|place| needs_no_confirmation(problem, &held, found, best, place)) {
        return true;
    }
    let Some(null) = data_cost(&held, &found.null.hypothesis) else { return false };
    let plain = null - best > constants::plain_gain() * held.noise_cost(held.judgeable);
    let growth = match (plain, relieves_nominal_values(&found.null, &found.best)) {
        (true, _) => constants::little_worse(),
        (false, true) => constants::no_worse(),
        (false, false) => 1.0,
    };
    best < null + allowance(&found.null, &found.best)
        && predictions.is_none_or(|predictions| predicts_no_worse(problem, (&found.null, predictions), plain, growth))
}

/// For each cause: whether the part held back is told better with it than without it, everything else fitted anew on the rest.
pub(crate) fn confirmed_singly(problem: &Problem<'_>, found: &Found) -> Vec<bool> {
    let held = problem.held_back();
    if held.stretches.is_empty() {
        return vec![true; found.best.hypothesis.effects.len()];
    }
    let Some(best) = data_cost(&held, &found.best.hypothesis) else { return vec![false; found.without.len()] };
    let better = |(place, without): (usize, &Option<Fit>)| {
        without.as_ref().is_none_or(|without| {
            data_cost(&held, &without.hypothesis).is_some_and(|cost| best < cost + allowance(without, &found.best))
        }) || needs_no_confirmation(problem, &held, found, best, place)
    };
    found.without.iter().enumerate().map(better).collect()
}

/// Whether the part held back shows nothing at all of a cause, because that acts on a part of the stroke only, and the rest of
/// the log leaves no doubt about it. `best`: what the part held back costs with all causes.
fn needs_no_confirmation(problem: &Problem<'_>, held: &Problem<'_>, found: &Found, best: f64, place: usize) -> bool {
    let Some(effect) = found.best.hypothesis.effects.get(place).filter(|e| e.identification().acts_locally) else {
        return false;
    };
    let Some(Some(without)) = found.without.get(place) else { return false };
    let gained = without.cost(problem) - found.best.cost(problem);
    gained > constants::beyond_doubt() * required_gain(problem, &found.best, *effect)
        && data_cost(held, &found.best.hypothesis.without(*effect, &[]))
            .is_some_and(|cost| (cost - best).abs() < 1.0e-6)
}

/// By how much the part held back may be told worse with a cause than without it. A cause for which several nominal values
/// would otherwise have to be far off, all at once, need not show in data beside them: it must not be refuted by them.
fn allowance(without: &Fit, with: &Fit) -> f64 {
    if relieves_nominal_values(without, with) { constants::likelier() } else { 0.0 }
}

/// Whether nominal values would have to be far off, all at once, without the causes.
fn relieves_nominal_values(without: &Fit, with: &Fit) -> bool {
    without.prior_cost - with.prior_cost > constants::penalty_per_cause()
}

/// Minus the log-likelihood of a hypothesis on some data, without priors.
pub(crate) fn data_cost(on: &Problem<'_>, hypothesis: &Hypothesis) -> Option<f64> {
    let fit = on.evaluate_as_is(hypothesis.clone())?;
    Some(fit.cost_in(on, on.judgeable))
}

/// Whether the squared errors of the whole model, restarted on the part held back, grow by no more than the factor
/// `growth` when the causes are added. They grow more with causes that only fit noise of a balance: not so where the balances
/// gain plainly, and then a model that predicts as well as it can is not refuted by one whose nominal values happen to do better.
fn predicts_no_worse(problem: &Problem<'_>, (null, best): (&Fit, &Predictions<'_>), plain: bool, growth: f64) -> bool {
    let Some((gain, _)) = best.gain(problem, Some(null), HORIZON_S) else { return true };
    let error = |of: &PerChannel| beyond_floor(of, &gain.holdout.noise_floor);
    plain && gain.closed() || error(&gain.holdout.extended_rmse) <= growth * error(&gain.holdout.baseline_rmse)
}

/// The sum of squared errors over those that noise makes of a perfect model's predictions. Errors within that floor are alike:
/// which of two models comes closer there is chance.
pub(crate) fn beyond_floor(errors: &PerChannel, floor: &PerChannel) -> f64 {
    errors.over(floor).map(|ratio| if ratio.is_nan() { f64::INFINITY } else { ratio.max(1.0).powi(2) }).sum()
}
