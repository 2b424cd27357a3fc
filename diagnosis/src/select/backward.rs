//! Backward elimination: causes that the others make needless.

use super::image::taken_over;
use super::penalty::{required_gain, shortfall};
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use plant_model::Effect;
use rayon::prelude::*;

/// What backward elimination leaves.
pub(crate) struct Pruned {
    pub(crate) fit: Fit,
    /// For each cause, in the order of the fit's effects: the fit without it, by which it was found needed.
    pub(crate) without: Vec<Option<Fit>>,
}

/// Errors of one kind in both pressure sensors: together they change next to nothing of flow and force, so that each alone seems needed.
const COMPENSATING: [[Effect; 2]; 2] =
    [[Effect::PressureAGain, Effect::PressureBGain], [Effect::PressureAOffset, Effect::PressureBOffset]];

/// Backward elimination: removes the most dispensable cause, one at a time, while its removal costs less than the
/// required gain; and two that compensate each other, while the removal of both does.
pub(crate) fn prune(problem: &Problem<'_>, fit: Fit) -> Pruned {
    let mut pruned = prune_before(problem, fit, 0);
    for pair in COMPENSATING {
        if let Some(smaller) = without_both(problem, &pruned.fit, pair) {
            pruned = prune_before(problem, smaller, 0);
        }
    }
    pruned
}

/// The same among a fit's earlier causes: the last one was just added because it gains enough.
pub(crate) fn prune_earlier(problem: &Problem<'_>, fit: Fit) -> Fit {
    prune_before(problem, fit, 1).fit
}

/// Backward elimination that spares the last causes.
fn prune_before(problem: &Problem<'_>, mut fit: Fit, spared: usize) -> Pruned {
    loop {
        let effects = &fit.hypothesis.effects;
        let mut without = without_each(problem, &fit, &effects[..effects.len().saturating_sub(spared)]);
        let shortfall = |(place, smaller): (usize, &Option<Fit>)| {
            let shortfall = shortfall(problem, &fit, smaller.as_ref()?, effects[place]);
            (shortfall >= 0.0).then_some((shortfall, place))
        };
        let needless = without.par_iter().enumerate().filter_map(shortfall).max_by(|a, b| a.0.total_cmp(&b.0));
        match needless.and_then(|(_, place)| without[place].take()) {
            Some(smaller) => fit = smaller,
            None => return Pruned { fit, without },
        }
    }
}

impl Pruned {
    /// A fit whose causes all stay, with the fits without each of them.
    pub(crate) fn as_it_is(problem: &Problem<'_>, fit: Fit) -> Self {
        Self { without: without_each(problem, &fit, &fit.hypothesis.effects), fit }
    }
}

/// For each of some causes of a fit: the fit without it.
fn without_each(problem: &Problem<'_>, fit: &Fit, effects: &[Effect]) -> Vec<Option<Fit>> {
    effects.par_iter().map(|effect| refit_without(problem, fit, *effect)).collect()
}

/// The fit without two of its causes, if both together gain less over it than is required of them.
fn without_both(problem: &Problem<'_>, fit: &Fit, pair: [Effect; 2]) -> Option<Fit> {
    if !pair.iter().all(|effect| fit.hypothesis.effects.contains(effect)) {
        return None;
    }
    let [one, other] = pair;
    let smaller = fit.hypothesis.without(one, problem.nominal).without(other, problem.nominal);
    let allowed = required_gain(problem, fit, one) + required_gain(problem, fit, other);
    let goal = fit.cost(problem) + allowed;
    let changed = effects::channels(one) | effects::channels(other);
    let smaller = problem.fit_and_search(smaller, changed, constants::iterations(), goal)?;
    (smaller.cost(problem) <= goal).then_some(smaller)
}

/// The fit without one of its causes, everything else fitted anew.
pub(crate) fn refit_without(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Fit> {
    let as_it_is = fit.hypothesis.without(effect, problem.nominal);
    let goal = fit.cost(problem) + required_gain(problem, fit, effect);
    let taken_over = taken_over(problem, fit, effect);
    let changed = taken_over.iter().fold(effects::channels(effect), |all, (by, _)| all | effects::channels(*by));
    let smaller = if taken_over.is_empty() {
        as_it_is
    } else {
        let begun = taken_over.into_iter().map(|(_, begin)| begin).chain([as_it_is]);
        let begun = begun.filter_map(|begin| problem.evaluate_as_is(begin));
        begun.min_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)))?.hypothesis
    };
    problem.fit_and_search(smaller, changed, constants::iterations(), goal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated, stick_slip_v};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::hypothesis::Hypothesis;
    use crate::model::nominal::nominal_parameters;
    use plant_model::Effects;
    use rig_files::RigFile;

    #[test]
    fn a_force_half_told_as_an_offset_is_found_whole_without_it() {
        let mut rig = RigFile::paper_a();
        // A rod: an offset of B is a smaller force than one of A.
        rig.rig.cylinder.area_b_m2 *= 0.85;
        let hidden = Effects::none().with(Effect::ConstantForce, &[10.0]);
        let mut log = simulated(&rig, &hidden, 12_000, stick_slip_v);
        add_noise(&mut log, 5.0e-6, 100.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let (force, offset) = (Effect::ConstantForce, Effect::PressureBOffset);
        let half_pa = -5.0 / rig.rig.cylinder.area_b_m2;
        let split = Hypothesis::null(&nominal).extended_by(offset, problem.parameters(offset), &[half_pa]).extended_by(
            force,
            problem.parameters(force),
            &[5.0],
        );
        let split = problem.evaluate_as_is(split).expect("a sound rig");
        let [(by, whole)] = &taken_over(&problem, &split, offset)[..] else { panic!("one image") };
        assert_eq!(*by, force);
        assert!((whole.values_of(force)[0] - 10.0).abs() < 1.0e-9, "{:?}", whole.values_of(force));
        let found = refit_without(&problem, &split, offset).expect("a sound rig");
        assert_eq!(found.hypothesis.effects, [force]);
        assert!((found.hypothesis.values_of(force)[0] - 10.0).abs() < 0.2, "{:?}", found.hypothesis.values_of(force));
    }
}
