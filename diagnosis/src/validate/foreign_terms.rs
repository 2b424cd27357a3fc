//! Beyond the catalogue: a sparse regression that describes what a balance still lacks.
//!
//! Terms of the library are added to the hypothesis one at a time, highest score first, and fitted together with
//! everything else, as long as each gains enough. The result is a description, never a name. It also tests the names: a
//! cause that such a term makes needless had only compensated for what the catalogue lacks.

use crate::balances::term_library::Term;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;
use crate::outcome::{Description, MissingTerm};
use crate::select::backward;
use plant_model::Effect;

/// A hypothesis with terms added.
pub(crate) struct Extended {
    pub(crate) fit: Fit,
    /// Their places in the library, in the order found.
    pub(crate) terms: Vec<usize>,
}

/// Adds the terms that the balances in `where_` lack, `most` of them.
pub(crate) fn extend(problem: &Problem<'_>, from: &Fit, where_: Channels, most: usize) -> Extended {
    let mut out = Extended { fit: from.clone(), terms: Vec::new() };
    // Scores and first steps on a part of the data, as for the candidates of the catalogue.
    let (subset, ratio) = problem.subset();
    while out.terms.len() < most {
        let open: Vec<usize> = (0..problem.terms.len())
            .filter(|index| !out.terms.contains(index) && problem.terms[*index].channels & where_ != 0)
            .collect();
        let candidates: Vec<Hypothesis> =
            open.iter().map(|index| out.fit.hypothesis.with_term(*index, problem.terms[*index].channels)).collect();
        let Some(slopes) = subset.jacobian(&out.fit) else { break };
        let scores = subset.scores(&out.fit, &slopes, &candidates);
        let highest = (0..open.len()).max_by(|a, b| scores[*a].total_cmp(&scores[*b]));
        let Some(k) = highest.filter(|k| ratio * scores[*k] > 0.5 * constants::term_gain()) else { break };
        let channels = problem.terms[open[k]].channels;
        let begun = subset.first_steps(candidates[k].clone(), channels, constants::first_iterations(), &slopes);
        let Some(begun) = begun else { break };
        let fitted = problem.fit_and_search(begun.hypothesis, channels, constants::iterations(), f64::INFINITY);
        let Some(fit) = fitted else { break };
        let gained = out.fit.cost(problem) - fit.cost(problem);
        if gained < constants::term_gain() {
            break;
        }
        out.fit = fit;
        out.terms.push(open[k]);
    }
    out
}

/// The causes that the terms make needless: they had only compensated for what the catalogue lacks.
pub(crate) fn superseded(problem: &Problem<'_>, extended: &Extended) -> Vec<Effect> {
    let kept = backward::prune(problem, extended.fit.clone()).fit.hypothesis.effects;
    extended.fit.hypothesis.effects.iter().copied().filter(|e| !kept.contains(e)).collect()
}

/// The fit of a single term that explains the log plainly better than a cause, in its place: of two descriptions alike the catalogue's
/// counts, but not where physics outside it fits better. `without`: the best fit without the cause.
pub(crate) fn replacing(problem: &Problem<'_>, best: &Fit, effect: Effect, without: &Fit) -> Option<Fit> {
    let other = extend(problem, without, effects::channels(effect), 1);
    let better = !other.terms.is_empty() && other.fit.cost(problem) < best.cost(problem) - constants::term_gain();
    better.then_some(other.fit)
}

/// Words and figures for the terms added to `from` that hold on `held`, the part of the log held back: those that take at least
/// [`constants::least_term`] of what would be left there without them, in the balances they act on, the largest first.
pub(crate) fn describe(problem: &Problem<'_>, held: &Problem<'_>, from: &Fit, extended: Extended) -> Description {
    let Extended { fit, terms } = extended;
    let fit = problem.with_errors(fit);
    let touched = terms.iter().fold(0, |all, index| all | problem.terms[*index].channels);
    let on_held = |hypothesis: &Hypothesis| held.evaluate_as_is(hypothesis.clone());
    let with_all = on_held(&fit.hypothesis);
    let taken = |without: &Hypothesis, channels: Channels| {
        let cost = |fit: Option<&Fit>| fit.map_or(f64::NAN, |fit| fit.cost_in(held, channels));
        1.0 - cost(with_all.as_ref()) / cost(on_held(without).as_ref())
    };
    let share = |place: usize, term: &Term| {
        let mut without = fit.hypothesis.clone();
        without.values[place] = 0.0;
        taken(&without, term.channels)
    };
    let found = fit.hypothesis.parameters.iter().enumerate().filter_map(|(place, parameter)| match parameter.slot {
        Slot::Term(index) => Some((place, &problem.terms[index], share(place, &problem.terms[index]))),
        _ => None,
    });
    // Where nothing is held back the share is not known.
    let holds = |share: f64| share.is_nan() || share >= constants::least_term();
    let mut found: Vec<_> = found.filter(|(.., share)| holds(*share)).collect();
    found.sort_by(|(.., a), (.., b)| b.total_cmp(a));
    let missing = found.into_iter().map(|(place, term, _)| MissingTerm {
        channels: Channel::ALL.into_iter().filter(|c| term.channels & c.bit() != 0).collect(),
        words: term.words,
        formula: term.formula.clone(),
        factor: fit.hypothesis.values[place],
        std_error: fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)].max(0.0).sqrt()),
    });
    Description { terms: missing.collect(), holdout_share: taken(&from.hypothesis, touched) }
}
