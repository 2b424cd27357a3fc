//! What a cause must gain: against chance, beside noise, and beside what a fit leaves.

use super::initial_values::moves_in_step;
use crate::data::channel::Channel;
use crate::estimate::likelihood::{COST_OF_NOISE, calm_misfit, dispersion};
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use crate::model::parameter::{Parameter, Slot};
use plant_model::Effect;

/// A cause must lower the cost (minus log-likelihood) by at least this much, plus [`PER_PARAMETER`] for each parameter.
/// The level stands for four standard deviations of a nominal value: the point where a deviation within tolerance is
/// no longer a plausible explanation, over a hundred such values.
const GATE: f64 = 8.0;
pub(crate) const PER_PARAMETER: f64 = 3.0;
/// Alternatives whose cost is within this of the chosen cause cannot be told from it.
pub(crate) const TIE: f64 = 6.0;
/// A cause must take away this part of the cost that pure noise would have in the channels it acts on.
const RELEVANT: f64 = 0.008;
/// And this part of what is left over there: breakaways a little early or late make the cost rugged, and everything
/// that moves them gains or loses by chance.
const RELEVANT_REST: f64 = 0.05;
/// What takes mass and friction along with it moves more breakaways.
const RELEVANT_REST_IN_STEP: f64 = 0.5;
/// A balance with this many times the cost of noise is open, with this many wide open.
const OPEN: f64 = 2.0;
const WIDE_OPEN: f64 = 6.0;
/// A channel whose innovations vary less than noise in total, and no more than this slowly, has nothing to explain.
const WHITE_DISPERSION: f64 = 1.25;
/// Standard errors that a cause's parameter must be away from neutral.
const SURE: f64 = 4.0;

/// What an effect must gain in a fit: enough against chance, and enough to matter in the channels it acts on, beside
/// their noise and beside what the fit leaves over there.
pub(crate) fn gate(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> f64 {
    // Air does not tell a scale of lengths from other values, see `Hypothesis::scale_lengths`.
    let (shows, rest) = if moves_in_step(effect) {
        (Channel::Position.bit(), RELEVANT_REST_IN_STEP)
    } else {
        (effects::channels(effect), RELEVANT_REST)
    };
    let channels = shows & problem.judgeable & !Channel::Supply.bit();
    let noise = problem.noise_cost(channels);
    let left = (fit.cost_in(problem, channels) - noise).max(0.0);
    charge(effect).max(RELEVANT * noise).max(rest * left)
}

/// How much less than it should an effect gains in a fit beside the fit without it; negative if it gains enough. What it
/// gains by relieving strained nominal values needs no weight beside noise: tolerances have no numerical error.
pub(crate) fn wanting(problem: &Problem<'_>, with: &Fit, without: &Fit, effect: Effect) -> f64 {
    if negligible(with, effect) {
        return f64::INFINITY;
    }
    let relieved = without.prior_cost - with.prior_cost;
    let needed = if relieved > charge(effect) { charge(effect) } else { gate(problem, with, effect) };
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
        calm_misfit(e, 0.0) < 1.0 && dispersion(e) < WHITE_DISPERSION
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
pub(crate) fn unsure(fit: &Fit, effect: Effect) -> bool {
    let Some(covariance) = &fit.covariance else { return false };
    presence(fit, effect).all(|(place, _, away)| away < SURE * covariance[(place, place)].max(0.0).sqrt())
}

/// Cost with a charge for every cause and parameter: what is compared between hypotheses. Whether a cause matters is
/// another question, see [`gate`].
pub(crate) fn charged(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.iter().any(|effect| negligible(fit, *effect)) {
        return f64::INFINITY;
    }
    with_charges(problem, fit)
}

fn with_charges(problem: &Problem<'_>, fit: &Fit) -> f64 {
    fit.cost(problem) + fit.hypothesis.effects.iter().map(|e| charge(*e)).sum::<f64>()
}

/// What a cause must gain against chance.
fn charge(effect: Effect) -> f64 {
    GATE + PER_PARAMETER * effect.parameter_count() as f64
}

/// What an addition is worth before what it makes needless is taken out: earlier causes may have become negligible.
pub(crate) fn promise(problem: &Problem<'_>, fit: &Fit) -> f64 {
    if fit.hypothesis.effects.last().is_some_and(|added| negligible(fit, *added)) {
        return f64::INFINITY;
    }
    with_charges(problem, fit)
}

/// Whether a fit leaves a balance so far from noise that its causes may be the wrong ones altogether.
pub(crate) fn wide_open(problem: &Problem<'_>, fit: &Fit) -> bool {
    any_beyond(problem, WIDE_OPEN, |channel| fit.cost_in(problem, channel.bit()))
}

/// Whether a fit leaves a balance far from white noise.
pub(crate) fn open(problem: &Problem<'_>, fit: &Fit) -> bool {
    any_beyond(problem, OPEN, |channel| fit.channel_cost[channel as usize])
}

/// Whether any channel costs more than so many times its noise.
fn any_beyond(problem: &Problem<'_>, times: f64, cost: impl Fn(Channel) -> f64) -> bool {
    let mut judgeable = Channel::ALL.into_iter().filter(|c| problem.judgeable & c.bit() != 0);
    judgeable.any(|c| cost(c) > times * problem.noise_cost(c.bit()))
}
