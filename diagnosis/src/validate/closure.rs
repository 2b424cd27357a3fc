//! Closure: whether anything beyond noise is left in a balance.

use crate::balances::observers::Innovations;
use crate::constants;
use crate::data::channel::Channel;
use crate::estimate::likelihood::{COST_OF_NOISE, misfit};
use crate::estimate::problem::{Fit, Problem};
use crate::outcome::Balance;
use crate::select::search::Found;

/// The long-run variance below which a balance is closed.
fn closed_dispersion(channel: Channel) -> f64 {
    if channel == Channel::Position {
        constants::closed_dispersion_force()
    } else {
        constants::closed_dispersion_mass()
    }
}

/// Whether a balance of this misfit and long-run variance may be noise.
pub(crate) fn like_noise(misfit: f64, dispersion: f64) -> bool {
    misfit < constants::like_noise() && dispersion < constants::like_noise()
}

/// The misfit below which a balance is closed.
pub(crate) fn closed_cost(channel: Channel) -> f64 {
    if channel == Channel::Position { constants::closed_cost_force() } else { constants::closed_cost_mass() }
}

/// The channels of which samples were judged.
pub(crate) fn judged<'a>(problem: &'a Problem<'_>) -> impl Iterator<Item = Channel> + use<'a> {
    let judged = |channel: &Channel| problem.judgeable & channel.bit() != 0 && problem.noise_cost(channel.bit()) > 0.0;
    Channel::ALL.into_iter().filter(judged)
}

/// What a fit costs in a channel over what white noise would cost, of the samples that were judged, however many are masked.
pub(crate) fn misfit_of(problem: &Problem<'_>, fit: &Fit, channel: Channel) -> f64 {
    fit.channel_cost[channel as usize] / (COST_OF_NOISE * (2.0 * problem.noise_cost(channel.bit())).max(1.0))
}

/// Whether the balances of the piston and of both chambers were judged on the part held back, and all that were are closed there
/// and err no more than noise. A quarter of the log tells a long-run variance less well than all of it does.
pub(crate) fn holds_like_noise(problem: &Problem<'_>, fit: &Fit) -> bool {
    let held = problem.held_back();
    let Some(fit) = held.evaluate_as_is(fit.hypothesis.clone()) else { return false };
    let dispersion = held.dispersion_at(&fit);
    let judged: Vec<Channel> = judged(&held).collect();
    let like_noise = |channel: &Channel| {
        misfit_of(&held, &fit, *channel) < constants::like_noise()
            && dispersion[*channel as usize] < closed_dispersion(*channel)
    };
    let needed = [Channel::Position, Channel::PressureA, Channel::PressureB];
    needed.iter().all(|channel| judged.contains(channel)) && judged.iter().all(like_noise)
}

/// Misfit of each balance without and with the causes, and whether it is closed.
pub(crate) fn balances(problem: &Problem<'_>, found: &Found, innovations: &[Innovations; 2]) -> Vec<Balance> {
    let dispersion = problem.dispersion_at(&found.best);
    let averaged = problem.record.averaged();
    judged(problem)
        .map(|channel| {
            let index = channel as usize;
            let misfit = misfit(&innovations[1].channels[index], averaged);
            Balance {
                channel,
                nominal_misfit: misfit_of(problem, &found.null, channel),
                extended_misfit: misfit_of(problem, &found.best, channel),
                remaining_dispersion: dispersion[index],
                closed: misfit < closed_cost(channel) && dispersion[index] < closed_dispersion(channel)
                    || like_noise(misfit, dispersion[index]),
                depends_on: Vec::new(),
                peak: None,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_balance_may_keep_more_than_a_mass_balance_and_only_near_white_errors_may_be_noise() {
        for channel in [Channel::PressureA, Channel::PressureB, Channel::Supply] {
            assert!(closed_cost(channel) < closed_cost(Channel::Position), "{channel:?}");
            assert!(closed_dispersion(channel) < closed_dispersion(Channel::Position), "{channel:?}");
        }
        for (misfit, dispersion, expected) in [(1.0, 1.0, true), (1.2, 1.2, true), (1.3, 1.0, false), (1.0, 1.3, false)]
        {
            assert_eq!(like_noise(misfit, dispersion), expected, "{misfit} {dispersion}");
        }
    }
}
