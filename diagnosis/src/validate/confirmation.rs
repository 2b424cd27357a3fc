//! Whether the part of the log held back confirms the causes found on the rest.

use super::hold_out;
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::outcome::PerChannel;
use crate::select::search::Found;

/// Whether the causes, as fitted, also lower the misfit of the part of the log that took no part in the fit.
pub(crate) fn confirmed_on_hold_out(problem: &Problem<'_>, found: &Found) -> bool {
    let held = problem.held_back();
    if held.stretches.is_empty() || found.best.hypothesis.effects.is_empty() {
        return true;
    }
    let cost = |fit: &Fit| held.evaluate_as_is(fit.hypothesis.clone()).map(|f| f.cost(&held));
    match (cost(&found.null), cost(&found.best)) {
        (Some(null), Some(best)) => {
            let plain = null - best > constants::plain_gain() * held.noise_cost(held.judgeable);
            best < null
                && predicts_no_worse(
                    problem,
                    found,
                    if plain { constants::little_worse() } else { constants::no_worse() },
                )
        }
        _ => false,
    }
}

/// Whether the squared errors of the whole model, restarted on the part held back, grow by less than the factor
/// `growth` when the causes are added. They grow more with causes that only fit noise of a balance.
fn predicts_no_worse(problem: &Problem<'_>, found: &Found, growth: f64) -> bool {
    let extended = |fit: &Fit| {
        let (h, values) = (&fit.hypothesis, &fit.hypothesis.values);
        (h.rig(problem.rig, values), h.supply_sensor_pa(values))
    };
    let [(null, by_null), (best, by_best)] = [extended(&found.null), extended(&found.best)];
    let models = hold_out::Comparison::new(problem.record, (&null, by_null), (&best, by_best));
    let Some((gain, _)) = models.and_then(|models| models.gain(hold_out::HORIZON_S)) else { return true };
    let error = |of: &PerChannel| of.over(&gain.holdout.noise_floor).map(|ratio| ratio.powi(2)).sum::<f64>();
    error(&gain.holdout.extended_rmse) < growth * error(&gain.holdout.baseline_rmse)
}
