//! Forward selection of one more cause: candidates ranked by their score on a subset of the data, the best fitted to
//! all of it.

use super::first_steps::{Start, by_momentum, by_predictions, likeliest, may_be_held, promising};
use super::initial_values::initial_values;
use super::memory::{Explored, Memory, Tried};
use super::penalty::{beyond_noise, cost_before_pruning, penalty, required_gain};
use super::ripple_spectrum::wavelengths;
use super::scoring::Scoring;
use super::visibility::candidates;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::hypothesis::Hypothesis;
use plant_model::Effect;
use rayon::prelude::*;

/// A candidate effect with its initial values and its score: the gain predicted to first order.
pub(crate) struct Candidate {
    pub(crate) effect: Effect,
    pub(crate) starts: Vec<Vec<f64>>,
    pub(crate) predicted: f64,
}

/// The candidates for one more cause that acts on some channels, highest score first.
pub(crate) fn ranked_candidates(
    problem: &Problem<'_>,
    from: &Fit,
    scoring: &Scoring<'_>,
    acting: Channels,
) -> Vec<Candidate> {
    // Initial values of effects that are periodic along the stroke.
    let wavelengths_m = if acting & Channel::Position.bit() == 0 { Vec::new() } else { wavelengths(problem, from) };
    let open: Vec<(Effect, Vec<f64>)> = candidates(problem)
        .into_iter()
        .filter(|e| !from.hypothesis.effects.contains(e) && effects::channels(*e) & acting != 0)
        .flat_map(|e| initial_values(problem, e, &wavelengths_m).into_iter().map(move |start| (e, start)))
        .collect();
    let extended: Vec<Hypothesis> = open
        .iter()
        .map(|(effect, start)| {
            likeliest(problem, *effect, from.hypothesis.extended_by(*effect, problem.parameters(*effect), start))
        })
        .collect();
    let mut scores = scoring.subset().scores(from, &scoring.slopes, &extended);
    // Strained nominal values may compensate for a missing effect and lower its score. So the score is also taken with
    // them back at nominal, and the higher one counts.
    if let Some((fit, slopes)) = &scoring.relaxed {
        let strained = from.hypothesis.strained();
        let relieves =
            |k: &usize| effects::channels(open[*k].0) & strained != 0 && !effects::moves_nominal_values(open[*k].0);
        let relieving: Vec<usize> = (0..open.len()).filter(relieves).collect();
        let beside = |k: &usize| {
            let (effect, start) = &open[*k];
            fit.hypothesis.extended_by(*effect, problem.parameters(*effect), start)
        };
        let others = scoring.subset().scores(fit, slopes, &relieving.iter().map(beside).collect::<Vec<_>>());
        relieving.into_iter().zip(others).for_each(|(k, other)| scores[k] = scores[k].max(other));
    }
    scores.iter_mut().for_each(|score| *score *= scoring.ratio);
    // What acts on a part of the way only may act nowhere in the subset: there the gain of the initial values counts, in
    // the whole log. So it does of an effect that takes nominal values with it: tolerances alone may tell its value.
    let gain = |k: usize| {
        let started = problem.evaluate_as_is(extended[k].clone());
        (k, started.map_or(0.0, |started| (from.cost(problem) - started.cost(problem)).max(0.0)))
    };
    let gains = |of: Vec<usize>| -> Vec<(usize, f64)> { of.into_par_iter().map(gain).collect() };
    let those = |of: &dyn Fn(Effect) -> bool| (0..open.len()).filter(|k| of(open[*k].0)).collect::<Vec<_>>();
    for (k, gain) in gains(those(&|effect| effect.identification().acts_locally)) {
        scores[k] = scores[k].max(gain);
    }
    // Only those that gain in the subset, and of these the best: the whole log decides between them.
    let mut moving = those(&effects::moves_nominal_values);
    moving.retain(|k| scores[*k] > 0.0);
    moving.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    moving.truncate(constants::candidates_fitted());
    let moving = gains(moving);
    if let Some((best, gain)) = moving.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1)).filter(|best| best.1 > 0.0) {
        // It is fitted beside the one of highest score.
        let highest = moving.iter().map(|(k, _)| scores[*k]).fold(gain, f64::max);
        scores[best] = highest * (1.0 + f64::EPSILON);
    }
    let mut out: Vec<Candidate> = Vec::new();
    let mut order: Vec<usize> = (0..open.len()).collect();
    order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
    for index in order {
        let (effect, start) = &open[index];
        let predicted = scores[index];
        match out.iter_mut().find(|c| c.effect == *effect) {
            Some(candidate) if candidate.starts.len() < effect.identification().starts_fitted => {
                candidate.starts.push(start.clone())
            }
            Some(_) => {}
            None => out.push(Candidate { effect: *effect, starts: vec![start.clone()], predicted }),
        }
    }
    out.sort_by(|a, b| b.predicted.total_cmp(&a.predicted));
    out
}

/// Which additions to a fit are wanted.
pub(crate) struct Wanted {
    /// Channels: an addition acts on at least one of them.
    pub(crate) acting: Channels,
    /// How many are fitted.
    pub(crate) most: usize,
}

impl Wanted {
    /// Any effect.
    pub(crate) fn any(problem: &Problem<'_>) -> Self {
        Self { acting: problem.judgeable, most: constants::candidates_fitted() }
    }
}

/// The fits of a hypothesis with one more effect, for the candidates of highest score; lowest penalised cost first.
pub(crate) fn extensions(problem: &Problem<'_>, from: &Fit, wanted: &Wanted, memory: &mut Memory) -> Vec<Fit> {
    extended(problem, from, wanted, memory, false)
}

/// The same for what may take the place of a cause. Where the causes left were extended before, the candidates are those found then,
/// begun where they ended: what comes nearest to the cause is looked for from the cause itself.
pub(crate) fn rivals(problem: &Problem<'_>, from: &Fit, wanted: &Wanted, memory: &mut Memory) -> Vec<Fit> {
    extended(problem, from, wanted, memory, true)
}

/// Extensions as known, or explored; `goes_on`: from those of the same causes with other values, if there are any.
fn extended(problem: &Problem<'_>, from: &Fit, wanted: &Wanted, memory: &mut Memory, goes_on: bool) -> Vec<Fit> {
    let (explored, mut fits) = if let Some(known) = memory.extensions(problem, from, wanted.acting) {
        (known.acting, in_order(problem, known.fits.clone()))
    } else if let Some(begun) = memory.begun(from, wanted.acting).filter(|_| goes_on).cloned() {
        (begun.acting, go_on(problem, from, &begun.fits, &mut memory.tried))
    } else {
        (wanted.acting, explore(problem, from, wanted, &mut memory.tried))
    };
    memory.explored.push(Explored { from: from.clone(), acting: explored, fits: fits.clone() });
    let acts = |effect: &Effect| effects::channels(*effect) & wanted.acting != 0;
    fits.retain(|fit| fit.hypothesis.effects.last().is_some_and(acts));
    fits
}

/// Extensions that go on from those of the same causes with other values.
fn go_on(problem: &Problem<'_>, from: &Fit, begun: &[Fit], tried: &mut Vec<Tried>) -> Vec<Fit> {
    let base = from.cost(problem);
    let begin = |known: &Fit| {
        let fit = problem.evaluate_as_is(known.hypothesis.clone())?;
        if fit.cost(problem) < base {
            return Some(fit);
        }
        // Without the effect a better place was found since.
        let effect = *known.hypothesis.effects.last()?;
        let values = known.hypothesis.values_of(effect);
        problem.evaluate_as_is(from.hypothesis.extended_by(effect, problem.parameters(effect), &values))
    };
    noted(problem, finished(problem, begun.par_iter().filter_map(begin).collect(), base), tried)
}

/// Extensions, lowest penalised cost with the present dispersion first.
fn in_order(problem: &Problem<'_>, mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.sort_by(|a, b| cost_before_pruning(problem, a).total_cmp(&cost_before_pruning(problem, b)));
    fits
}

/// Extensions not yet known: scores, first iterations on a subset, full fits of the best.
fn explore(problem: &Problem<'_>, from: &Fit, wanted: &Wanted, tried: &mut Vec<Tried>) -> Vec<Fit> {
    let Some(scoring) = Scoring::new(problem, from) else { return Vec::new() };
    let mut candidates = ranked_candidates(problem, from, &scoring, wanted.acting);
    let base = from.cost(problem);
    let scores_enough = |c: &Candidate| c.predicted > constants::score_share() * required_gain(problem, from, c.effect);
    let mut count = candidates.iter().take_while(|c| scores_enough(c)).count().min(wanted.most);
    // Where nominal values are strained scores are not reliable; then all effects that act there are tried. A gap that tolerances hide
    // so far that it is like noise, at a price that no cause need save, is small enough for first order.
    let strained = from.hypothesis.strained();
    let least = candidates.iter().map(|c| penalty(c.effect)).fold(f64::INFINITY, f64::min);
    if strained != 0 && (beyond_noise(problem, from) || from.prior_cost > least) {
        // What relieves them need only exceed its penalty, as in `shortfall`.
        let relieves = |c: &Candidate| effects::moves_nominal_values(c.effect) && c.predicted > penalty(c.effect);
        candidates.sort_by_key(|c| match effects::channels(c.effect) & strained == 0 && !scores_enough(c) {
            _ if relieves(c) => 0,
            false => 1,
            true => 2,
        });
        let tried = candidates.iter().take_while(|c| effects::channels(c.effect) & strained != 0 || scores_enough(c));
        count = tried.count().min(constants::candidates_strained());
    }
    let flows = Channel::PressureA.bit() | Channel::PressureB.bit();
    if candidates[..count].iter().any(|c| effects::channels(c.effect) & flows != 0)
        && let Some(place) = candidates.iter().position(|c| c.effect.identification().replaces_a_law)
        && place >= count
    {
        candidates[count..=place].rotate_right(1);
        count += 1;
    }
    let (chosen, rest) = candidates.split_at(count);
    let list = |effect: Effect| {
        let mut effects = from.hypothesis.effects.clone();
        effects.push(effect);
        effects
    };
    tried.extend(rest.iter().map(|c| Tried {
        effects: list(c.effect),
        cost: from.undispersed() - c.predicted,
        fitted: false,
    }));
    let starts: Vec<Start<'_>> =
        chosen.iter().flat_map(|c| c.starts.iter().map(|start| (c.effect, &start[..]))).collect();
    // A few iterations on the subset show which candidates to fit on all data.
    let mut fits = finished(problem, by_predictions(problem, from, &scoring, &starts), base);
    // Mechanics that were strained without an effect may hold its fit in another valley of the sticking piston, unless one of them
    // leaves noise alone.
    if may_be_held(problem, from) && fits.first().is_none_or(|best| may_be_held(problem, best)) {
        let lowest = fits.first().map_or(base, |best| best.cost(problem));
        fits.extend(finished(problem, by_momentum(problem, from, &scoring, &starts), lowest));
        fits = one_of_each(problem, fits);
    }
    noted(problem, fits, tried)
}

/// Extensions, lowest cost first, of which the best are fitted to the end: those that may come near the lowest cost, counted from the
/// cost `base` without any.
fn finished(problem: &Problem<'_>, mut begun: Vec<Fit>, base: f64) -> Vec<Fit> {
    begun.sort_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)));
    let lowest = begun.first().map_or(base, |fit| fit.cost(problem)).min(base);
    let finished = begun.iter().take_while(|fit| promising(fit.cost(problem), lowest, base)).count();
    let finished = finished.clamp(1, constants::candidates_finished()).min(begun.len());
    let fits: Vec<Fit> = begun
        .par_iter()
        .enumerate()
        .filter_map(|(place, fit)| {
            let changed = fit.hypothesis.effects.last().map_or(0, |effect| effects::channels(*effect));
            let finish = || problem.fit_and_search(fit.hypothesis.clone(), changed, constants::iterations(), lowest);
            if place < finished { finish() } else { Some(fit.clone()) }
        })
        .collect();
    one_of_each(problem, fits)
}

/// The best extension by each effect, lowest cost first.
fn one_of_each(problem: &Problem<'_>, mut fits: Vec<Fit>) -> Vec<Fit> {
    fits.sort_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)));
    let mut seen: Vec<Effect> = Vec::new();
    fits.retain(|fit| {
        let added = fit.hypothesis.effects.last().copied();
        added.is_some_and(|effect| {
            !seen.contains(&effect) && {
                seen.push(effect);
                true
            }
        })
    });
    fits
}

/// Extensions in order, kept for the appendix of the report.
fn noted(problem: &Problem<'_>, fits: Vec<Fit>, tried: &mut Vec<Tried>) -> Vec<Fit> {
    tried.extend(fits.iter().map(Tried::of));
    in_order(problem, fits)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated, stick_slip_v};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::nominal::nominal_parameters;
    use plant_model::Effects;
    use rig_files::RigFile;

    #[test]
    fn a_scale_that_other_values_hide_begins_where_tolerances_like_them_best() {
        let mut rig = RigFile::paper_a();
        rig.tolerance.default = 0.03;
        let known =
            [("cylinder.area_m2", 0.008), ("friction.stiffness_n_per_m", 0.5), ("friction.damping_n_s_per_m", 0.5)];
        known.into_iter().for_each(|(path, relative)| assert!(rig.tolerance.set(path, relative)));
        let hidden = Effects::none().with(Effect::PositionScale, &[1.05]);
        let mut log = simulated(&rig, &hidden, 12_000, stick_slip_v);
        add_noise(&mut log, 5.0e-6, 200.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        // Volumes and flows too large, mass and bristles off, all in step: the same motion.
        let effect = Effect::PositionScale;
        let null = Hypothesis::null(&nominal);
        let in_step = null.extended_by(effect, problem.parameters(effect), &[1.0 / 1.05]);
        let from = problem.evaluate_as_is(null.with_values_of(&in_step)).expect("a sound rig");
        assert!(from.prior_cost > 5.0 && from.cost_in(&problem, judgeable) < 1.1 * problem.noise_cost(judgeable));
        let scoring = Scoring::new(&problem, &from).expect("a fit that can be moved");
        let candidates = ranked_candidates(&problem, &from, &scoring, judgeable);
        let scale = candidates.iter().find(|c| c.effect == effect).expect("a candidate");
        let start = scale.starts.first().expect("an initial value");
        assert!((start[0] - 1.05).abs() < 1e-9, "{start:?}");
    }

    #[test]
    fn what_may_take_a_causes_place_goes_on_from_what_was_tried_before() {
        let rig = RigFile::paper_a();
        let hidden = Effects::none().with(Effect::ExhaustCoefficient, &[0.8]);
        let mut log = simulated(&rig, &hidden, 12_000, stick_slip_v);
        add_noise(&mut log, 5.0e-5, 300.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, first, second) = (Signals::default(), Effort::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &first));
        let null = problem.fit(Hypothesis::null(&nominal), constants::iterations()).expect("a sound rig");
        let (wanted, mut memory) = (Wanted::any(&problem), Memory::default());
        let before = first.millions();
        let anew = extensions(&problem, &null, &wanted, &mut memory);
        let cost_anew = first.millions() - before;
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &second));
        let gone_on = rivals(&problem, &null, &wanted, &mut memory.for_another());
        let effects = |fits: &[Fit]| {
            let mut effects: Vec<Effect> =
                fits.iter().filter_map(|fit| fit.hypothesis.effects.last().copied()).collect();
            effects.sort_unstable();
            effects
        };
        assert_eq!(effects(&gone_on), effects(&anew));
        assert_eq!(gone_on[0].hypothesis.effects, [Effect::ExhaustCoefficient]);
        assert!(gone_on[0].cost(&problem) < anew[0].cost(&problem) + constants::same_cost());
        assert!(second.millions() < 0.5 * cost_anew, "{} of {cost_anew}", second.millions());
    }
}
