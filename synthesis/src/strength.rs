//! How strong an everyday fault is: the ranges from which hidden effects are drawn, scaled so that rigs compare.
//!
//! Ranges are what a maintenance engineer would call noticeable. Quantities that scale with the rig are stated relative
//! to it: leaks and dead volume to the chamber volume, forces to `F_c`, mass to the load, droop to full flow.

use crate::cause::{Cause, Which};
use crate::foreign::Foreign;
use crate::physics::Physics;
use plant_model::{Effect, Rig};
use rand::RngExt;
use rand::rngs::Xoshiro256PlusPlus;

/// The chamber volume at which leaks have the strength stated, m3 (the paper's cases (a) and (c)).
const REFERENCE_VOLUME_M3: f64 = 2.5e-4;

fn between(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64) -> f64 {
    rng.random_range(low..=high)
}

fn sign(rng: &mut Xoshiro256PlusPlus) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

/// A factor away from one by `low` to `high`, up or down.
fn factor(rng: &mut Xoshiro256PlusPlus, low: f64, high: f64, scale: f64) -> f64 {
    1.0 + scale * sign(rng) * between(rng, low, high)
}

/// A factor between `low` and `high`, but outside `gap_low..gap_high`.
fn factor_outside(rng: &mut Xoshiro256PlusPlus, [low, gap_low, gap_high, high]: [f64; 4], scale: f64) -> f64 {
    let value = if rng.random_bool(0.5) { between(rng, low, gap_low) } else { between(rng, gap_high, high) };
    1.0 + scale * (value - 1.0)
}

/// Whether an effect can be made weak: the choked law replaces the linear one as a whole.
#[must_use]
pub fn scales_to_neutral(effect: Effect) -> bool {
    effect != Effect::ChokedFlow
}

/// Draws an effect of `scale` times everyday strength: 1 is everyday, 0 neutral.
#[must_use]
pub fn draw(which: Which, rig: &Rig<f64>, scale: f64, rng: &mut Xoshiro256PlusPlus) -> Cause {
    match which {
        Which::Catalogue(effect) => Cause::Catalogue(effect, draw_effect(effect, rig, scale, rng)),
        Which::Foreign(foreign) => Cause::Foreign(foreign, draw_foreign(foreign, scale, rng)),
    }
}

fn draw_effect(effect: Effect, rig: &Rig<f64>, scale: f64, rng: &mut Xoshiro256PlusPlus) -> [f64; 3] {
    let volume = 0.5 * (rig.cylinder.volume_a0_m3 + rig.cylinder.volume_b0_m3);
    let friction = rig.friction.coulomb_n;
    let physics = Physics::new(rig, &[]);
    let rest = physics.rest_pressure_pa();
    let one = |value: f64| [value, 0.0, 0.0];
    match effect {
        Effect::ValveDeadZone => {
            let (right, left) = (rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v);
            let [a, b] = [0.0; 2].map(|_| scale * between(rng, 0.15, 0.4));
            match rng.random_range(0..3) {
                // Wider on both sides, to different degrees.
                0 => [right + a, left - b, 0.0],
                // A null offset.
                1 => {
                    let shift = a * sign(rng);
                    [right + shift, left + shift, 0.0]
                }
                // One side only.
                _ if rng.random_bool(0.5) => [right + a, left, 0.0],
                _ => [right, left - b, 0.0],
            }
        }
        Effect::ValveLag | Effect::PressureLag | Effect::LineDelay | Effect::PositionDelay => {
            one(scale * between(rng, 5e-3, 20e-3))
        }
        Effect::ValveHysteresis => one(scale * between(rng, 0.05, 0.2)),
        Effect::FillCoefficient | Effect::ExhaustCoefficient => one(factor(rng, 0.15, 0.35, scale)),
        Effect::ChokedFlow => [between(rng, 0.2, 0.5), between(rng, 0.85, 1.15), 0.0],
        Effect::SupplyDroop => {
            let full_flow = physics.fill * std::f64::consts::FRAC_PI_2 * (physics.supply_pa - rest);
            [scale * between(rng, 0.3e5, 1.0e5) / full_flow, between(rng, 0.05, 0.3), 0.0]
        }
        Effect::LeakCrossPiston | Effect::LeakChamberA | Effect::LeakChamberB => {
            one(scale * between(rng, 1e-10, 5e-10) * volume / REFERENCE_VOLUME_M3)
        }
        Effect::DeadVolume => one(scale * between(rng, 0.1, 0.4) * volume),
        Effect::HeatTransfer => {
            let gamma = rig.gas.heat_capacity_ratio;
            one(gamma + scale * (between(rng, 1.0, 1.25).min(gamma) - gamma))
        }
        Effect::PayloadMass => one(rig.load.mass_kg * factor(rng, 0.15, 0.4, scale)),
        Effect::ConstantForce => one(scale * sign(rng) * between(rng, 0.2, 0.6) * friction),
        Effect::CoulombFriction => one(factor_outside(rng, [0.6, 0.8, 1.25, 1.8], scale)),
        Effect::ViscousFriction => {
            one(rig.friction.viscous_n_s_per_m * factor_outside(rng, [0.5, 0.75, 1.3, 2.0], scale))
        }
        Effect::StaticFriction => {
            let raised = between(rng, 1.5, 2.5) * friction;
            one(rig.friction.static_n + scale * (raised - rig.friction.static_n))
        }
        Effect::FrictionAsymmetry => one(scale * sign(rng) * between(rng, 0.15, 0.4)),
        Effect::FrictionPosition => {
            if rng.random_bool(0.6) {
                [scale * sign(rng) * between(rng, 0.2, 0.5), 0.0, 0.0]
            } else {
                let wavelength = rig.cylinder.stroke_m * between(rng, 0.05, 0.2);
                [0.0, scale * between(rng, 0.2, 0.5), wavelength]
            }
        }
        Effect::FrictionPressure => {
            one(scale * between(rng, 0.2, 0.6) * friction / (2.0 * (rest - physics.atmosphere_pa)))
        }
        Effect::PositionScale => one(factor(rng, 0.03, 0.08, scale)),
        Effect::PressureAOffset | Effect::PressureBOffset => one(scale * sign(rng) * between(rng, 1e4, 3e4)),
    }
}

fn draw_foreign(foreign: Foreign, scale: f64, rng: &mut Xoshiro256PlusPlus) -> [f64; 2] {
    foreign.parameters().map(|parameter| {
        let [low, high] = parameter.range;
        let value = if low < 0.0 { sign(rng) * between(rng, 0.4 * high, high) } else { between(rng, low, high) };
        // Sizes scale; frequencies, exponents, shares and time constants are what they are.
        let is_size = parameter.name.ends_with("ratio") || parameter.name == "total_k" || parameter.name == "gap_m";
        if is_size { scale * value } else { value }
    })
}
