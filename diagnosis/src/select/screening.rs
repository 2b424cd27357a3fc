//! Screening: which effects a rig has, told by the fit of all everyday ones at once.
//!
//! Two errors of one sensor, or of two, look like another effect to forward selection, which sees one cause at a time. Fitted
//! together each has its own trace. The fit is too rough for names: it is made on a part of the log, with priors. It only
//! tells where a search may begin.

use super::backward::prune;
use super::everyday;
use super::penalty::{open_chambers, standard_errors_away};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;

/// The effects that the fit of all everyday ones finds away from neutral, pruned there and fitted to all data; `None` unless they close
/// the balances of the chambers on a part of it.
pub(crate) fn screened(problem: &Problem<'_>, nominal: &Hypothesis) -> Option<Fit> {
    let (subset, _) = problem.subset();
    let all = subset.with_errors(everyday::fitted(&subset, nominal.clone())?);
    let mut found = all.hypothesis.effects.clone();
    found.sort_by(|a, b| standard_errors_away(&all, *b).total_cmp(&standard_errors_away(&all, *a)));
    found.retain(|effect| standard_errors_away(&all, *effect) > constants::sure());
    found.truncate(constants::most_screened());
    if found.is_empty() {
        return None;
    }
    let begun = found.into_iter().fold(nominal.clone(), |begun, effect| {
        let parameters = problem.parameters(effect);
        let at = |index: usize, neutral: f64| all.hypothesis.value(Slot::Effect(effect, index)).unwrap_or(neutral);
        let start: Vec<f64> = parameters.iter().enumerate().map(|(index, p)| at(index, p.neutral)).collect();
        begun.extended_by(effect, parameters, &start)
    });
    let begun = subset.fit(begun, constants::iterations())?;
    if open_chambers(&subset, &begun) {
        return None;
    }
    problem.fit(prune(&subset, begun).fit.hypothesis, constants::iterations())
}
