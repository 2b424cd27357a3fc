//! Where a candidate effect begins: the values its fits start from, beside a fit without it.

use crate::fit::{Fit, Problem};
use crate::hypothesis::{Hypothesis, Parameter, Slot};
use crate::ripple;
use plant_model::Effect;

/// Starting values of an effect; most leave the model as it is.
pub(crate) fn starts(problem: &Problem<'_>, from: &Fit, effect: Effect) -> Vec<Vec<f64>> {
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
            for wavelength in ripple::wavelengths(problem, from) {
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
pub(crate) fn moves_in_step(effect: Effect) -> bool {
    effect == Effect::PositionScale
}

/// A fit with one of its causes as another that does nearly the same, at the values that do it: from elsewhere a fit hardly
/// finds its way there. `None` for causes without such an image.
pub(crate) fn mirror(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Hypothesis> {
    let other = match effect {
        // Mechanics see the difference of the pressures, and the air of one chamber or the other must be a few percent off.
        Effect::PressureAOffset => Effect::PressureBOffset,
        Effect::PressureBOffset => Effect::PressureAOffset,
        // The sum of the pressures may hardly change.
        Effect::CoulombFriction => Effect::FrictionPressure,
        Effect::FrictionPressure => Effect::CoulombFriction,
        // Choked flow has a scale of its own: with it, less in one direction is more in the other.
        Effect::FillCoefficient if fit.hypothesis.effects.contains(&Effect::ChokedFlow) => Effect::ExhaustCoefficient,
        Effect::ExhaustCoefficient if fit.hypothesis.effects.contains(&Effect::ChokedFlow) => Effect::FillCoefficient,
        _ => return None,
    };
    let h = &fit.hypothesis;
    let first = |effect: Effect| problem.parameters(effect).first().copied();
    let (from, to) = (first(effect)?, first(other)?);
    if h.effects.contains(&other) || to.channels == 0 {
        return None;
    }
    let away = h.values_of(effect).first()? - from.neutral;
    let coulomb_n = problem.rig.rig.friction.coulomb_n;
    // What the cause adds to the level of friction, and how the image makes the same.
    let (added_n, start) = match effect {
        Effect::CoulombFriction => (away * coulomb_n, to.neutral + away * coulomb_n / gauge_sum_pa(problem)?),
        Effect::FrictionPressure => {
            let added_n = away * gauge_sum_pa(problem)?;
            (added_n, to.neutral + added_n / coulomb_n)
        }
        Effect::FillCoefficient | Effect::ExhaustCoefficient => (0.0, to.neutral / (1.0 + away / from.neutral)),
        _ => (0.0, to.neutral - away),
    };
    let start = [start.clamp(to.min, to.max)];
    let mut out = h.without(effect, problem.nominal).with(other, problem.parameters(other), &start, false);
    if matches!(effect, Effect::FillCoefficient | Effect::ExhaustCoefficient) {
        out.scale(Slot::Effect(Effect::ChokedFlow, 1), 1.0 + away / from.neutral);
    }
    if added_n == 0.0 {
        return Some(out);
    }
    // A factor on friction multiplies what is stated of breaking away and leaves alone what is fitted; pressure adds to both.
    for (parameter, value) in out.parameters.iter().zip(&mut out.values) {
        match parameter.slot {
            Slot::Effect(Effect::StaticFriction, _) => {
                let by_n = if effect == Effect::CoulombFriction { -added_n } else { added_n };
                *value = (*value + by_n).clamp(parameter.min, parameter.max);
            }
            Slot::Nominal(key) if key.path == "friction.static_n" || key.path == "friction.coulomb_n" => {
                *value = h.value(parameter.slot).unwrap_or(parameter.neutral);
            }
            Slot::Effect(e, 0) if e == other => *value = start[0],
            _ => {}
        }
    }
    Some(out)
}

/// The mean of both chambers' gauge pressures, summed; `None` unless both are measured and above atmosphere.
fn gauge_sum_pa(problem: &Problem<'_>) -> Option<f64> {
    let record = problem.record;
    let atmosphere_pa = problem.rig.rig.supply.atmosphere_pa;
    let mean = |signal: &[f64]| signal.iter().sum::<f64>() / signal.len().max(1) as f64;
    let both = record.available.pressure_a && record.available.pressure_b;
    let sum = mean(&record.p_a_pa) + mean(&record.p_b_pa) - 2.0 * atmosphere_pa;
    (both && sum > 0.1 * atmosphere_pa).then_some(sum)
}

/// Breakaway forces to start from. Where a piston sticks and slips, each breakaway that comes at another moment puts a wall
/// beside the right force, and the valley between the walls is a few percent wide.
fn breakaways(parameter: &Parameter) -> Vec<Vec<f64>> {
    const FACTORS: [f64; 2] = [0.7, 3.2];
    const SPACING: f64 = 1.04;
    let factors = std::iter::successors(Some(FACTORS[0]), |factor| Some(factor * SPACING));
    let values = factors.take_while(|factor| *factor < FACTORS[1]).map(|factor| factor * parameter.neutral);
    let within = values.filter(|value| (parameter.min..=parameter.max).contains(value));
    std::iter::once(parameter.neutral).chain(within).map(|value| vec![value]).collect()
}

/// How many starting points are fitted: several where the cost has several valleys.
pub(crate) fn starts_fitted(effect: Effect) -> usize {
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
