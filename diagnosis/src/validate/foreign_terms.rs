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
/// [`constants::least_term`] of what would be left there without them, in the balances they act on, and are as [sure](constants::sure)
/// as a cause, the largest first.
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
    let error = |place: usize| fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)].max(0.0).sqrt());
    // A factor that its errors hide says that other values do the same.
    let unsure = |place: usize| fit.hypothesis.values[place].abs() < constants::sure() * error(place);
    let found = fit.hypothesis.parameters.iter().enumerate().filter_map(|(place, parameter)| match parameter.slot {
        Slot::Term(index) if !unsure(place) => {
            Some((place, &problem.terms[index], share(place, &problem.terms[index])))
        }
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
        std_error: error(place),
    });
    Description { terms: missing.collect(), holdout_share: taken(&from.hypothesis, touched) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::balances::term_library::library;
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::nominal::nominal_parameters;
    use plant_model::{Effects, Plant};
    use rig_files::RigFile;

    #[test]
    fn a_term_of_which_only_a_sum_with_another_is_known_is_no_description() {
        let rig = RigFile::paper_c();
        let hidden = Effects::none().with(Effect::ViscousFriction, &[3.0 * rig.rig.friction.viscous_n_s_per_m]);
        let mut log = simulated(&rig, &hidden, 12_000, |t_s| 1.5 * (3.0 * t_s).sin() + 0.8 * (11.0 * t_s).sin());
        add_noise(&mut log, 5.0e-6, 100.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let plant = Plant::new(&rig.rig, &rig.effects).expect("a sound rig");
        let terms = library(&record, &plant, judgeable);
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let problem = Problem { terms: &terms, ..problem };
        let null = problem.evaluate_as_is(Hypothesis::null(&nominal)).expect("a sound rig");
        let once = extend(&problem, &null, Channel::Position.bit(), 1);
        let [index] = once.terms[..] else { panic!("{:?}", once.terms) };
        let both = once.fit.hypothesis.with_term(index, problem.terms[index].channels);
        let twice = Extended { fit: problem.evaluate_as_is(both).expect("a sound rig"), terms: vec![index; 2] };
        let told = |extended: Extended| describe(&problem, &problem.held_back(), &null, extended).terms.len();
        assert_eq!([once, twice].map(told), [1, 0]);
    }
}
