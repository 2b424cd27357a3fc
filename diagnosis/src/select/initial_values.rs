//! Where a candidate effect begins: the values its fits start from, beside a fit without it.

use super::ripple_spectrum;
use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::parameter::Parameter;
use plant_model::Effect;

/// Starting values of an effect; most leave the model as it is.
pub(crate) fn initial_values(problem: &Problem<'_>, from: &Fit, effect: Effect) -> Vec<Vec<f64>> {
    let neutral: Vec<f64> = problem.parameters(effect).iter().map(|p| p.neutral).collect();
    match effect {
        Effect::ChokedFlow => vec![vec![0.25, 1.0], vec![0.5, 0.9]],
        // A play first has to be taken up before its width matters, so a start at zero may lead nowhere.
        Effect::ValveHysteresis => {
            let scale = problem.parameters(effect)[0].scale;
            vec![neutral.clone(), vec![neutral[0] + 0.5 * scale], vec![neutral[0] + 1.5 * scale]]
        }
        // Where the piston sticks at other places than predicted, and where hardly any sample lies in the dead zone as
        // stated, a small change shows nothing: a large one is tried as well.
        Effect::StaticFriction => breakaways(&problem.parameters(effect)[0]),
        Effect::CoulombFriction | Effect::ViscousFriction => {
            [1.0, 1.5, 0.7].map(|factor| vec![factor * neutral[0]]).to_vec()
        }
        Effect::ValveDeadZone => {
            let [right, left] = [neutral[0], neutral[1]];
            let moved = [[0.2, -0.2], [0.2, 0.0], [0.0, -0.2], [0.2, 0.2], [-0.2, -0.2]];
            let moved = moved.map(|[to_right, to_left]| vec![right + to_right, left + to_left]);
            std::iter::once(neutral.clone()).chain(moved).collect()
        }
        Effect::SupplyDroop => vec![vec![neutral[0], 0.03], vec![neutral[0], 0.2]],
        // What it changes, other values can change as well, all in step: the cost is a long, narrow, bent valley.
        Effect::PositionScale => {
            let parameter = problem.parameters(effect)[0];
            let at = |percent: i32| neutral[0] * (1.0 + 0.01 * f64::from(percent));
            (-10..=10).map(|percent| vec![at(percent).clamp(parameter.min, parameter.max)]).collect()
        }
        Effect::FrictionPosition => {
            let mut all = vec![neutral.clone()];
            // The wavelength shows only once there is a ripple, and its valley is narrow where there are many waves.
            for wavelength in ripple_spectrum::wavelengths(problem, from) {
                all.push(vec![neutral[0], 0.0, wavelength]);
                let around = [0.95, 1.0, 1.05].map(|factor| factor * wavelength);
                all.extend(
                    around.into_iter().flat_map(|w| [0.3, -0.3].map(|amplitude| vec![neutral[0], amplitude, w])),
                );
            }
            all
        }
        // Far from the truth the slope at the neutral setting is a poor guide to what a plainly visible change would do.
        _ => {
            let parameter = problem.parameters(effect)[0];
            let at = |factor: f64| (neutral[0] + factor * parameter.scale).clamp(parameter.min, parameter.max);
            let mut values = [0.0, 1.0, -1.0, 0.25, -0.25].map(at).to_vec();
            values.sort_by(f64::total_cmp);
            values.dedup();
            values.into_iter().map(|value| vec![value]).collect()
        }
    }
}

/// Whether an effect takes nominal values along with it, so that they start neither anew nor where they are.
pub(crate) fn moves_nominal_values(effect: Effect) -> bool {
    effect == Effect::PositionScale
}

/// Breakaway forces to start from. Where a piston sticks and slips, each breakaway that comes at another moment puts a wall
/// beside the right force, and the valley between the walls is a few percent wide.
fn breakaways(parameter: &Parameter) -> Vec<Vec<f64>> {
    let factors =
        std::iter::successors(Some(constants::breakaway_low()), |factor| Some(factor * constants::breakaway_spacing()));
    let values =
        factors.take_while(|factor| *factor < constants::breakaway_high()).map(|factor| factor * parameter.neutral);
    let within = values.filter(|value| (parameter.min..=parameter.max).contains(value));
    std::iter::once(parameter.neutral).chain(within).map(|value| vec![value]).collect()
}

/// How many starting points are fitted: several where the cost has several valleys.
pub(crate) fn initial_values_fitted(effect: Effect) -> usize {
    match effect {
        Effect::StaticFriction => 3,
        Effect::ChokedFlow
        | Effect::ValveHysteresis
        | Effect::ValveDeadZone
        | Effect::SupplyDroop
        | Effect::FrictionPosition
        | Effect::CoulombFriction => 2,
        _ => 1,
    }
}
