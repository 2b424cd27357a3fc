//! Closure: whether anything beyond noise is left in a balance.

use crate::balances::observers::Innovations;
use crate::balances::supply;
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
    errs_below(&problem.held_back(), fit, |_| constants::like_noise())
}

/// A fit to the whole log, the part held back included, if every balance is closed in either part. What the part held back alone
/// tells, as openings that the valve has nowhere else, is no gap where it can be as stated.
pub(crate) fn held_by_all(problem: &Problem<'_>, fit: &Fit) -> Option<Fit> {
    let all = problem.on(problem.record.stretches.clone());
    let fit = all.fit(fit.hypothesis.clone(), constants::iterations())?;
    let closed = errs_below(problem, &fit, closed_cost) && errs_below(&problem.held_back(), &fit, closed_cost);
    closed.then(|| all.with_errors(fit))
}

/// Whether the balances of the piston and of both chambers were judged on a part of the log, and all that were err by less than a
/// misfit there, and no longer than a closed balance.
fn errs_below(part: &Problem<'_>, fit: &Fit, most: impl Fn(Channel) -> f64) -> bool {
    let Some(fit) = part.evaluate_as_is(fit.hypothesis.clone()) else { return false };
    let dispersion = part.dispersion_at(&fit);
    let judged: Vec<Channel> = judged(part).collect();
    let errs_below = |channel: &Channel| {
        misfit_of(part, &fit, *channel) < most(*channel) && dispersion[*channel as usize] < closed_dispersion(*channel)
            || *channel == Channel::Supply && varies_by_itself(part, &fit)
    };
    let needed = [Channel::Position, Channel::PressureA, Channel::PressureB];
    needed.iter().all(|channel| judged.contains(channel)) && judged.iter().all(errs_below)
}

/// Whether a measured supply only varies by itself, and not with the flow drawn: the chambers are fed with it as measured, so that is no
/// gap of the model. Where it droops it is judged by that.
fn varies_by_itself(problem: &Problem<'_>, fit: &Fit) -> bool {
    let Some(plant) = fit.hypothesis.plant(problem.rig, &fit.hypothesis.values) else { return false };
    if plant.added().supply_droop.droop_pa_s_per_kg > 0.0 {
        return false;
    }
    let sensor_pa = fit.hypothesis.supply_sensor_pa(&fit.hypothesis.values);
    let errors = supply::beside_fast_drift(problem.record, &plant, &problem.stretches, sensor_pa);
    let left = misfit(&errors, problem.record.averaged());
    left < closed_cost(Channel::Supply)
}

/// Misfit of each balance without and with the causes, and whether it is closed.
pub(crate) fn balances(problem: &Problem<'_>, found: &Found, innovations: &[Innovations; 2]) -> Vec<Balance> {
    let dispersion = problem.dispersion_at(&found.best);
    let averaged = problem.record.averaged();
    judged(problem)
        .map(|channel| {
            let index = channel as usize;
            let misfit = misfit(&innovations[1].channels[index], averaged);
            let closed = misfit < closed_cost(channel) && dispersion[index] < closed_dispersion(channel)
                || like_noise(misfit, dispersion[index])
                || channel == Channel::Supply && varies_by_itself(problem, &found.best);
            Balance {
                channel,
                nominal_misfit: misfit_of(problem, &found.null, channel),
                extended_misfit: misfit_of(problem, &found.best, channel),
                remaining_dispersion: dispersion[index],
                closed,
                depends_on: Vec::new(),
                peak: None,
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::hypothesis::Hypothesis;
    use crate::model::nominal::nominal_parameters;
    use plant_model::OpeningTable;
    use rig_files::RigFile;

    #[test]
    fn an_opening_that_only_the_part_held_back_tells_is_no_gap_where_it_can_be_as_stated() {
        let mut file = RigFile::paper_c();
        (file.rig.valve.dead_zone_left_v, file.rig.valve.dead_zone_right_v) = (-0.4, 0.4);
        file.tolerance.default = 0.02;
        let points =
            [[-5.0, -1.0], [-2.5, -0.5], [-1.5, -0.25], [-0.4, 0.0], [0.4, 0.0], [1.5, 0.25], [2.5, 0.5], [5.0, 1.0]];
        file.rig.opening = OpeningTable::new(&points).expect("a table");
        // The last second of every four is held back: there the valve opens further.
        let command = |t_s: f64| if t_s % 4.0 < 3.0 { 1.2 } else { 2.8 } * (12.0 * t_s).sin();
        let holds = |by: f64| {
            let mut other = file.clone();
            other.rig.opening.set_opening(1, -0.5 * by);
            other.rig.opening.set_opening(6, 0.5 * by);
            let mut log = simulated(&other, &plant_model::Effects::none(), 16_001, command);
            add_noise(&mut log, 5.0e-6, 100.0);
            let record = prepare(&log, &file);
            let judgeable = judgeable(&record);
            let nominal = nominal_parameters(&file, judgeable, false, &record.u_v);
            let (signals, effort) = (Signals::default(), Effort::default());
            let problem = Problem::new((&file, &record), judgeable, &nominal, (&signals, &effort));
            let fit = problem.fit(Hypothesis::null(&nominal), constants::iterations()).expect("a fit");
            [holds_like_noise(&problem, &fit), held_by_all(&problem, &fit).is_some()]
        };
        assert_eq!([1.03, 1.5].map(holds), [[false, true], [false, false]]);
    }

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
