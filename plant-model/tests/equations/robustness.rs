//! Whatever the parameters, as long as they are valid: finite states, positive volumes and pressures, a bounded
//! bristle, no panic.

use plant_model::{Effect, Effects, OpeningTable, Plant, RIG_KEYS, Rig, Simulator, State, Stepper, rig_key};
use proptest::prelude::*;

/// A paper rig with every parameter scaled by up to ten either way within its range, repaired where values depend on each
/// other.
fn any_rig() -> impl Strategy<Value = Rig<f64>> {
    (0..3usize, proptest::collection::vec(-1.0f64..1.0, 22)).prop_map(|(case, exponents)| {
        let mut rig = [Rig::paper_a(), Rig::paper_b(), Rig::paper_c()][case];
        let mut factors = exponents.into_iter().map(|e| 10f64.powf(e));
        let mut scale = |value: &mut f64| *value *= factors.next().unwrap_or(1.0);
        scale(&mut rig.gas.gas_constant_j_per_kg_k);
        scale(&mut rig.gas.temperature_k);
        scale(&mut rig.supply.atmosphere_pa);
        scale(&mut rig.valve.fill_coefficient_kg_per_s_pa);
        scale(&mut rig.valve.exhaust_coefficient_kg_per_s_pa);
        scale(&mut rig.valve.slope_right);
        scale(&mut rig.valve.slope_left);
        scale(&mut rig.valve.max_voltage_v);
        scale(&mut rig.cylinder.area_a_m2);
        rig.cylinder.area_b_m2 = rig.cylinder.area_a_m2;
        scale(&mut rig.cylinder.stroke_m);
        scale(&mut rig.cylinder.volume_a0_m3);
        scale(&mut rig.cylinder.volume_b0_m3);
        scale(&mut rig.load.mass_kg);
        scale(&mut rig.friction.stiffness_n_per_m);
        scale(&mut rig.friction.damping_n_s_per_m);
        scale(&mut rig.friction.viscous_n_s_per_m);
        scale(&mut rig.friction.coulomb_n);
        scale(&mut rig.friction.static_n);
        scale(&mut rig.friction.stribeck_velocity_m_per_s);
        let mut more = [1.0, 1.0, 1.0];
        more.iter_mut().for_each(scale);
        rig.gas.heat_capacity_ratio = 1.0 + 0.067 * more[0];
        rig.supply.pressure_pa = rig.supply.atmosphere_pa * (1.0 + more[1]);
        for key in RIG_KEYS.iter().filter(|key| !key.limits.optional) {
            let inside = key.get(&rig).clamp(key.limits.low, key.limits.high);
            key.set(&mut rig, inside);
        }
        rig.friction.static_n = rig.friction.static_n.max(rig.friction.coulomb_n);
        rig.friction.breakaway_m = 0.099 * more[2] * rig.friction.coulomb_n / rig.friction.stiffness_n_per_m;
        rig
    })
}

/// The same as they are bought: a rod, an incline, ISO 6358 or not, a table, hoses, each anywhere within its range.
fn any_bought_rig() -> impl Strategy<Value = Rig<f64>> {
    let unit = || 0.0f64..1.0;
    let table = proptest::option::of(proptest::array::uniform4(unit()));
    let more = (proptest::array::uniform4(unit()), proptest::option::of(proptest::array::uniform2(unit())));
    let parts = proptest::array::uniform12(unit());
    (any_rig(), any::<bool>(), parts, table, more).prop_map(|(mut rig, iso6358, x, table, (more, spring))| {
        let within = |name: &str, part: f64| {
            let limits = rig_key(name).expect(name).limits;
            if limits.low > 0.0 { limits.low * (limits.high / limits.low).powf(part) } else { limits.high * part }
        };
        rig.cylinder.area_b_m2 = rig.cylinder.area_a_m2 * (0.1 + 0.9 * x[0]);
        rig.load.inclination_deg = 180.0 * x[1] - 90.0;
        if iso6358 {
            let v = &mut rig.valve;
            (v.fill_coefficient_kg_per_s_pa, v.exhaust_coefficient_kg_per_s_pa) = (0.0, 0.0);
            v.fill_conductance_a_m3_per_s_pa = within("fill_conductance_a_m3_per_s_pa", x[2]);
            v.fill_conductance_b_m3_per_s_pa = within("fill_conductance_b_m3_per_s_pa", x[3]);
            v.exhaust_conductance_a_m3_per_s_pa = within("exhaust_conductance_a_m3_per_s_pa", x[4]);
            v.exhaust_conductance_b_m3_per_s_pa = within("exhaust_conductance_b_m3_per_s_pa", x[5]);
            v.fill_critical_ratio_a = within("fill_critical_ratio_a", x[6]);
            v.exhaust_critical_ratio_b = within("exhaust_critical_ratio_b", x[7]);
        }
        let h = &mut rig.hoses;
        (h.a_length_m, h.a_diameter_m) = (within("hose_a.length_m", x[8]), within("hose_a.diameter_m", x[9]));
        (h.b_length_m, h.b_diameter_m) = (within("hose_b.length_m", x[10]), within("hose_b.diameter_m", x[11]));
        let c = &mut rig.cushions;
        let half = 0.5 * rig.cylinder.stroke_m;
        c.cushion_a_length_m = within("cushion_a.length_m", more[0]).min(half);
        c.cushion_a_conductance_m3_per_s_pa = within("cushion_a.conductance_m3_per_s_pa", more[1]);
        c.cushion_b_length_m = within("cushion_b.length_m", more[2]).min(half);
        c.cushion_b_conductance_m3_per_s_pa = within("cushion_b.conductance_m3_per_s_pa", more[3]);
        if let Some([rate, preload]) = spring {
            rig.cylinder.spring_n_per_m = within("cylinder.spring_n_per_m", rate);
            rig.cylinder.spring_preload_n = within("cylinder.spring_preload_n", preload);
        }
        if let Some([left, right, first, second]) = table {
            let points = [[-5.0, -1.0], [-left, -0.1 * first], [right, 0.0], [right + 0.1, second], [5.0, 1.0]];
            rig.opening = OpeningTable::new(&points).expect("a rising table");
            [rig.valve.dead_zone_left_v, rig.valve.dead_zone_right_v] = rig.opening.closed_v();
        }
        rig
    })
}

/// Any subset of the catalogue with values anywhere within their bounds, bounds included.
fn any_effects() -> impl Strategy<Value = Effects<f64>> {
    let value = prop_oneof![Just(0.0f64), Just(1.0), 0.0f64..1.0, 0.0f64..0.01];
    let slot = proptest::option::weighted(0.2, proptest::array::uniform3(value));
    proptest::collection::vec(slot, Effect::ALL.len()).prop_map(|slots| {
        let mut effects = Effects::none();
        for (effect, slot) in Effect::ALL.into_iter().zip(slots) {
            let Some(at) = slot else { continue };
            let values: Vec<f64> =
                effect.info().parameters.iter().zip(at).map(|(p, x)| p.min + x * (p.max - p.min)).collect();
            effects.set(effect, &values);
        }
        effects
    })
}

fn check(simulator: &Simulator<f64>, tick: usize) -> Result<(), TestCaseError> {
    let s = *simulator.state();
    let plant = simulator.plant();
    let gas = [s.p_a_pa, s.p_b_pa, s.p_sup_pa, s.p_a_sensed_pa, s.p_b_sensed_pa, s.warmth_a, s.warmth_b];
    let all = [s.y_m, s.v_m_per_s, s.z_m, s.spool_v];
    prop_assert!(all.iter().chain(&gas).all(|x| x.is_finite()), "tick {}: {:?}", tick, s);
    let (v_a, v_b) = plant.volumes_m3(s.y_m);
    prop_assert!(v_a > 0.0 && v_b > 0.0);
    prop_assert!(s.p_a_pa > 0.0 && s.p_b_pa > 0.0, "tick {}: {:?}", tick, s);
    prop_assert!(s.y_m.abs() <= plant.half_stroke_m());
    let m = simulator.measure();
    prop_assert!([m.y_m, m.p_a_pa, m.p_b_pa, m.p_sup_pa].iter().all(|x| x.is_finite()));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn any_valid_rig_with_any_valid_effects_stays_physical(
        rig in prop_oneof![any_rig(), any_bought_rig()],
        mut effects in any_effects(),
        commands in proptest::collection::vec(-5.0f64..5.0, 60),
    ) {
        // Less delay than hoses have needs hoses.
        if let Some([delay_s]) = effects.get(Effect::LineDelay) && !rig.has_hoses() {
            effects.set(Effect::LineDelay, &[delay_s.max(0.0)]);
        }
        let Ok(mut simulator) = Simulator::<f64>::new(&rig, &effects) else {
            panic!("valid rig and effects are refused: {:?}", Simulator::<f64>::new(&rig, &effects).err());
        };
        for (k, u) in commands.iter().enumerate() {
            for _ in 0..5 {
                simulator.advance(*u, 1.0e-3);
                check(&simulator, k)?;
            }
        }
    }

    #[test]
    fn paper_rigs_under_any_command_keep_the_bristle_in_the_invariant_set(
        case in 0..3usize,
        commands in proptest::collection::vec(-5.0f64..5.0, 60),
    ) {
        let rig = [Rig::<f64>::paper_a(), Rig::paper_b(), Rig::paper_c()][case];
        let bound = rig.friction.static_n / rig.friction.stiffness_n_per_m;
        let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
        for (k, u) in commands.iter().enumerate() {
            for _ in 0..20 {
                simulator.advance(*u, 1.0e-3);
                check(&simulator, k)?;
                let z = simulator.state().z_m;
                prop_assert!(z.abs() <= bound * 1.001, "{} beyond {}", z, bound);
            }
        }
        prop_assert_eq!(simulator.stepper().forced_steps(), 0);
    }

    #[test]
    fn no_sliding_force_lies_below_the_least_and_the_short_way_of_elastic_bristles_is_the_long_one(
        rig in any_rig(),
        asymmetry in -0.95f64..0.95,
        along in (-0.95f64..0.95, -0.95f64..0.95, 0.01f64..0.5),
        growth in 0.0f64..1.0e-4,
        (y, v, z) in (-1.0f64..1.0, -2.0f64..2.0, -1.5f64..1.5),
        pressures in (0.0f64..1.0e6, 0.0f64..1.0e6),
    ) {
        let effects = Effects::none()
            .with(Effect::FrictionAsymmetry, &[asymmetry])
            .with(Effect::FrictionPosition, &[along.0, along.1, along.2])
            .with(Effect::FrictionPressure, &[growth]);
        let plant = Plant::new(&rig, &effects).expect("a valid rig");
        let mut state = State {
            y_m: y * plant.half_stroke_m(),
            v_m_per_s: v,
            p_a_pa: pressures.0,
            p_b_pa: pressures.1,
            ..State::default()
        };
        let level = plant.friction_level(&state);
        let least_n = plant.least_friction_level_n();
        prop_assert!(level.force_n >= least_n * (1.0 - 1.0e-12), "{:?} {}", level, least_n);
        state.z_m = z * level.force_n / rig.friction.stiffness_n_per_m;
        let (short, long) = (plant.friction_at(&state), plant.friction().respond(state.z_m, v, &level));
        prop_assert_eq!(short.force_n, long.force_n);
        prop_assert_eq!(short.bristle_rate, long.bristle_rate);
    }

    #[test]
    fn single_precision_with_equal_steps_stays_physical(
        case in 0..3usize,
        commands in proptest::collection::vec(-5.0f32..5.0, 60),
    ) {
        let rig = [Rig::<f32>::paper_a(), Rig::paper_b(), Rig::paper_c()][case];
        let plant = plant_model::Plant::new(&rig, &Effects::none()).unwrap();
        let p = rig.equilibrium_pressure_pa();
        let mut simulator =
            Simulator::<f32>::from_state(plant, plant.state_at_rest(0.0, p, p), Stepper::equal_steps(2));
        let bound = rig.friction.static_n / rig.friction.stiffness_n_per_m;
        let mut fastest = 0.0f32;
        for u in commands {
            for _ in 0..20 {
                simulator.advance(u, 1.0e-3);
                let s = simulator.state();
                fastest = fastest.max(s.v_m_per_s.abs());
                // Without error control a breakaway within one step overshoots by part of the step's travel; what hits an
                // end stop keeps the bristle it arrived with.
                let overshoot = 0.5e-3 * fastest;
                prop_assert!(s.y_m.is_finite() && s.v_m_per_s.is_finite(), "{:?}", s);
                prop_assert!(s.z_m.abs() <= bound + overshoot, "{:?} after {} m/s", s, fastest);
                prop_assert!(s.p_a_pa > 0.5e5 && s.p_b_pa > 0.5e5, "{:?}", s);
            }
        }
    }
}
