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
    let by_tolerances = found.without.get(index).and_then(Option::as_ref).filter(|without| {
        without.prior_cost - found.best.prior_cost
            > TOLD_BY_TOLERANCES * (without.cost(problem) - found.best.cost(problem))
    });
    let without = match by_tolerances {
        Some(without) => strain([without, &found.best].map(farthest_off)),
        None => growth(loss / cost),
    };
    Cause {
        id: effect.id().to_string(),
        parameters: parameters(problem, fit, effect),
        ties: found.ties.get(index).map(|t| t.iter().map(|e| e.id().to_string()).collect()).unwrap_or_default(),
        evidence: format!("{}; {}.", effect.evidence(&values), without),
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

/// A cause without which tolerances account for more than this part of the loss is told by them, and not by misfit.
const TOLD_BY_TOLERANCES: f64 = 0.5;

/// How many tolerances the nominal value that is farthest off is off.
fn farthest_off(fit: &Fit) -> f64 {
    let pairs = fit.hypothesis.parameters.iter().zip(&fit.hypothesis.values);
    let off = pairs.filter_map(|(p, value)| Some(p.tolerances_off(*value)?.abs()));
    off.fold(0.0, f64::max)
}

/// What the log says without a cause; `growth` is the relative growth of the misfit.
fn growth(growth: f64) -> String {
    let grows = if growth < 1.0 {
        format!("grows by {:.1} %", 100.0 * growth)
    } else {
        format!("is {:.1} times as large", 1.0 + growth)
    };
    format!("without it the misfit of the fitted part of the log {grows}")
}

/// The same where the rig file says it: by so many tolerances its values are off at most, without the cause and with it.
fn strain([without, with]: [f64; 2]) -> String {
    format!(
        "without it the log is fitted nearly as well, but values of the rig file are off by up to {without:.1} of their tolerances, \
         with it by {with:.1}"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_cause_explains_is_told_by_misfit_or_by_what_tolerances_say_without_it() {
        assert_eq!(growth(0.123), "without it the misfit of the fitted part of the log grows by 12.3 %");
        assert_eq!(growth(1.5), "without it the misfit of the fitted part of the log is 2.5 times as large");
        let words = strain([3.96, 1.04]);
        assert!(words.ends_with("are off by up to 4.0 of their tolerances, with it by 1.0"), "{words}");
    }
}
