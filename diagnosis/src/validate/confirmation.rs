//! Whether the part of the log held back confirms the causes found on the rest.

use super::hold_out;
use crate::estimate::problem::{Fit, Problem};
use crate::outcome::PerChannel;
use crate::select::search::Found;

/// Predictions on the part held back count as no worse while their squared errors grow by no more than this; by no more
/// than the second where the balances there gain this part of what noise costs them.
const NO_WORSE: f64 = 1.01;
const LITTLE_WORSE: f64 = 1.1;
const PLAIN_GAIN: f64 = 0.1;

/// Whether the causes, as fitted, also lower the misfit of the part of the log that took no part in the fit.
pub(crate) fn confirmed_on_hold_out(problem: &Problem<'_>, found: &Found) -> bool {
    let held = problem.held_back();
    if held.stretches.is_empty() || found.best.hypothesis.effects.is_empty() {
        return true;
    }
    let cost = |fit: &Fit| held.judge(fit.hypothesis.clone()).map(|f| f.cost(&held));
    match (cost(&found.null), cost(&found.best)) {
        (Some(null), Some(best)) => {
            let plain = null - best > PLAIN_GAIN * held.noise_cost(held.judgeable);
            best < null && predicts_no_worse(problem, found, if plain { LITTLE_WORSE } else { NO_WORSE })
        }
        _ => false,
    }
}

/// Whether the whole model, restarted on the part held back, predicts no worse with the causes than without, but for a
/// growth of its squared errors. What merely soaks up noise in a balance does.
fn predicts_no_worse(problem: &Problem<'_>, found: &Found, growth: f64) -> bool {
    let extended = |fit: &Fit| fit.hypothesis.rig(problem.rig, &fit.hypothesis.values);
    let models = hold_out::Comparison::new(problem.record, &extended(&found.null), &extended(&found.best));
    let Some((gain, _)) = models.and_then(|models| models.gain(hold_out::HORIZON_S)) else { return true };
    let error = |of: &PerChannel| of.over(&gain.holdout.noise_floor).map(|ratio| ratio.powi(2)).sum::<f64>();
    error(&gain.holdout.extended_rmse) < growth * error(&gain.holdout.baseline_rmse)
}
