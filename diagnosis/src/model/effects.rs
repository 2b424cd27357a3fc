//! The effects of the catalogue as hypotheses on this rig: where they act, their parameters, what they stand in for.

use super::parameter::{Parameter, Slot};
use crate::data::channel::{Channel, Channels};
use crate::data::quality::Quality;
use plant_model::Effect;
use rig_files::RigFile;

const A: Channels = Channel::PressureA.bit();
const B: Channels = Channel::PressureB.bit();
const Y: Channels = Channel::Position.bit();
const S: Channels = Channel::Supply.bit();

/// The channels an effect acts on, in the single-balance predictions.
pub(crate) fn channels(effect: Effect) -> Channels {
    match effect {
        Effect::ValveDeadZone
        | Effect::ValveLag
        | Effect::ValveHysteresis
        | Effect::FillCoefficient
        | Effect::ExhaustCoefficient
        | Effect::ChokedFlow
        | Effect::LeakCrossPiston
        | Effect::LineDelay
        | Effect::DeadVolume
        | Effect::HeatTransfer => A | B,
        Effect::SupplyDroop => A | B | S,
        Effect::LeakChamberA => A,
        Effect::LeakChamberB => B,
        Effect::PayloadMass
        | Effect::ConstantForce
        | Effect::CoulombFriction
        | Effect::ViscousFriction
        | Effect::StaticFriction
        | Effect::FrictionAsymmetry
        | Effect::FrictionPosition
        | Effect::FrictionPressure => Y,
        Effect::PositionScale | Effect::PressureLag | Effect::PositionDelay => A | B | Y,
        Effect::PressureAOffset => A | Y,
        Effect::PressureBOffset => B | Y,
    }
}

/// The nominal values an effect stands in for.
pub(crate) fn twins(effect: Effect) -> &'static [&'static str] {
    match effect {
        Effect::FillCoefficient => &["valve.fill_coefficient_kg_per_s_pa"],
        Effect::ExhaustCoefficient => &["valve.exhaust_coefficient_kg_per_s_pa"],
        Effect::PayloadMass => &["load.mass_kg"],
        Effect::CoulombFriction => &["friction.coulomb_n"],
        Effect::StaticFriction => &["friction.static_n"],
        Effect::ViscousFriction => &["friction.viscous_n_s_per_m"],
        Effect::DeadVolume => &["cylinder.volume_a0_m3", "cylinder.volume_b0_m3"],
        _ => &[],
    }
}

/// Relative standard error that the value of an effect takes over from the nominal value it multiplies: only their
/// product shows.
pub(crate) fn inherited(effect: Effect, nominal: &[Parameter]) -> f64 {
    if !matches!(effect, Effect::FillCoefficient | Effect::ExhaustCoefficient | Effect::CoulombFriction) {
        return 0.0;
    }
    let of_twin = |p: &&Parameter| matches!(p.slot, Slot::Nominal(key) if twins(effect).contains(&key.path));
    nominal.iter().find(of_twin).and_then(|p| Some(p.tolerance? / p.neutral.abs())).unwrap_or(0.0)
}

/// An effect whose parameters all lie within this part of a plainly visible change is no cause.
const NEGLIGIBLE: f64 = 0.04;

/// Breakaway forces are told apart from this many standard deviations of the measured pressure force on.
const BREAKAWAY_SIGMAS: f64 = 3.0;
/// Levels of friction as a whole show in sliding too: they are told apart from this part of it on, but from no less than
/// this part of the nominal friction.
const LEVEL_SIGMAS: f64 = 0.5;
const NEGLIGIBLE_LEVEL: f64 = 0.03;
/// A constant force and friction that differs by direction are told apart from nothing from this part of friction on.
const FAINT: f64 = 0.02;
/// A plainly visible change of friction, as a part of the nominal one.
const FRICTION_SCALE: f64 = 0.3;

/// The parameters of an effect on this rig, for a log of this quality.
pub(crate) fn effect_parameters(
    rig: &RigFile,
    effect: Effect,
    judgeable: Channels,
    quality: &Quality,
) -> Vec<Parameter> {
    // A rig file may state an effect already; then that is where the hypothesis starts.
    let mut neutral = effect.neutral(&rig.rig);
    for (to, from) in neutral.iter_mut().zip(rig.effects.get(effect).unwrap_or_default()) {
        *to = *from;
    }
    let noise = quality.pressure_a.standard_deviation.hypot(quality.pressure_b.standard_deviation);
    let force_noise_n = rig.rig.cylinder.area_m2 * noise;
    let info = effect.info();
    info.parameters
        .iter()
        .enumerate()
        .map(|(index, parameter)| {
            let at = neutral[index];
            // Typical values belong to a rig like the paper's; what scales with the rig is taken relative to it.
            let scale = match effect {
                Effect::PayloadMass | Effect::ViscousFriction | Effect::StaticFriction => 0.3 * at,
                Effect::ConstantForce => FRICTION_SCALE * rig.rig.friction.coulomb_n,
                Effect::DeadVolume => 0.2 * rig.rig.cylinder.volume_a0_m3,
                Effect::FrictionPosition if index == 2 => 0.02 * at.max(0.005),
                Effect::FrictionPressure => FRICTION_SCALE * rig.rig.friction.coulomb_n / 5.0e5,
                Effect::LeakChamberA | Effect::LeakChamberB | Effect::LeakCrossPiston => {
                    0.03 * rig.rig.valve.fill_coefficient_kg_per_s_pa
                }
                Effect::SupplyDroop if index == 1 => 0.05,
                // What is typical may be what the rig file states already.
                Effect::ValveDeadZone => 0.3,
                Effect::ChokedFlow if index == 1 => 0.1,
                Effect::SupplyDroop => 0.02 / rig.rig.valve.fill_coefficient_kg_per_s_pa,
                _ => (parameter.typical - at).abs().max(1.0e-3 * parameter.typical.abs()).max(1.0e-12),
            };
            Parameter {
                slot: Slot::Effect(effect, index),
                neutral: at,
                scale,
                negligible: match effect {
                    // A choked valve is another law, not more or less of the nominal one.
                    Effect::ChokedFlow => 0.0,
                    // A resting piston breaks away at the first noise that takes the force over its limit.
                    Effect::StaticFriction => (BREAKAWAY_SIGMAS * force_noise_n).max(NEGLIGIBLE * scale),
                    Effect::CoulombFriction | Effect::FrictionPressure => {
                        let relative = LEVEL_SIGMAS * force_noise_n / rig.rig.friction.coulomb_n;
                        relative.max(NEGLIGIBLE_LEVEL) * scale / FRICTION_SCALE
                    }
                    // A faint ripple of some wavelength is found in any noise, and a faint slope in any stick-slip.
                    Effect::FrictionPosition if index < 2 => NEGLIGIBLE_LEVEL,
                    Effect::ViscousFriction => NEGLIGIBLE_LEVEL * at,
                    Effect::FrictionAsymmetry => FAINT,
                    Effect::ConstantForce => FAINT * rig.rig.friction.coulomb_n,
                    // Within a sampling interval, delays and lags are a matter of how the logger takes its samples.
                    _ if parameter.name.ends_with("_s") && effect != Effect::SupplyDroop => {
                        quality.interval_s.max(NEGLIGIBLE * scale)
                    }
                    _ => NEGLIGIBLE * scale,
                },
                tolerance: None,
                min: parameter.min,
                max: parameter.max,
                channels: channels(effect) & judgeable,
            }
        })
        .collect()
}
