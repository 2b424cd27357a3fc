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
use plant_model::Effect;

/// The effects that the fit of all everyday ones finds away from neutral, pruned on a part of the log and fitted to all data; `None`
/// unless they close the balances of the chambers on that part. The present causes that are no everyday effects stay beside them:
/// without a friction that changes along the stroke, say, everything else would bend to take its place.
pub(crate) fn screened(problem: &Problem<'_>, nominal: &Hypothesis, current: &Fit) -> Option<Fit> {
    let (subset, _) = problem.subset();
    let is_beside = |effect: &Effect| !everyday::is_everyday(problem, *effect);
    let beside = current.hypothesis.effects.iter().copied().filter(is_beside);
    let from = beside.fold(nominal.clone(), |from, effect| extended(problem, from, effect, &current.hypothesis));
    let all = subset.with_errors(everyday::fitted(&subset, from)?);
    let mut found = all.hypothesis.effects.clone();
    found.sort_by(|a, b| standard_errors_away(&all, *b).total_cmp(&standard_errors_away(&all, *a)));
    found.retain(|effect| is_beside(effect) || standard_errors_away(&all, *effect) > constants::sure());
    found.truncate(constants::most_screened());
    if found.is_empty() {
        return None;
    }
    let begun =
        found.into_iter().fold(nominal.clone(), |begun, effect| extended(problem, begun, effect, &all.hypothesis));
    let begun = subset.refit(begun, subset.judgeable, constants::iterations())?;
    if open_chambers(&subset, &begun) {
        return None;
    }
    problem.fit(prune(&subset, begun).fit.hypothesis, constants::iterations())
}

/// A hypothesis with one more effect, its parameters as another has them.
fn extended(problem: &Problem<'_>, hypothesis: Hypothesis, effect: Effect, as_in: &Hypothesis) -> Hypothesis {
    let parameters = problem.parameters(effect);
    let at = |index: usize, neutral: f64| as_in.value(Slot::Effect(effect, index)).unwrap_or(neutral);
    let start: Vec<f64> = parameters.iter().enumerate().map(|(index, p)| at(index, p.neutral)).collect();
    hypothesis.extended_by(effect, parameters, &start)
}
