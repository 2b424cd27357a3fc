//! A rig of another cross-section, with masses, forces and flows larger in proportion, moves alike at the same pressures.

use plant_model::similarity::size_exponent;
use plant_model::{Effect, Effects, Plant, RIG_KEYS, Rig, Simulator, Stepper, Tolerance};

/// Position and pressures through sliding, creeping and an end stop.
fn run(rig: &Rig<f64>, effects: &Effects<f64>) -> Vec<[f64; 3]> {
    // The same beginning: the one of a rig file depends on its flow coefficients.
    let plant = Plant::new(rig, effects).expect("a valid rig");
    let begin = plant.state_at_rest(0.0, 3.6e5, 3.6e5);
    let mut simulator = Simulator::<f64>::from_state(plant, begin, Stepper::adaptive(&Tolerance::standard()));
    (0..1500)
        .map(|tick| {
            let t = f64::from(tick) * 1.0e-3;
            simulator.advance(
                if tick < 1200 { 1.2 * libm::sin(9.0 * t) + 0.4 * libm::sin(31.0 * t + 0.4) } else { 3.0 },
                1.0e-3,
            );
            let m = simulator.measure();
            [m.y_m, m.p_a_pa, m.p_b_pa]
        })
        .collect()
}

#[test]
fn a_common_factor_on_areas_masses_forces_and_flows_shows_in_no_log() {
    const FACTOR: f64 = 1.25;
    // The walls' area goes with the bore, not with the cross-section.
    for effect in Effect::ALL.into_iter().filter(|effect| *effect != Effect::WallHeat) {
        let nominal = Rig::<f64>::paper_b();
        let mut rig = nominal;
        let identification = effect.identification();
        // What a factor acts on grows by the factor.
        let grown_by_effect = |path: &str| match effect {
            Effect::PistonArea => path.starts_with("cylinder.area"),
            _ if identification.size_exponents == [0; 3] => false,
            _ => identification.stands_for.keys().contains(&path) || identification.carries_along.contains(&path),
        };
        for key in RIG_KEYS.iter().filter(|key| !grown_by_effect(key.path)) {
            key.set(&mut rig, key.get(&nominal) * FACTOR.powi(size_exponent(key.name).into()));
        }
        let typical: Vec<f64> = effect.info().parameters.iter().map(|p| p.typical).collect();
        let grown: Vec<f64> =
            typical.iter().enumerate().map(|(k, value)| value * FACTOR.powi(effect.size_exponent(k).into())).collect();
        let [one, other] =
            [(nominal, typical), (rig, grown)].map(|(rig, values)| run(&rig, &Effects::none().with(effect, &values)));
        for (tick, (one, other)) in one.iter().zip(&other).enumerate() {
            let off = [1.0e-6, 1.0, 1.0].iter().zip(one.iter().zip(other)).map(|(unit, (a, b))| (a - b).abs() / unit);
            assert!(off.fold(0.0, f64::max) < 1.0, "{effect}, tick {tick}: {one:?} {other:?}");
        }
    }
}

#[test]
fn a_quantity_tells_by_its_unit_how_it_grows() {
    for (name, exponent) in [
        ("area_a_m2", 1),
        ("volume_b0_m3", 1),
        ("mass_kg", 1),
        ("coulomb_n", 1),
        ("viscous_n_s_per_m", 1),
        ("stiffness_n_per_m", 1),
        ("coefficient_n_per_pa", 1),
        ("conductance_kg_per_s_pa", 1),
        ("fill_conductance_a_m3_per_s_pa", 1),
        ("droop_pa_s_per_kg", -1),
        ("offset_pa", 0),
        ("stroke_m", 0),
        ("delay_s", 0),
        ("stribeck_velocity_m_per_s", 0),
        ("gas_constant_j_per_kg_k", 0),
        ("max_voltage_v", 0),
        ("scale", 0),
    ] {
        assert_eq!(size_exponent(name), exponent, "{name}");
    }
}
