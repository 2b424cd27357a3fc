//! The last simplification: removes causes that may as well be neutral, and parts of effects that the log does not
//! need.

use super::backward::{Pruned, refit_without};
use super::exchange::{Alternatives, exchange, given_up};
use super::memory::Memory;
use super::penalty::{negligible, required_gain, shortfall, uncertain};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use plant_model::Effect;

/// Removes causes within four standard errors of neutral: they only fit noise. Adds standard errors to what is left. Where names are
/// given up nothing is fitted to the end for them.
pub(crate) fn drop_uncertain(
    problem: &Problem<'_>,
    mut best: Fit,
    mut alternatives: Vec<Option<Alternatives>>,
) -> (Fit, Vec<Option<Alternatives>>) {
    if given_up(problem, &best) {
        return (problem.with_errors(best), alternatives);
    }
    loop {
        best = problem.with_errors(problem.down_its_valleys(best));
        let place = best.hypothesis.effects.iter().position(|effect| uncertain(&best, *effect));
        let Some(place) = place else { return (best, alternatives) };
        let effect = best.hypothesis.effects[place];
        let smaller = refit_without(problem, &best, effect);
        // A cause with a gain far above the required one stays: then the standard error is wrong, not the cause.
        let doubtful = |smaller: &Fit| {
            smaller.cost(problem) - best.cost(problem)
                < constants::beyond_doubt() * required_gain(problem, &best, effect)
        };
        let Some(smaller) = smaller.filter(doubtful) else { return (best, alternatives) };
        best = smaller;
        if place < alternatives.len() {
            alternatives.remove(place);
        }
    }
}

/// The growth of the cost without a cause that makes it a small one.
fn trifle(problem: &Problem<'_>, null: &Fit, best: &Fit) -> f64 {
    constants::trifle() * (null.cost(problem) - best.cost(problem))
}

/// Brings the fits without small causes to their end, and removes those that are needless then: backward elimination stops in valleys
/// along which a fit without a cause has far to go. What is judged later is judged against those fits, too.
pub(crate) fn drop_needless_trifles(
    problem: &Problem<'_>,
    null: &Fit,
    (mut best, mut alternatives): (Fit, Vec<Option<Alternatives>>),
) -> (Fit, Vec<Option<Alternatives>>) {
    if given_up(problem, &best) {
        return (best, alternatives);
    }
    loop {
        let trifle = trifle(problem, null, &best);
        let needless = |(place, found): (usize, &mut Option<Alternatives>)| {
            let without = &mut found.as_mut()?.without;
            if without.cost(problem) - best.cost(problem) >= trifle {
                return None;
            }
            *without = problem.down_its_valleys(without.clone());
            let effect = best.hypothesis.effects[place];
            (shortfall(problem, &best, without, effect) >= 0.0).then(|| (place, without.clone()))
        };
        let Some((place, smaller)) = alternatives.iter_mut().enumerate().find_map(needless) else {
            return (best, alternatives);
        };
        best = smaller;
        alternatives.remove(place);
    }
}

/// Of two causes that no log tells apart only one stays where the other adds next to nothing to it: together they take values of
/// which the sum alone is known, each as far off as its range allows. Alternatives are looked for anew.
pub(crate) fn one_of_each_tie(
    problem: &Problem<'_>,
    null: &Fit,
    (mut best, mut alternatives): (Fit, Vec<Option<Alternatives>>),
    memory: &mut Memory,
) -> (Fit, Vec<Option<Alternatives>>) {
    loop {
        let effects = &best.hypothesis.effects;
        let trifle = trifle(problem, null, &best);
        let loss = |(effect, found): (&Effect, &Option<Alternatives>)| {
            let tied = effect.structural_ties().any(|other| effects.contains(&other));
            let without = &found.as_ref().filter(|_| tied)?.without;
            let loss = without.cost(problem) - best.cost(problem);
            (loss < trifle).then(|| (loss, without.clone()))
        };
        let needless = effects.iter().zip(&alternatives).filter_map(loss).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, smaller)) = needless else { return (best, alternatives) };
        (best, alternatives) = exchange(problem, Pruned::as_it_is(problem, smaller), memory);
    }
}

/// Removes needless parts of an effect that has several, such as slope and ripple of friction along the stroke: a slope
/// and a ripple of long wavelength are nearly the same.
pub(crate) fn drop_needless_parts(problem: &Problem<'_>, mut best: Fit) -> Fit {
    let penalised_cost =
        |fit: &Fit| fit.cost(problem) + constants::penalty_per_parameter() * fit.hypothesis.parameters.len() as f64;
    for effect in best.hypothesis.effects.clone() {
        // A fit that cannot come so low with fewer parameters ends early.
        let fit = |kept: &&'static [usize]| {
            let part = best.hypothesis.only(effect, kept);
            let spared = best.hypothesis.parameters.len() - part.parameters.len();
            let goal = best.cost(problem) + constants::penalty_per_parameter() * spared as f64;
            problem.fit_and_search(part, problem.judgeable, constants::iterations(), goal)
        };
        let fits = effect.identification().parts.iter().filter_map(fit);
        let least =
            fits.filter(|fit| !negligible(fit, effect)).min_by(|a, b| penalised_cost(a).total_cmp(&penalised_cost(b)));
        if let Some(fit) = least
            && penalised_cost(&fit) <= penalised_cost(&best)
        {
            best = fit;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::simulated;
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::hypothesis::Hypothesis;
    use crate::model::nominal::nominal_parameters;
    use plant_model::Effects;
    use rig_files::RigFile;

    #[test]
    fn of_two_causes_that_no_log_tells_apart_one_stays_with_a_value_of_its_own() {
        let rig = RigFile::paper_c();
        let hidden = Effects::none().with(Effect::FrictionAsymmetry, &[0.3]);
        let log = simulated(&rig, &hidden, 8000, |t_s| 1.5 * (3.0 * t_s).sin());
        let record = prepare(&log, &rig);
        let nominal = nominal_parameters(&rig, judgeable(&record), true, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable(&record), &nominal, (&signals, &effort));
        let null =
            problem.fit(Hypothesis::null(&nominal), constants::iterations()).expect("a rig that can be simulated");
        let both = [(Effect::FrictionAsymmetry, 0.9), (Effect::ConstantForce, -10.0)];
        let both = both.into_iter().fold(Hypothesis::null(&nominal), |all, (effect, start)| {
            all.extended_by(effect, problem.parameters(effect), &[start])
        });
        let both = problem.fit(both, constants::iterations()).expect("a rig that can be simulated");
        let mut memory = Memory::default();
        let Pruned { fit: both, without } = Pruned::as_it_is(&problem, both);
        assert_eq!(both.hypothesis.effects.len(), 2);
        let not_exchanged = |without: Fit| Alternatives { without, instead: Vec::new(), searched: true };
        let found = without.into_iter().map(|without| without.map(not_exchanged)).collect();
        let (one, alternatives) = one_of_each_tie(&problem, &null, (both, found), &mut memory);
        let [effect] = one.hypothesis.effects[..] else { panic!("{:?}", one.hypothesis.effects) };
        let (value, stated) = match effect {
            Effect::FrictionAsymmetry => (one.hypothesis.values_of(effect)[0], 0.3),
            _ => (one.hypothesis.values_of(effect)[0], 0.3 * rig.rig.friction.coulomb_n),
        };
        assert!((value / stated - 1.0).abs() < 0.03, "{effect}: {value}");
        assert_eq!(alternatives.len(), 1);
    }
}
