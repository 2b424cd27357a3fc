//! The gain required of a cause: its penalty, a share of the noise's cost, and a share of what the fit leaves
//! unexplained.

use crate::balances::observers::Innovations;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::estimate::likelihood::{COST_OF_NOISE, dispersion, misfit};
use crate::estimate::passed_on::more_noise_passed_on;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::parameter::{Parameter, Slot};
use nalgebra::{DMatrix, DVector};
use plant_model::Effect;

/// The gain in log-likelihood required of an effect: its penalty, and enough to matter in the channels it acts on,
/// compared with the cost of their noise and with what the fit leaves unexplained there.
pub(crate) fn required_gain(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> f64 {
    // The balances of the air cannot tell a scale of lengths from other values, see `Hypothesis::move_in_step`.
    let (shows, rest) = if effects::moves_nominal_values(effect) {
        (Channel::Position.bit(), constants::share_of_rest_in_step())
    } else if problem.record.has_distant_rows() {
        (effects::channels(effect), constants::share_of_rest_between_rows())
    } else {
        (effects::channels(effect), constants::share_of_rest())
    };
    let channels = shows & problem.judgeable & !Channel::Supply.bit();
    let noise = problem.noise_cost(channels);
    let left = (fit.cost_in(problem, channels) - noise).max(0.0);
    penalty(effect).max(constants::share_of_noise() * noise).max(rest * left)
}

/// The required gain of an effect less its gain over the fit without it: negative if it gains enough. What it gains by
/// relieving strained nominal values need only exceed the penalty: priors have no numerical error.
pub(crate) fn shortfall(problem: &Problem<'_>, with: &Fit, without: &Fit, effect: Effect) -> f64 {
    if negligible(with, effect) {
        return f64::INFINITY;
    }
    let relieved = without.prior_cost - with.prior_cost;
    let small = presence(with, effect).all(|(_, p, away)| away < p.negligible);
    let needed = if small {
        constants::beyond_doubt() * required_gain(problem, with, effect)
    } else if relieved > penalty(effect) {
        penalty(effect)
    } else {
        required_gain(problem, with, effect)
    };
    needed - (without.cost(problem) - with.cost(problem) - suppressed(problem, with, without, effect))
}

/// What an effect gains by suppressing noise, which does not count: a model that passes on less of one sensor's noise predicts
/// another sensor a little better.
fn suppressed(problem: &Problem<'_>, with: &Fit, without: &Fit, effect: Effect) -> f64 {
    let gained = |c: &Channel| without.cost_in(problem, c.bit()) - with.cost_in(problem, c.bit());
    let touched = effects::channels(effect) & problem.judgeable;
    let quiet = |c: &Channel, times: f64| {
        touched & c.bit() != 0
            && without.channel_cost[*c as usize] < times * COST_OF_NOISE * problem.noise_cost(c.bit()) / 0.5
            && gained(c) > 0.0
    };
    let white = |c: &Channel, innovations: &Innovations| {
        let e = &innovations.channels[*c as usize];
        misfit(e, problem.record.averaged()) < 1.0
            && dispersion(e, problem.record.dispersion_span()) < constants::like_noise()
    };
    let innovations = Channel::ALL.iter().any(|c| quiet(c, 1.0)).then(|| problem.innovations(without)).flatten();
    let is_white = |c: &Channel| quiet(c, 1.0) && innovations.as_ref().is_some_and(|all| white(c, all));
    let of_white: f64 = Channel::ALL.iter().filter(|c| is_white(c)).map(gained).sum();
    let position = Channel::Position;
    // Of a balance that is like noise, but not white, what less noise explains; where that is most of the gain, all of it.
    let passed_on = if quiet(&position, constants::like_noise()) && !is_white(&position) {
        let less = more_noise_passed_on(problem, without, with);
        let all = gained(&position);
        if less > 0.5 * all { all } else { less.max(0.0) }
    } else {
        0.0
    };
    of_white + passed_on
}

/// The parameters that decide whether an effect is present, with their places and distances from neutral. Shape
/// parameters do not: a recovery time means nothing without droop, nor a wavelength without ripple.
fn presence(fit: &Fit, effect: Effect) -> impl Iterator<Item = (usize, &Parameter, f64)> {
    let h = &fit.hypothesis;
    let shape_only = effect.identification().shape_only;
    let tells = move |p: &Parameter| match p.slot {
        Slot::Effect(e, index) => e == effect && !shape_only.contains(&index),
        _ => false,
    };
    let all = h.parameters.iter().zip(&h.values).enumerate();
    all.filter(move |(_, (p, _))| tells(p)).map(|(place, (p, value))| (place, p, (value - p.neutral).abs()))
}

/// Whether all parameters of an effect are too close to neutral to matter, whatever it gains.
pub(crate) fn negligible(fit: &Fit, effect: Effect) -> bool {
    presence(fit, effect).all(|(_, p, away)| away < constants::hardly() * p.negligible)
}

/// Whether all parameters of an effect are within `constants::sure` standard errors of neutral.
pub(crate) fn uncertain(fit: &Fit, effect: Effect) -> bool {
    let Some(covariance) = &fit.covariance else { return false };
    presence(fit, effect).all(|(place, _, away)| away < constants::sure() * covariance[(place, place)].max(0.0).sqrt())
}

/// Whether the parameters of an effect are away from neutral together, though each may be neutral by itself: the log tells only what they
/// do together, and that another effect may do as well. Where errors are too large for both the gain says more than they do.
pub(crate) fn told_only_together(fit: &Fit, effect: Effect) -> bool {
    let Some(covariance) = &fit.covariance else { return false };
    if standard_errors_away(fit, effect) > constants::by_itself() {
        return false;
    }
    let present: Vec<(usize, f64)> =
        presence(fit, effect).map(|(place, p, _)| (place, fit.hypothesis.values[place] - p.neutral)).collect();
    let away = DVector::from_iterator(present.len(), present.iter().map(|(_, away)| *away));
    let of_effect = DMatrix::from_fn(present.len(), present.len(), |i, j| covariance[(present[i].0, present[j].0)]);
    let squared = of_effect.cholesky().map_or(0.0, |factor| away.dot(&factor.solve(&away)));
    squared > constants::sure().powi(2)
}

/// Whether a parameter of an effect ends at a bound that is not its neutral value: then the log gives no value for it, and what the
/// effect gains may be another's.
pub(crate) fn ends_at_bound(fit: &Fit, effect: Effect) -> bool {
    presence(fit, effect).any(|(place, p, away)| {
        p.is_at_bound(fit.hypothesis.values[place]) && away > constants::step_smooth() * p.scale
    })
}

/// How far the parameter of an effect that is farthest from neutral is from it, in standard errors; 0 before there are any.
pub(crate) fn standard_errors_away(fit: &Fit, effect: Effect) -> f64 {
    let Some(covariance) = &fit.covariance else { return 0.0 };
    let errors = |(place, _, away): (usize, &Parameter, f64)| {
        away / covariance[(place, place)].max(0.0).sqrt().max(f64::MIN_POSITIVE)
    };
    presence(fit, effect).map(errors).fold(0.0, f64::max)
}

/// Penalised cost: minus the log-posterior plus a penalty for every cause and parameter. Hypotheses are compared by it.
/// Whether a cause matters is decided by [`required_gain`].
pub(crate) fn penalised_cost(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.iter().any(|effect| negligible(fit, *effect)) {
        return f64::INFINITY;
    }
    with_penalties(problem, fit)
}

fn with_penalties(problem: &Problem<'_>, fit: &Fit) -> f64 {
    fit.cost(problem) + fit.hypothesis.effects.iter().map(|e| penalty(*e)).sum::<f64>()
}

/// The penalty of a cause, in units of log-likelihood.
pub(super) fn penalty(effect: Effect) -> f64 {
    constants::penalty_per_cause() + constants::penalty_per_parameter() * effect.parameter_count() as f64
}

/// Penalised cost of an extension before backward elimination: earlier causes may have become negligible, the added one
/// may not.
pub(crate) fn cost_before_pruning(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.last().is_some_and(|added| negligible(fit, *added)) {
        return f64::INFINITY;
    }
    with_penalties(problem, fit)
}

/// Whether a fit leaves a balance so far above noise that all its causes may be wrong.
pub(crate) fn wide_open(problem: &Problem<'_>, fit: &Fit) -> bool {
    any_beyond(problem, problem.judgeable, constants::wide_open(), |channel| fit.cost_in(problem, channel.bit()))
}

/// The same, whatever over-dispersion has been found: names are out of reach.
pub(crate) fn out_of_reach(problem: &Problem<'_>, fit: &Fit) -> bool {
    any_beyond(problem, problem.judgeable, constants::wide_open(), |channel| fit.channel_cost[channel as usize])
}

/// Whether a fit leaves a balance far from white noise.
pub(crate) fn open(problem: &Problem<'_>, fit: &Fit) -> bool {
    open_in(problem, fit, problem.judgeable)
}

/// Whether a fit leaves a chamber's balance far from white noise.
pub(crate) fn open_chambers(problem: &Problem<'_>, fit: &Fit) -> bool {
    open_in(problem, fit, Channel::PressureA.bit() | Channel::PressureB.bit())
}

/// Whether a fit leaves all balances that an effect acts on near white noise.
pub(crate) fn near_noise(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> bool {
    !open_in(problem, fit, effects::channels(effect))
}

/// Whether a fit leaves the balance of one of some channels far from white noise.
fn open_in(problem: &Problem<'_>, fit: &Fit, channels: Channels) -> bool {
    any_beyond(problem, channels, constants::open(), |channel| fit.channel_cost[channel as usize])
}

/// Whether a fit leaves a balance that noise alone does not explain.
pub(crate) fn beyond_noise(problem: &Problem<'_>, fit: &Fit) -> bool {
    beyond_noise_in(problem, fit, problem.judgeable)
}

/// The same of the balances of some channels.
pub(crate) fn beyond_noise_in(problem: &Problem<'_>, fit: &Fit, channels: Channels) -> bool {
    any_beyond(problem, channels, constants::like_noise(), |channel| fit.channel_cost[channel as usize])
}

/// Whether any of some channels that are judged costs more than so many times its noise.
fn any_beyond(problem: &Problem<'_>, channels: Channels, times: f64, cost: impl Fn(Channel) -> f64) -> bool {
    let mut judged = Channel::ALL.into_iter().filter(|c| channels & problem.judgeable & c.bit() != 0);
    judged.any(|c| cost(c) > times * problem.noise_cost(c.bit()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::quality::Quality;
    use crate::model::hypothesis::Hypothesis;
    use rig_files::RigFile;

    /// A fit with one effect at some values, and with a standard error for its parameters.
    fn fit(effect: Effect, values: &[f64], std_error: f64) -> Fit {
        let parameters = effects::effect_parameters(&RigFile::paper_a(), effect, 0b1111, &Quality::default());
        let n = parameters.len();
        let hypothesis = Hypothesis { effects: vec![effect], parameters, values: values.to_vec() };
        Fit::of_values(hypothesis, DMatrix::from_diagonal_element(n, n, std_error * std_error))
    }

    #[test]
    fn every_cause_pays_for_itself_and_for_each_parameter() {
        for effect in Effect::ALL {
            let expected =
                constants::penalty_per_cause() + constants::penalty_per_parameter() * effect.parameter_count() as f64;
            assert_eq!(penalty(effect), expected, "{effect}");
        }
        assert_eq!(penalty(Effect::PayloadMass), 11.0);
    }

    #[test]
    fn a_cause_is_present_only_if_a_parameter_that_tells_is_away_from_neutral() {
        for (effect, values, present) in [
            (Effect::PositionScale, &[1.0][..], false),
            (Effect::PositionScale, &[1.05], true),
            (Effect::PayloadMass, &[10.125], false),
            (Effect::PayloadMass, &[12.0], true),
            // The recovery time of a supply that does not droop says nothing.
            (Effect::SupplyDroop, &[0.0, 0.3], false),
            (Effect::SupplyDroop, &[3.0e7, 0.1], true),
            // Nor does the wavelength of a ripple of no height.
            (Effect::FrictionPosition, &[0.0, 0.0, 0.02], false),
            (Effect::FrictionPosition, &[0.0, 0.3, 0.02], true),
            (Effect::ChokedFlow, &[0.5, 1.0], true),
        ] {
            assert_eq!(!negligible(&fit(effect, values, 1.0e-9), effect), present, "{effect} {values:?}");
        }
    }

    #[test]
    fn a_value_at_a_bound_is_none_unless_the_bound_is_its_neutral_value() {
        let most = fit(Effect::PayloadMass, &[0.0], 0.1).hypothesis.parameters[0].max;
        for (effect, values, expected) in [
            (Effect::PayloadMass, &[most][..], true),
            (Effect::PayloadMass, &[0.9 * most], false),
            // No droop is the least there is.
            (Effect::SupplyDroop, &[0.0, 0.3], false),
        ] {
            assert_eq!(ends_at_bound(&fit(effect, values, 0.1), effect), expected, "{effect} {values:?}");
        }
    }

    #[test]
    fn parameters_that_are_away_from_neutral_only_together_are_told_apart_from_uncertain_ones() {
        for (values, std_error, correlation, expected) in [
            // Their difference is ten times as certain as each of them.
            ([0.99, 1.003], 0.006, 0.99, true),
            ([0.99, 1.003], 0.006, 0.0, false),
            ([0.95, 1.003], 0.006, 0.99, false),
        ] {
            let mut fit = fit(Effect::PistonArea, &values, std_error);
            let variance = std_error * std_error;
            let covariance = DMatrix::from_fn(2, 2, |i, j| if i == j { variance } else { correlation * variance });
            fit.covariance = Some(covariance);
            assert_eq!(told_only_together(&fit, Effect::PistonArea), expected, "{values:?} {correlation}");
        }
    }

    #[test]
    fn a_cause_is_uncertain_within_four_standard_errors_of_neutral() {
        for (std_error, expected) in [(0.005, false), (0.0124, false), (0.0126, true), (1.0, true)] {
            assert_eq!(
                uncertain(&fit(Effect::PositionScale, &[1.05], std_error), Effect::PositionScale),
                expected,
                "{std_error}"
            );
        }
        let unknown = Fit { covariance: None, ..fit(Effect::PositionScale, &[1.05], 1.0) };
        assert!(!uncertain(&unknown, Effect::PositionScale), "without standard errors nothing is dropped");
    }
}
