//! What a cause must gain: against chance, beside noise, and beside what a fit leaves.

use super::initial_values::moves_nominal_values;
use crate::constants;
use crate::data::channel::Channel;
use crate::estimate::likelihood::{COST_OF_NOISE, dispersion, trimmed_misfit};
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::parameter::{Parameter, Slot};
use plant_model::Effect;

/// What an effect must gain in a fit: enough against chance, and enough to matter in the channels it acts on, beside
/// their noise and beside what the fit leaves over there.
pub(crate) fn required_gain(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> f64 {
    // Air does not tell a scale of lengths from other values, see `Hypothesis::scale_lengths`.
    let (shows, rest) = if moves_nominal_values(effect) {
        (Channel::Position.bit(), constants::share_of_rest_in_step())
    } else {
        (effects::channels(effect), constants::share_of_rest())
    };
    let channels = shows & problem.judgeable & !Channel::Supply.bit();
    let noise = problem.noise_cost(channels);
    let left = (fit.cost_in(problem, channels) - noise).max(0.0);
    penalty(effect).max(constants::share_of_noise() * noise).max(rest * left)
}

/// How much less than it should an effect gains in a fit beside the fit without it; negative if it gains enough. What it
/// gains by relieving strained nominal values needs no weight beside noise: tolerances have no numerical error.
pub(crate) fn shortfall(problem: &Problem<'_>, with: &Fit, without: &Fit, effect: Effect) -> f64 {
    if negligible(with, effect) {
        return f64::INFINITY;
    }
    let relieved = without.prior_cost - with.prior_cost;
    let needed = if relieved > penalty(effect) { penalty(effect) } else { required_gain(problem, with, effect) };
    needed - (without.cost(problem) - with.cost(problem) - suppressed(problem, with, without, effect))
}

/// What an effect takes away from channels that hold nothing but noise without it: a model that answers less to the
/// noise of one sensor predicts another a little better.
fn suppressed(problem: &Problem<'_>, with: &Fit, without: &Fit, effect: Effect) -> f64 {
    let bundles = problem.noise_cost(1) / 0.5;
    let gained = |c: &Channel| without.cost_in(problem, c.bit()) - with.cost_in(problem, c.bit());
    let quiet = |c: &Channel| {
        effects::channels(effect) & problem.judgeable & c.bit() != 0
            && without.channel_cost[*c as usize] < COST_OF_NOISE * bundles
            && gained(c) > 0.0
    };
    let quiet: Vec<Channel> = Channel::ALL.into_iter().filter(quiet).collect();
    if quiet.is_empty() {
        return 0.0;
    }
    let Some(innovations) = problem.innovations(without) else { return 0.0 };
    let white = |c: &&Channel| {
        let e = &innovations.channels[**c as usize];
        trimmed_misfit(e, 0.0) < 1.0 && dispersion(e) < constants::white_dispersion()
    };
    quiet.iter().filter(white).map(gained).sum()
}

/// The parameters that make an effect present at all, with their places and how far they are from neutral. The time
/// constant means nothing while nothing droops, the wavelength while nothing ripples.
fn presence(fit: &Fit, effect: Effect) -> impl Iterator<Item = (usize, &Parameter, f64)> {
    let h = &fit.hypothesis;
    let tells = move |p: &Parameter| match p.slot {
        Slot::Effect(Effect::SupplyDroop, 1) | Slot::Effect(Effect::FrictionPosition, 2) => false,
        Slot::Effect(e, _) => e == effect,
        _ => false,
    };
    let all = h.parameters.iter().zip(&h.values).enumerate();
    all.filter(move |(_, (p, _))| tells(p)).map(|(place, (p, value))| (place, p, (value - p.neutral).abs()))
}

/// Whether an effect is present in name only.
pub(crate) fn negligible(fit: &Fit, effect: Effect) -> bool {
    presence(fit, effect).all(|(_, p, away)| away < p.negligible)
}

/// Whether no parameter of an effect is surely away from neutral, by the fit's standard errors.
pub(crate) fn uncertain(fit: &Fit, effect: Effect) -> bool {
    let Some(covariance) = &fit.covariance else { return false };
    presence(fit, effect).all(|(place, _, away)| away < constants::sure() * covariance[(place, place)].max(0.0).sqrt())
}

/// Cost with a charge for every cause and parameter: what is compared between hypotheses. Whether a cause matters is
/// another question, see [`required_gain`].
pub(crate) fn penalised_cost(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.iter().any(|effect| negligible(fit, *effect)) {
        return f64::INFINITY;
    }
    with_penalties(problem, fit)
}

fn with_penalties(problem: &Problem<'_>, fit: &Fit) -> f64 {
    fit.cost(problem) + fit.hypothesis.effects.iter().map(|e| penalty(*e)).sum::<f64>()
}

/// What a cause must gain against chance.
fn penalty(effect: Effect) -> f64 {
    constants::penalty_per_cause() + constants::penalty_per_parameter() * effect.parameter_count() as f64
}

/// What an addition is worth before what it makes needless is taken out: earlier causes may have become negligible.
pub(crate) fn cost_before_pruning(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.last().is_some_and(|added| negligible(fit, *added)) {
        return f64::INFINITY;
    }
    with_penalties(problem, fit)
}

/// Whether a fit leaves a balance so far from noise that its causes may be the wrong ones altogether.
pub(crate) fn wide_open(problem: &Problem<'_>, fit: &Fit) -> bool {
    any_beyond(problem, constants::wide_open(), |channel| fit.cost_in(problem, channel.bit()))
}

/// Whether a fit leaves a balance far from white noise.
pub(crate) fn open(problem: &Problem<'_>, fit: &Fit) -> bool {
    any_beyond(problem, constants::open(), |channel| fit.channel_cost[channel as usize])
}

/// Whether any channel costs more than so many times its noise.
fn any_beyond(problem: &Problem<'_>, times: f64, cost: impl Fn(Channel) -> f64) -> bool {
    let mut judgeable = Channel::ALL.into_iter().filter(|c| problem.judgeable & c.bit() != 0);
    judgeable.any(|c| cost(c) > times * problem.noise_cost(c.bit()))
}
