//! A cause as the report names it: values with standard errors, ties, evidence, share of the gap.

use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::parameter::Slot;
use crate::outcome::{Cause, Estimate};
use crate::select::search::Found;
use plant_model::Effect;

/// The cause that stands at a place among the best fit's effects, with its values in `fit`: the best, or the same without what is
/// not proven.
pub(crate) fn cause(problem: &Problem<'_>, found: &Found, fit: &Fit, index: usize) -> Cause {
    let effect = found.best.hypothesis.effects[index];
    let values = fit.hypothesis.values_of(effect);
    let loss = found.losses.get(index).copied().unwrap_or(0.0);
    let cost = found.best.cost(problem).max(1.0);
    let gap = (found.null.cost(problem) - found.best.cost(problem)).max(1.0);
    Cause {
        id: effect.id().to_string(),
        parameters: parameters(problem, fit, effect),
        ties: found.ties.get(index).map(|t| t.iter().map(|e| e.id().to_string()).collect()).unwrap_or_default(),
        evidence: evidence(effect, &values, loss / cost),
        share: (loss / gap).clamp(0.0, 1.0),
    }
}

/// The fitted values of an effect with their standard errors.
pub(crate) fn parameters(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Vec<Estimate> {
    let mut out = Vec::new();
    for (place, parameter) in fit.hypothesis.parameters.iter().enumerate() {
        if let Slot::Effect(e, k) = parameter.slot
            && e == effect
        {
            let value = fit.hypothesis.values[place];
            let variance = fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)]);
            let inherited = value * effects::inherited(effect, problem.nominal);
            let std_error = if variance.is_finite() { variance.max(0.0).sqrt().hypot(inherited) } else { f64::NAN };
            out.push(Estimate { name: effect.info().parameters[k].name.to_string(), value, std_error });
        }
    }
    out
}

/// One sentence that names the quantity a technician can check; `growth` is the relative growth of the misfit without
/// the effect.
fn evidence(effect: Effect, values: &[f64], growth: f64) -> String {
    let finding = effect.evidence(values);
    let grows = if growth < 1.0 {
        format!("grows by {:.1} %", 100.0 * growth)
    } else {
        format!("is {:.1} times as large", 1.0 + growth)
    };
    format!("{finding}; without it the misfit of the fitted part of the log {grows}.")
}
