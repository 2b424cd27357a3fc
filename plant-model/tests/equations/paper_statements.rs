//! What the paper says of its model, and what physics says of any such model.

use plant_model::{Effect, Effects, Plant, Rig, Simulator, State, Stepper, Tolerance};

const TICK_S: f64 = 1.0e-3;

fn proportional_step(rig: &Rig<f64>, seconds: f64) -> Vec<f64> {
    let mut simulator = Simulator::<f64>::new(rig, &Effects::none()).unwrap();
    (0..(seconds / TICK_S) as usize)
        .map(|_| {
            let y = simulator.state().y_m;
            simulator.advance(4.0 * (0.045 - y), TICK_S);
            simulator.state().y_m
        })
        .collect()
}

fn rise_time_s(trace: &[f64]) -> f64 {
    trace.iter().position(|y| *y >= 0.9 * 0.045).expect("the step is reached") as f64 * TICK_S
}

fn maximum(trace: &[f64]) -> f64 {
    trace.iter().copied().fold(f64::MIN, f64::max)
}

#[test]
fn small_bore_is_fastest_overshoots_and_hunts() {
    let a = proportional_step(&Rig::paper_a(), 20.0);
    let b = proportional_step(&Rig::paper_b(), 20.0);
    let c = proportional_step(&Rig::paper_c(), 20.0);
    assert!(rise_time_s(&a) < rise_time_s(&b) && rise_time_s(&a) < rise_time_s(&c));
    assert!(maximum(&a) > 1.05 * 0.045, "overshoot {}", maximum(&a));
    let late = &a[a.len() / 2..];
    let swing = maximum(late) - late.iter().copied().fold(f64::MAX, f64::min);
    assert!(swing > 1.0e-4, "case (a) hunts around the target: swing {swing} m");
}

#[test]
fn large_bore_does_not_overshoot_and_chamber_volume_matters_little() {
    let b = proportional_step(&Rig::paper_b(), 20.0);
    let c = proportional_step(&Rig::paper_c(), 20.0);
    assert!(maximum(&b) < 1.001 * 0.045, "case (b) reaches {}", maximum(&b));
    let ratio = rise_time_s(&c) / rise_time_s(&b);
    assert!((0.8..1.25).contains(&ratio), "rise times (c)/(b) = {ratio}");
}

#[test]
fn slow_motion_settles_at_the_equilibrium_pressure() {
    let rig = Rig::<f64>::paper_a();
    assert!((rig.equilibrium_pressure_pa() - 3.618e5).abs() < 50.0);
}

#[test]
fn bristle_deflection_stays_in_the_papers_invariant_set() {
    let rig = Rig::<f64>::paper_a();
    let bound = rig.friction.static_n / rig.friction.stiffness_n_per_m;
    let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
    for k in 0..20_000 {
        let t = k as f64 * TICK_S;
        simulator.advance(3.0 * (7.0 * t).sin() + 1.5 * (1.3 * t).cos(), TICK_S);
        let z = simulator.state().z_m;
        assert!(z.abs() <= bound * (1.0 + 1.0e-3), "z = {z} at t = {t}");
    }
}

#[test]
fn closed_valve_conserves_mass_and_a_cross_leak_conserves_its_sum() {
    let rig = Rig::<f64>::paper_a();
    // Isothermal exponent: p V / (R T) is the mass then.
    let isothermal = Effects::none().with(Effect::HeatTransfer, &[1.0]);
    let leaking = isothermal.with(Effect::LeakCrossPiston, &[5.0e-9]);
    for (effects, each) in [(isothermal, true), (leaking, false)] {
        let plant = Plant::new(&rig, &effects).unwrap();
        let start = plant.state_at_rest(0.1, 5.0e5, 2.0e5);
        let tight = Stepper::adaptive(&Tolerance::standard().scaled(1.0e-3));
        let mut simulator = Simulator::<f64>::from_state(plant, start, tight);
        let masses = |simulator: &Simulator<f64>| {
            let s = simulator.state();
            let (v_a, v_b) = simulator.plant().volumes_m3(s.y_m);
            (s.p_a_pa * v_a, s.p_b_pa * v_b)
        };
        let (a0, b0) = masses(&simulator);
        for _ in 0..3000 {
            simulator.advance(0.0, TICK_S);
        }
        let (a1, b1) = masses(&simulator);
        assert!(((a1 + b1) / (a0 + b0) - 1.0).abs() < 1.0e-6, "{}", (a1 + b1) / (a0 + b0) - 1.0);
        if each {
            assert!((a1 / a0 - 1.0).abs() < 1.0e-6 && (b1 / b0 - 1.0).abs() < 1.0e-6);
        } else {
            assert!((a1 / a0 - 1.0).abs() > 1.0e-2);
        }
    }
}

#[test]
fn neutral_effects_are_bit_identical() {
    let mut rig = Rig::<f64>::paper_a();
    rig.valve.dead_zone_right_v = 0.3;
    rig.valve.dead_zone_left_v = -0.25;
    let mut neutral = Effects::none();
    for effect in Effect::ALL {
        // What replaces a law has no neutral setting within its bounds.
        if !effect.identification().replaces_a_law {
            neutral.set(effect, &effect.neutral(&rig));
        }
    }
    let mut plain = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
    let mut dressed = Simulator::<f64>::new(&rig, &neutral).unwrap();
    for k in 0..5000 {
        let u = 2.0 * (0.004 * k as f64).sin();
        plain.advance(u, TICK_S);
        dressed.advance(u, TICK_S);
        assert_eq!(plain.state(), dressed.state(), "tick {k}");
        assert_eq!(plain.measure(), dressed.measure(), "tick {k}");
    }
}

#[test]
fn every_effect_at_typical_strength_changes_what_is_measured() {
    let mut rig = Rig::<f64>::paper_a();
    rig.valve.dead_zone_right_v = 0.42;
    rig.valve.dead_zone_left_v = -0.42;
    for effect in Effect::ALL {
        let values: Vec<f64> = effect.info().parameters.iter().map(|p| p.typical).collect();
        let effects = Effects::none().with(effect, &values);
        let mut plain = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
        let mut changed = Simulator::<f64>::new(&rig, &effects).unwrap();
        let mut distance = 0.0f64;
        for k in 0..10_000 {
            // Slow enough to reach both ends of the stroke, where cushions act.
            let u = 1.5 * (0.003 * k as f64).sin();
            plain.advance(u, TICK_S);
            changed.advance(u, TICK_S);
            let (m, n) = (plain.measure(), changed.measure());
            assert!(n.y_m.is_finite() && n.p_a_pa > 0.0 && n.p_b_pa > 0.0, "{effect} at tick {k}: {n:?}");
            let pressure = (m.p_a_pa - n.p_a_pa).abs().max((m.p_b_pa - n.p_b_pa).abs());
            distance = distance.max((m.y_m - n.y_m).abs() / 1.0e-3).max(pressure / 1.0e3);
        }
        assert!(distance > 0.2, "{effect} changes next to nothing: {distance}");
    }
}

#[test]
fn end_stops_hold_the_piston_and_let_it_go() {
    for rig in [Rig::<f64>::paper_a(), Rig::paper_b(), Rig::paper_c()] {
        let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
        let half = simulator.plant().half_stroke_m();
        for (u, side) in [(5.0, 1.0), (-5.0, -1.0), (5.0, 1.0)] {
            for _ in 0..20_000 {
                simulator.advance(u, TICK_S);
                let s = simulator.state();
                assert!(s.y_m.abs() <= half && s.p_a_pa > 0.5e5 && s.p_b_pa > 0.5e5, "{s:?}");
            }
            assert_eq!(simulator.state().y_m, side * half);
            assert_eq!(simulator.state().v_m_per_s, 0.0);
        }
    }
}

#[test]
fn friction_dissipates_energy_while_sliding() {
    // A free piston between sealed chambers can only lose mechanical energy (isothermal gas energy included).
    let rig = Rig::<f64>::paper_a();
    let effects = Effects::none().with(Effect::HeatTransfer, &[1.0]);
    let mut simulator = Simulator::<f64>::new(&rig, &effects).unwrap();
    simulator.set_state(State { v_m_per_s: 0.5, ..simulator.plant().state_at_rest(0.0, 3.0e5, 3.0e5) });
    let energy = |simulator: &Simulator<f64>| {
        let s = simulator.state();
        let (v_a, v_b) = simulator.plant().volumes_m3(s.y_m);
        let gas = -(s.p_a_pa * v_a * v_a.ln() + s.p_b_pa * v_b * v_b.ln());
        let sigma0 = rig.friction.stiffness_n_per_m;
        0.5 * rig.load.mass_kg * s.v_m_per_s.powi(2) + gas + 0.5 * sigma0 * s.z_m.powi(2)
    };
    let mut before = energy(&simulator);
    for _ in 0..5000 {
        simulator.advance(0.0, TICK_S);
        let now = energy(&simulator);
        assert!(now <= before + 1.0e-7, "energy grows by {}", now - before);
        before = now;
    }
}
