//! Where fits of friction before sliding begin: at the best of many levels.
//!
//! Where a piston sticks and slips, each breakaway that comes at another moment puts a wall beside the right force. A fit does not
//! come from one valley between such walls to another.

use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;
use plant_model::Place;
use rayon::prelude::*;

/// The factor from one Stribeck velocity to the next at which static friction is looked for, two to either side of the stated one: of
/// three logs each valley was a quarter wide to either side.
const STRIBECK_STEP: f64 = 1.5;

/// A fit that begins with the static friction, and the stiffness of the bristles, at which mechanics cost least, after something
/// `changed` in some channels.
pub(super) fn from_best_breakaway(
    problem: &Problem<'_>,
    hypothesis: Hypothesis,
    changed: Channels,
    iterations: usize,
) -> Option<Fit> {
    problem.refit(best_breakaway(problem, hypothesis), changed, iterations)
}

/// A fit with the Stribeck velocity, and static friction and bristles with it, from which mechanics cost least, after something `changed`
/// in some channels: for a static friction that no tolerance bounds. How soon friction falls once the piston slides sets how much of it
/// a log shows, so each velocity has a valley of its own. Breakaways are rare, and a subset has too few of them to tell two valleys
/// apart.
pub(super) fn from_best_stribeck(
    problem: &Problem<'_>,
    subset: &Problem<'_>,
    hypothesis: &Hypothesis,
    changed: Channels,
    iterations: usize,
) -> Option<Fit> {
    let stated = Slot::Nominal(Place::stribeck_velocity_m_per_s.key());
    let place = hypothesis.parameters.iter().position(|p| p.slot == stated);
    let at = |steps: i32| {
        let mut begun = hypothesis.clone();
        if let Some(place) = place {
            let p = hypothesis.parameters[place];
            begun.values[place] = (STRIBECK_STEP.powi(steps) * p.neutral).clamp(p.min, p.max);
        }
        let begun = best_level(problem, begun, Place::static_n);
        let fit = subset.refit(best_level(subset, begun, Place::stiffness_n_per_m), changed, iterations)?;
        problem.evaluate_as_is(fit.hypothesis)
    };
    let all = if place.is_some() { -2..=2 } else { 0..=0 };
    let fits = all.into_par_iter().filter_map(at);
    fits.min_by(|a, b| a.cost(problem).total_cmp(&b.cost(problem)))
}

/// The same hypothesis with the static friction at which mechanics cost least, and with such a stiffness of the bristles where that is
/// open: sliding says little of them, and a fit does not come from one valley to another.
pub(super) fn best_breakaway(problem: &Problem<'_>, hypothesis: Hypothesis) -> Hypothesis {
    let by_level = best_level(problem, hypothesis, Place::static_n);
    let best = best_level(problem, by_level.clone(), Place::stiffness_n_per_m);
    // How much force there is before the piston slides depends on both.
    if best.values == by_level.values { best } else { best_level(problem, best, Place::static_n) }
}

/// The same hypothesis with the level of a value, or of the effect that replaces it, at which mechanics cost least.
fn best_level(problem: &Problem<'_>, hypothesis: Hypothesis, of: Place) -> Hypothesis {
    let path = of.key().path;
    let Some(place) = hypothesis.parameters.iter().position(|p| p.is_value_of(path)) else { return hypothesis };
    let p = hypothesis.parameters[place];
    // Of what is positive levels are a factor apart, whatever its unit. Static friction below Coulomb's is taken as that.
    let coulomb_n = hypothesis.rig(problem.rig, &hypothesis.values).rig.friction.coulomb_n;
    let least = p.min.max(if of == Place::static_n { coulomb_n } else { 1.0e-3 * p.neutral });
    let by = |factor: f64| std::iter::successors(Some(p.neutral * factor), move |level| Some(level * factor));
    let (up, down) = (by(constants::level_step()), by(1.0 / constants::level_step()));
    let mut levels = vec![p.neutral, hypothesis.values[place]];
    levels.extend(up.take_while(|level| *level <= p.max).chain(down.take_while(|level| *level >= least)));
    let cost = |level: &f64| {
        let mut values = hypothesis.values.clone();
        values[place] = *level;
        let residuals = problem.evaluate(&hypothesis, &values, Channel::Position.bit())?;
        Some((problem.total(&residuals, &hypothesis, &values), *level))
    };
    let best = levels.par_iter().filter_map(cost).min_by(|a, b| a.0.total_cmp(&b.0));
    let mut out = hypothesis;
    if let Some((_, level)) = best {
        out.values[place] = level;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::nominal::nominal_parameters;
    use plant_model::{Effect, Effects};
    use rig_files::RigFile;

    #[test]
    fn a_static_friction_of_several_times_the_stated_one_is_found_with_its_stribeck_velocity() {
        let mut stated = RigFile::paper_a();
        assert!(stated.tolerance.set(Place::stribeck_velocity_m_per_s.key().path, 0.4));
        let mut rig = stated.clone();
        let f = &mut rig.rig.friction;
        (f.static_n, f.stribeck_velocity_m_per_s) = (3.5 * f.static_n, 1.7 * f.stribeck_velocity_m_per_s);
        let mut log = simulated(&rig, &Effects::none(), 12_000, |t_s| 2.0 * (2.0 * t_s).sin() + (7.0 * t_s).sin());
        add_noise(&mut log, 5.0e-5, 300.0);
        let record = prepare(&log, &stated);
        let nominal = nominal_parameters(&stated, judgeable(&record), false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&stated, &record), judgeable(&record), &nominal, (&signals, &effort));
        let effect = Effect::StaticFriction;
        let parameters = problem.parameters(effect);
        let begun = Hypothesis::null(&nominal).with(effect, parameters, &[stated.rig.friction.static_n], false);
        let (y, few) = (Channel::Position.bit(), constants::first_iterations());
        let found = from_best_stribeck(&problem, &problem.subset().0, &begun, y, few).expect("a sound rig").hypothesis;
        let part = found.values_of(effect)[0] / rig.rig.friction.static_n;
        let stribeck = Slot::Nominal(Place::stribeck_velocity_m_per_s.key());
        let faster = found.value(stribeck).expect("open") / stated.rig.friction.stribeck_velocity_m_per_s;
        assert!((part - 1.0).abs() < 0.1 && faster > 1.4, "{part} {faster}");
    }
}
