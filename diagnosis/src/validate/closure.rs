//! Closure: whether anything beyond noise is left in a balance.

use crate::balances::observers::Innovations;
use crate::data::channel::Channel;
use crate::estimate::likelihood::{BUNDLE, COST_OF_NOISE, calm_misfit};
use crate::estimate::problem::Problem;
use crate::outcome::Balance;
use crate::select::search::Found;

/// A balance is closed while its innovations vary no more than this over what noise explains, slowly (long-run
/// variance) …
const CLOSED_DISPERSION_OF_MASS: f64 = 2.5;
const CLOSED_DISPERSION_OF_FORCE: f64 = 4.0;
/// … and in total (cost over that of white noise). When a resting piston breaks away is a matter of less force than the
/// pressure sensors resolve, so the force balance keeps a few large errors even where its physics is right.
const CLOSED_COST_OF_MASS: f64 = 3.0;
const CLOSED_COST_OF_FORCE: f64 = 5.0;
/// Misfit and long-run variance up to which a balance may be noise: causes fitted to it make it a little less than white.
pub(crate) const LIKE_NOISE: f64 = 1.25;
/// The worst part of the innovations, left out where a balance is judged: a slam into an end stop, a breakaway.
const SLAMS: f64 = 0.02;

/// The long-run variance below which a balance is closed.
fn closed_dispersion(channel: Channel) -> f64 {
    if channel == Channel::Position { CLOSED_DISPERSION_OF_FORCE } else { CLOSED_DISPERSION_OF_MASS }
}

/// Whether a balance of this misfit and long-run variance may be noise.
pub(crate) fn like_noise(misfit: f64, dispersion: f64) -> bool {
    misfit < LIKE_NOISE && dispersion < LIKE_NOISE
}

/// The misfit below which a balance is closed.
pub(crate) fn closed_cost(channel: Channel) -> f64 {
    if channel == Channel::Position { CLOSED_COST_OF_FORCE } else { CLOSED_COST_OF_MASS }
}

/// The channels that could be judged.
pub(crate) fn judged(problem: &Problem<'_>) -> impl Iterator<Item = Channel> {
    let judgeable = problem.judgeable;
    Channel::ALL.into_iter().filter(move |channel| judgeable & channel.bit() != 0)
}

/// How the balances stand, before and after.
pub(crate) fn balances(problem: &Problem<'_>, found: &Found, innovations: &[Innovations; 2]) -> Vec<Balance> {
    let dispersion = problem.dispersion_at(&found.best);
    judged(problem)
        .map(|channel| {
            let index = channel as usize;
            let settled = innovations[1].channels[index].iter().filter(|e| !e.is_nan()).count();
            let white = COST_OF_NOISE * (settled / BUNDLE).max(1) as f64;
            let extended_misfit = found.best.channel_cost[index] / white;
            let slams = if channel == Channel::Position { 0.0 } else { SLAMS };
            let calm = calm_misfit(&innovations[1].channels[index], slams);
            Balance {
                channel,
                nominal_misfit: found.null.channel_cost[index] / white,
                extended_misfit,
                remaining_dispersion: dispersion[index],
                closed: calm < closed_cost(channel) && dispersion[index] < closed_dispersion(channel)
                    || like_noise(calm_misfit(&innovations[1].channels[index], SLAMS), dispersion[index]),
                depends_on: Vec::new(),
                peak: None,
            }
        })
        .collect()
}
