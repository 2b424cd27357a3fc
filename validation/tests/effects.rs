//! Every effect of the catalogue at its typical strength, simulated by `plant-model` and by the reference equations:
//! what the sensors show must agree.

use plant_model::{Effect, Effects, Measurement, Rig, Simulator};
use validation::{Method, NUMBER_OF_STATES, OpenLoop, Reference, sampled, state};

const TICK_S: f64 = 1.0e-3;

/// What an effect means, stated a second time: as a change of the reference's parameters, of the command sequence or
/// of the measured signals.
struct Meaning {
    reference: Reference,
    commands: Vec<f64>,
    position_scale: f64,
    offset_a: f64,
    offset_b: f64,
    position_delay_ticks: usize,
}

fn whole_ticks(delay_s: f64) -> usize {
    let ticks = (delay_s / TICK_S).round();
    assert!((delay_s / TICK_S - ticks).abs() < 1e-9, "the reference delays by whole ticks only");
    ticks as usize
}

impl Meaning {
    /// `false` where the reference equations do not know the effect.
    fn apply(&mut self, effect: Effect, p: &[f64]) -> bool {
        let r = &mut self.reference;
        match effect {
            Effect::ValveDeadZone => (r.z_md, r.z_me) = (p[0], p[1]),
            Effect::ValveLag => r.tau_spool = p[0],
            Effect::ValveHysteresis => {
                let mut played = 0.0f64;
                for u in &mut self.commands {
                    played = played.max(*u - p[0]).min(*u + p[0]);
                    *u = played;
                }
            }
            Effect::FillCoefficient => r.beta_ench *= p[0],
            Effect::ExhaustCoefficient => r.beta_esv *= p[0],
            Effect::ChokedFlow => r.iso = Some((p[0], p[1])),
            Effect::SupplyDroop => r.droop = Some((p[0], p[1])),
            Effect::LeakCrossPiston => r.leak_ab = p[0],
            Effect::LeakChamberA => r.leak_a = p[0],
            Effect::LeakChamberB => r.leak_b = p[0],
            Effect::LineDelay => {
                let late = whole_ticks(p[0]);
                let n = self.commands.len();
                self.commands.splice(0..0, std::iter::repeat_n(0.0, late));
                self.commands.truncate(n);
            }
            Effect::DeadVolume => (r.v_a0, r.v_b0) = (r.v_a0 + p[0], r.v_b0 + p[0]),
            Effect::HeatTransfer => r.gamma = p[0],
            Effect::PayloadMass => r.m = p[0],
            Effect::ConstantForce => r.f_0 = p[0],
            Effect::CoulombFriction => (r.f_c, r.f_s) = (r.f_c * p[0], r.f_s * p[0]),
            Effect::ViscousFriction => r.sigma2 = p[0],
            Effect::StaticFriction => r.f_s = p[0],
            Effect::FrictionAsymmetry => r.asymmetry = p[0],
            Effect::FrictionPosition => (r.slope, r.wave) = (p[0], Some((p[1], p[2]))),
            Effect::FrictionPressure => r.k_pressure = p[0],
            Effect::PositionScale => self.position_scale = p[0],
            Effect::PressureAOffset => self.offset_a = p[0],
            Effect::PressureBOffset => self.offset_b = p[0],
            Effect::PressureLag => r.tau_pressure = p[0],
            Effect::PositionLag => r.tau_position = p[0],
            Effect::PositionDelay => self.position_delay_ticks = whole_ticks(p[0]),
            #[allow(unreachable_patterns, reason = "whoever adds an effect need not teach it to the reference too")]
            _ => return false,
        }
        true
    }

    fn measured(&self, start: [f64; NUMBER_OF_STATES]) -> Vec<Measurement<f64>> {
        let r = &self.reference;
        let trace = r.simulate(Method::DormandPrince, 1e-9, start, &self.commands, TICK_S).unwrap();
        (0..trace.len())
            .map(|k| {
                let x = &trace[k];
                let lagged = r.tau_pressure > 0.0;
                let signal = if r.tau_position > 0.0 { state::M_Y } else { state::Y };
                let y = k.checked_sub(self.position_delay_ticks).map_or(0.0, |k| trace[k][signal]);
                Measurement {
                    y_m: self.position_scale * y,
                    p_a_pa: self.offset_a + x[if lagged { state::M_A } else { state::P_A }],
                    p_b_pa: self.offset_b + x[if lagged { state::M_B } else { state::P_B }],
                    p_sup_pa: x[state::P_SUP],
                }
            })
            .collect()
    }
}

/// The effects, at typical strength, on one of the paper's rigs; `None` where the reference does not know them.
fn distance(
    name: &str,
    effects: &[Effect],
    rig: &Rig<f64>,
    reference: &Reference,
    input: OpenLoop,
) -> Option<(f64, f64)> {
    let mut set = Effects::none();
    let mut meaning = Meaning {
        reference: reference.clone(),
        commands: sampled(input, 3000, TICK_S),
        position_scale: 1.0,
        offset_a: 0.0,
        offset_b: 0.0,
        position_delay_ticks: 0,
    };
    let commands = meaning.commands.clone();
    for effect in effects {
        let values: Vec<f64> = effect.info().parameters.iter().map(|p| p.typical).collect();
        set.set(*effect, &values);
        if !meaning.apply(*effect, &values) {
            println!("{effect}: only its twin in `synthesis` proves it, the reference equations do not know it");
            return None;
        }
    }
    // Both start from the unchanged rig's equilibrium pressure.
    let mut simulator = Simulator::<f64>::new(rig, &set).unwrap();
    let start = reference.start();
    simulator.set_state(simulator.plant().state_at_rest(0.0, start[state::P_A], start[state::P_B]));
    let (mut y, mut p) = (0.0f64, 0.0f64);
    for (k, (u, truth)) in commands.iter().zip(meaning.measured(start)).enumerate() {
        simulator.advance(*u, TICK_S);
        let m = simulator.measure();
        assert!(truth.y_m.abs() < 0.49 * reference.stroke * meaning.position_scale, "{name} hits the end stop at {k}");
        y = y.max((m.y_m - truth.y_m).abs());
        p = p.max((m.p_a_pa - truth.p_a_pa).abs()).max((m.p_b_pa - truth.p_b_pa).abs());
        p = p.max((m.p_sup_pa - truth.p_sup_pa).abs());
    }
    println!(
        "{name:28} {input:?}: y within {y:.1e} m, pressures within {p:.1e} Pa, {} steps",
        simulator.stepper().steps()
    );
    Some((y, p))
}

#[test]
fn every_effect_agrees_with_the_reference_within_10_pa_and_1_um_over_3_s_and_3_um_under_steps() {
    let mut missed = Vec::new();
    let mut compared = 0;
    for effect in Effect::ALL {
        for input in OpenLoop::ALL {
            let found = distance(effect.id(), &[effect], &Rig::paper_a(), &Reference::case_a(), input);
            let Some((y, p)) = found else { continue };
            compared += 1;
            // Steps into stiction of twice the sliding force amplify any difference at the moment of breakaway.
            let limit_m = if input == OpenLoop::Steps { 3e-6 } else { 1e-6 };
            if y > limit_m || p > 10.0 {
                missed.push(format!("{effect} {input:?}: {y:.1e} m, {p:.1e} Pa"));
            }
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
    assert!(compared > 50, "no more than {compared} comparisons");
}
