//! Cylinders, valves and hoses as they are bought: a rod on one side, an incline, ISO 6358, a table of the opening, hoses.

use plant_model::hose::{REFERENCE_DENSITY_KG_PER_M3, REFERENCE_TEMPERATURE_K};
use plant_model::{Effect, Effects, OpeningTable, Plant, Rig, Side, Simulator, State, Stepper, Tolerance};
use std::f64::consts::{FRAC_PI_2, PI};

/// A cylinder of bore 32 mm, rod 12 mm and stroke 200 mm, behind a valve of ISO 6358.
fn single_rod() -> Rig<f64> {
    let mut rig = Rig::paper_a();
    let area = |diameter: f64| 0.25 * PI * diameter * diameter;
    (rig.cylinder.area_a_m2, rig.cylinder.area_b_m2) = (area(0.032), area(0.032) - area(0.012));
    rig.cylinder.stroke_m = 0.2;
    (rig.cylinder.volume_a0_m3, rig.cylinder.volume_b0_m3) = (9.5e-5, 8.2e-5);
    let v = &mut rig.valve;
    (v.fill_coefficient_kg_per_s_pa, v.exhaust_coefficient_kg_per_s_pa) = (0.0, 0.0);
    (v.fill_conductance_a_m3_per_s_pa, v.fill_conductance_b_m3_per_s_pa) = (1.0e-8, 1.1e-8);
    (v.exhaust_conductance_a_m3_per_s_pa, v.exhaust_conductance_b_m3_per_s_pa) = (1.2e-8, 0.9e-8);
    (v.fill_critical_ratio_a, v.fill_critical_ratio_b) = (0.25, 0.3);
    (v.exhaust_critical_ratio_a, v.exhaust_critical_ratio_b) = (0.35, 0.2);
    rig.load.mass_kg = 4.0;
    rig
}

fn with_table_and_hoses(mut rig: Rig<f64>) -> Rig<f64> {
    let half = [[0.0, 0.0], [0.36, 0.01], [0.94, 0.06], [1.66, 0.25], [2.47, 0.48], [3.47, 0.74], [4.62, 1.0]];
    let points: Vec<[f64; 2]> = half[1..].iter().rev().map(|[u, f]| [-u, -f]).chain(half).collect();
    rig.opening = OpeningTable::new(&points).unwrap();
    [rig.valve.dead_zone_left_v, rig.valve.dead_zone_right_v] = rig.opening.closed_v();
    let h = &mut rig.hoses;
    (h.a_length_m, h.a_diameter_m, h.b_length_m, h.b_diameter_m) = (1.2, 4.0e-3, 0.8, 4.0e-3);
    rig
}

fn plant(rig: &Rig<f64>) -> Plant<f64> {
    Plant::new(rig, &Effects::none()).unwrap()
}

#[test]
fn flow_is_that_of_iso_6358_choked_and_subsonic_on_each_path_by_its_own_numbers() {
    let rig = single_rod();
    let plant = plant(&rig);
    let (supply, atmosphere) = (7.0e5, 1.0e5);
    // The standard's formula: q = C p_1 rho_0 sqrt(T_0 / T_1) sqrt(1 - ((p_2/p_1 - b)/(1 - b))^2), choked below b.
    let standard = |c: f64, b: f64, p_1: f64, p_2: f64| {
        let root = (1.0 - (((p_2 / p_1).max(b) - b) / (1.0 - b)).powi(2)).sqrt();
        c * p_1 * REFERENCE_DENSITY_KG_PER_M3 * (REFERENCE_TEMPERATURE_K / rig.gas.temperature_k).sqrt() * root
    };
    let v = &rig.valve;
    for (side, fill, exhaust) in [
        (
            Side::A,
            (v.fill_conductance_a_m3_per_s_pa, v.fill_critical_ratio_a),
            (v.exhaust_conductance_a_m3_per_s_pa, v.exhaust_critical_ratio_a),
        ),
        (
            Side::B,
            (v.fill_conductance_b_m3_per_s_pa, v.fill_critical_ratio_b),
            (v.exhaust_conductance_b_m3_per_s_pa, v.exhaust_critical_ratio_b),
        ),
    ] {
        for p in [1.2e5, 2.0e5, 3.0e5, 4.5e5, 6.0e5, 6.9e5] {
            let flow = |filling| plant.orifices(side).inflow(filling, FRAC_PI_2, p, supply, atmosphere).mass_flow;
            let (into, out) = (standard(fill.0, fill.1, supply, p), standard(exhaust.0, exhaust.1, p, atmosphere));
            assert!((flow(true) / into - 1.0).abs() < 1e-12, "{side:?} {p}: {} {into}", flow(true));
            assert!((-flow(false) / out - 1.0).abs() < 1e-12, "{side:?} {p}: {} {out}", flow(false));
        }
        let choked = |p| plant.orifices(side).inflow(true, FRAC_PI_2, p, supply, atmosphere).mass_flow;
        assert_eq!(choked(1.0e5), choked(1.7e5), "choked below b p_sup");
    }
}

#[test]
fn a_rod_feels_the_atmosphere() {
    let rig = single_rod();
    let plant = plant(&rig);
    let (a, b, atmosphere) = (rig.cylinder.area_a_m2, rig.cylinder.area_b_m2, rig.supply.atmosphere_pa);
    for (p_a, p_b) in [(1.0e5, 1.0e5), (4.0e5, 4.0e5), (3.0e5, 5.0e5)] {
        let force = plant.net_force_n(0.0, 0.0, p_a, p_b);
        assert!((force - (p_a * a - p_b * b - atmosphere * (a - b))).abs() < 1e-9, "{force}");
    }
    assert_eq!(plant.net_force_n(0.0, 0.0, atmosphere, atmosphere), 0.0, "vented, nothing pushes");
}

#[test]
fn the_closed_cylinder_conserves_mass_and_the_air_takes_the_work_that_the_piston_does() {
    let mut rig = single_rod();
    // Without friction, and moved by its own speed against sealed chambers.
    (rig.friction.viscous_n_s_per_m, rig.friction.coulomb_n, rig.friction.static_n) = (0.0, 1e-6, 1e-6);
    (rig.friction.stiffness_n_per_m, rig.friction.damping_n_s_per_m, rig.friction.breakaway_m) = (1.0, 0.0, 0.0);
    let plant = plant(&rig);
    let start = State { v_m_per_s: 1.5, ..plant.state_at_rest(-0.02, 3.0e5, 3.9e5) };
    let mut stepper = Stepper::adaptive(&Tolerance::standard().scaled(1e-2));
    let mut simulator = Simulator::<f64>::from_state(plant, start, stepper);
    let gamma = rig.gas.heat_capacity_ratio;
    let energy = |s: &State<f64>| {
        let (v_a, v_b) = plant.volumes_m3(s.y_m);
        let atmosphere = rig.supply.atmosphere_pa * (rig.cylinder.area_a_m2 - rig.cylinder.area_b_m2) * s.y_m;
        (s.p_a_pa * v_a + s.p_b_pa * v_b) / (gamma - 1.0)
            + 0.5 * rig.load.mass_kg * s.v_m_per_s * s.v_m_per_s
            + atmosphere
    };
    let entropy = |p: f64, v: f64| p * v.powf(gamma);
    let before = *simulator.state();
    let mut furthest: f64 = 0.0;
    for _ in 0..300 {
        simulator.advance(0.0, 1.0e-3);
        let now = simulator.state();
        furthest = furthest.max((now.y_m - before.y_m).abs());
        assert!((energy(now) / energy(&before) - 1.0).abs() < 1e-5, "{}", energy(now) - energy(&before));
        let (v_a0, v_b0) = plant.volumes_m3(before.y_m);
        let (v_a, v_b) = plant.volumes_m3(now.y_m);
        assert!((entropy(now.p_a_pa, v_a) / entropy(before.p_a_pa, v_a0) - 1.0).abs() < 1e-5);
        assert!((entropy(now.p_b_pa, v_b) / entropy(before.p_b_pa, v_b0) - 1.0).abs() < 1e-5);
    }
    assert!(furthest > 0.01, "the piston must move: {furthest}");
    stepper = *simulator.stepper();
    assert_eq!(stepper.forced_steps(), 0);
}

#[test]
fn an_inclined_load_rests_where_the_chambers_carry_its_weight() {
    for (degrees, sine) in [(90.0, 1.0), (30.0, 0.5), (-90.0, -1.0)] {
        let mut rig = single_rod();
        rig.load.inclination_deg = degrees;
        let [p_a, p_b] = rig.equilibrium_pressures_pa();
        let force = plant(&rig).net_force_n(0.0, 0.0, p_a, p_b);
        assert!(force.abs() < 1e-3, "{degrees}: {force} N");
        let level = |p_a: f64, p_b: f64| plant(&single_rod()).net_force_n(0.0, 0.0, p_a, p_b);
        assert!((level(p_a, p_b) - sine * rig.load.mass_kg * 9.80665).abs() < 1e-3);
        // And so it stays, within what friction holds.
        let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
        (0..1000).for_each(|_| simulator.advance(0.0, 1.0e-3));
        assert!(simulator.state().y_m.abs() < 1e-4, "{degrees}: {}", simulator.state().y_m);
    }
}

#[test]
fn slow_motion_settles_around_the_equilibrium_pressures_of_the_rig() {
    let mut rig = single_rod();
    rig.cylinder.stroke_m = 2.0;
    (rig.cylinder.volume_a0_m3, rig.cylinder.volume_b0_m3) = (8.6e-4, 7.4e-4);
    (rig.friction.coulomb_n, rig.friction.static_n, rig.friction.viscous_n_s_per_m) = (0.5, 0.5, 5.0);
    rig.friction.breakaway_m = 0.0;
    let equilibrium = rig.equilibrium_pressures_pa();
    let settled = |u: f64| {
        let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
        (0..1500).for_each(|_| simulator.advance(u, 1.0e-3));
        let state = simulator.state();
        assert!(state.y_m.abs() > 0.1 && state.y_m.abs() < 0.95, "{u} V: still on its way at {} m", state.y_m);
        [state.p_a_pa, state.p_b_pa]
    };
    let (towards_b, towards_a) = (settled(0.1), settled(-0.1));
    for side in 0..2 {
        let mean = 0.5 * (towards_b[side] + towards_a[side]);
        assert!((mean / equilibrium[side] - 1.0).abs() < 0.02, "{side}: {mean} {}", equilibrium[side]);
    }
    // Two solutions of the paper's rig: its formula, and the search that other rigs need.
    let paper = Rig::<f64>::paper_a();
    let searched = plant(&paper).equilibrium_pressures_pa();
    assert!(searched.iter().all(|p| (p - paper.equilibrium_pressure_pa()).abs() < 1.0), "{searched:?}");
}

#[test]
fn hoses_add_their_volume_hold_flow_back_and_act_late_by_the_way_of_sound() {
    let (bare, with) = (single_rod(), with_table_and_hoses(single_rod()));
    let (plain, hosed) = (plant(&bare), plant(&with));
    let added = hosed.volumes_m3(0.0).0 - plain.volumes_m3(0.0).0;
    assert!((added / (0.25 * PI * 4.0e-3 * 4.0e-3 * 1.2) - 1.0).abs() < 1e-9);
    let sound = (1.4_f64 * 287.0 * 293.0).sqrt();
    let [a, b] = hosed.line_delays_s();
    assert!((a - 1.2 / sound).abs() < 1e-9 && (b - 0.8 / sound).abs() < 1e-9);
    assert!((hosed.mean_line_delay_s() - 1.0 / sound).abs() < 1e-9);
    // A line that a chamber closes fills it in the mean without that delay: less of it, but never an answer before the command.
    let delayed = |rig: &Rig<f64>, delay_s: f64| {
        let plant = Plant::new(rig, &Effects::none().with(Effect::LineDelay, &[delay_s]));
        plant.map(|plant| plant.line_delays_s())
    };
    let [a, b] = delayed(&with, -0.001).unwrap();
    assert!((a - (1.2 / sound - 0.001)).abs() < 1e-9 && (b - (0.8 / sound - 0.001)).abs() < 1e-9);
    assert_eq!(delayed(&with, -0.01), Ok([0.0; 2]));
    assert_eq!(delayed(&bare, -0.001).unwrap_err().key, "effects.line-delay.delay_s");
    // Choked throughout: the series of both has a lower critical ratio than either.
    let flow =
        |plant: &Plant<f64>, opening| plant.orifices(Side::A).inflow(true, opening, 1.0e5, 20.0e5, 1.0e5).mass_flow;
    let share = |opening| flow(&hosed, opening) / flow(&plain, opening);
    assert!((share(1e-3) - 1.0).abs() < 1e-6, "a nearly closed valve feels no hose: {}", share(1e-3));
    // C = 1 and C_t = 1.11 l/(s bar): 1/C^3 adds up to 0.835.
    let hose = hosed.coefficients().valve_a.hose.unwrap();
    let valve = hosed.orifices(Side::A).fill * FRAC_PI_2;
    let wanted = (1.0 + (valve / hose.conductance).powi(3)).powf(-1.0 / 3.0);
    assert!((share(FRAC_PI_2) - wanted).abs() < 1e-9 && (0.7..0.9).contains(&wanted), "{wanted}");
}

#[test]
fn a_chamber_feels_a_step_after_the_delay_of_its_own_hose() {
    let sound = (1.4_f64 * 287.0 * 293.0).sqrt();
    for lag_s in [0.0, 0.004] {
        let mut rig = with_table_and_hoses(single_rod());
        (rig.hoses.a_length_m, rig.hoses.b_length_m) = (0.4, 2.0);
        let effects = if lag_s > 0.0 { Effects::none().with(Effect::ValveLag, &[lag_s]) } else { Effects::none() };
        // What each chamber does depends on the other's hose through the piston alone, which friction nearly holds at first.
        let moved = |rig: &Rig<f64>, until_s: f64| {
            let mut simulator = Simulator::<f64>::new(rig, &effects).unwrap();
            let begin = *simulator.state();
            simulator.advance(3.0, until_s);
            let end = simulator.state();
            [end.p_a_pa - begin.p_a_pa, end.p_b_pa - begin.p_b_pa]
        };
        let [arrives_a, arrives_b] = [0.4, 2.0].map(|length_m| length_m / sound);
        assert_eq!(moved(&rig, arrives_a - 1.0e-5), [0.0; 2]);
        let [a, b] = moved(&rig, arrives_b - 1.0e-5);
        assert!(a > 1.0e3 && b.abs() < 0.01 * a, "lag {lag_s}: {a} {b}");
        assert!(moved(&rig, arrives_b + 2.0e-3)[1] < -100.0);
        // At the same time after each arrival, as behind two hoses of that delay.
        let mut alike = rig;
        let later = effects.with(Effect::LineDelay, &[arrives_b - arrives_a]);
        alike.hoses.b_length_m = 0.4;
        alike.cylinder.volume_b0_m3 += 0.25 * PI * 1.6 * alike.hoses.b_diameter_m.powi(2);
        let mut late = Simulator::<f64>::new(&alike, &later).unwrap();
        let begin = late.state().p_a_pa;
        late.advance(3.0, arrives_b + 2.0e-3);
        let by_late = late.state().p_a_pa - begin;
        let by_own = moved(&rig, arrives_a + 2.0e-3)[0];
        assert!((by_own / by_late - 1.0).abs() < 0.02, "lag {lag_s}: {by_own} {by_late}");
    }
}

/// A paper's rig and its valve, with hoses.
fn linear_with_hoses(mut rig: Rig<f64>) -> Rig<f64> {
    let h = &mut rig.hoses;
    (h.a_length_m, h.a_diameter_m, h.b_length_m, h.b_diameter_m) = (1.2, 4.0e-3, 0.8, 4.0e-3);
    rig
}

#[test]
fn behind_the_linear_valve_throttles_are_linear_and_the_hose_is_not() {
    let rig = with_cushions(linear_with_hoses(Rig::paper_c()));
    let ratio = 0.5;
    let mut effects = Effects::none();
    effects.set(Effect::LineRestriction, &[ratio, ratio]);
    let plant = Plant::new(&rig, &effects).unwrap();
    let (supply, atmosphere) = (rig.supply.pressure_pa, rig.supply.atmosphere_pa);
    let tube = plant.coefficients().valve_b.hose.unwrap();
    let standard = |up: f64, down: f64| {
        let beyond = ((down / up - tube.critical_ratio) / (1.0 - tube.critical_ratio)).max(0.0);
        tube.conductance * up * (1.0 - beyond * beyond).sqrt()
    };
    let line = rig.valve.fill_coefficient_kg_per_s_pa * FRAC_PI_2 / ratio;
    // The needle lets its sonic conductance's flow pass at full drop.
    let sonic = 5.0e-10 * REFERENCE_DENSITY_KG_PER_M3 * (REFERENCE_TEMPERATURE_K / rig.gas.temperature_k).sqrt();
    let needle = sonic * supply / (supply - atmosphere);
    // Far from B's end, and at it.
    for (y, needles) in [(0.0, 0.0), (plant.half_stroke_m(), 1.0)] {
        for opening in [0.01, 0.3, FRAC_PI_2] {
            for p in [1.5e5, 3.6e5, 6.5e5] {
                let flow = |filling| plant.valve_inflow(Side::B, y, filling, opening, p, supply).mass_flow;
                let (into, out) = (flow(true), -flow(false));
                // What is left of the drop behind valve and throttles is the hose's.
                let linear = |valve: f64, needles: f64| 1.0 / (valve * opening) + 1.0 / line + needles / needle;
                let before = supply - into * linear(rig.valve.fill_coefficient_kg_per_s_pa, 0.0);
                let behind = atmosphere + out * linear(rig.valve.exhaust_coefficient_kg_per_s_pa, needles);
                assert!((standard(before, p) / into - 1.0).abs() < 1e-6, "{y} {opening} {p}: {into}");
                assert!((standard(p, behind) / out - 1.0).abs() < 1e-6, "{y} {opening} {p}: {out}");
            }
        }
    }
}

#[test]
fn single_precision_follows_double_with_hoses_on_a_single_rod_cylinder_with_a_table_and_behind_the_linear_valve() {
    for rig in [with_table_and_hoses(single_rod()), linear_with_hoses(Rig::paper_c())] {
        single_precision_follows_double(&rig);
    }
}

fn single_precision_follows_double(rig: &Rig<f64>) {
    let mut exact = Simulator::<f64>::new(rig, &Effects::none()).unwrap();
    let small = rig.convert::<f32>();
    let small_plant = Plant::new(&small, &Effects::none()).unwrap();
    let [p_a, p_b] = small.equilibrium_pressures_pa();
    let start = small_plant.state_at_rest(0.0, p_a, p_b);
    let mut chip = Simulator::<f32>::from_state(small_plant, start, Stepper::equal_steps(2));
    for k in 0..3000 {
        let u = 2.0 * (f64::from(k) * 1e-3 * 2.0 * PI).sin();
        exact.advance(u, 1.0e-3);
        chip.advance(u as f32, 1.0e-3);
    }
    let (one, other) = (exact.state(), chip.state());
    assert!((one.y_m - f64::from(other.y_m)).abs() < 1e-3, "{} {}", one.y_m, other.y_m);
    assert!((one.p_a_pa - f64::from(other.p_a_pa)).abs() < 3e3, "{} {}", one.p_a_pa, other.p_a_pa);
}

/// The same with cushions of 20 mm, their needles nearly closed.
fn with_cushions(mut rig: Rig<f64>) -> Rig<f64> {
    let c = &mut rig.cushions;
    (c.cushion_a_length_m, c.cushion_a_conductance_m3_per_s_pa) = (0.02, 5.0e-10);
    (c.cushion_b_length_m, c.cushion_b_conductance_m3_per_s_pa) = (0.02, 5.0e-10);
    rig
}

#[test]
fn a_cushion_throttles_what_flows_out_on_its_length_alone_and_brakes_the_piston() {
    let (bare, cushioned) = (single_rod(), with_cushions(single_rod()));
    let (plain, with) = (plant(&bare), plant(&cushioned));
    let flow =
        |plant: &Plant<f64>, y, filling, p| plant.valve_inflow(Side::B, y, filling, FRAC_PI_2, p, 7.0e5).mass_flow;
    // B's end lies at 100 mm, its cushion begins at 80 mm and has closed the bore at 82 mm.
    for y in [-0.1, 0.0, 0.0799] {
        assert_eq!(flow(&with, y, false, 5.0e5), flow(&plain, y, false, 5.0e5), "{y}");
    }
    assert_eq!(flow(&with, 0.095, true, 5.0e5), flow(&plain, 0.095, true, 5.0e5), "the check valve lets air in");
    let share = |y| flow(&with, y, false, 5.0e5) / flow(&plain, y, false, 5.0e5);
    // Choked in both: 1/C^3 adds up, 0.9 and 0.05 l/(s bar).
    let (valve, needle) = (9.0e-9_f64, 5.0e-10_f64);
    let wanted = (1.0 + (valve / needle).powi(3)).powf(-1.0 / 3.0);
    assert!((share(0.09) / wanted - 1.0).abs() < 1e-6, "{} {wanted}", share(0.09));
    assert!((share(0.081) - 0.5 * (1.0 + wanted)).abs() < 1e-6, "half-way through the mouth");
    // Beyond the supply, air flows out through the open valve: through the needle as well.
    assert!((flow(&with, 0.09, true, 12.0e5) / flow(&plain, 0.09, true, 12.0e5)).abs() < 0.5);

    let arrives = |rig: &Rig<f64>| {
        let mut simulator = Simulator::<f64>::new(rig, &Effects::none()).unwrap();
        let mut last = 0.0;
        for _ in 0..2000 {
            simulator.advance(5.0, 1.0e-3);
            if simulator.state().y_m >= 0.0999 {
                break;
            }
            last = simulator.state().v_m_per_s;
        }
        assert!(simulator.state().y_m >= 0.0999, "the piston must arrive: {}", simulator.state().y_m);
        last
    };
    assert!(arrives(&cushioned) < 0.5 * arrives(&bare), "{} {}", arrives(&cushioned), arrives(&bare));
}

#[test]
fn a_single_acting_cylinder_rests_where_the_air_carries_the_spring_and_returns_by_it() {
    let mut rig = single_rod();
    (rig.cylinder.spring_preload_n, rig.cylinder.spring_n_per_m) = (60.0, 300.0);
    let single = plant(&rig);
    let [p_a, p_b] = rig.equilibrium_pressures_pa();
    assert_eq!(p_b, rig.supply.atmosphere_pa);
    // 60 N + 300 N/m 0.1 m on 8.04 cm2.
    assert!((p_a - 1.0e5 - 90.0 / rig.cylinder.area_a_m2).abs() < 1e-6);
    assert!(single.net_force_n(0.0, 0.0, p_a, p_b).abs() < 1e-9);
    assert!((single.net_force_n(0.05, 0.0, p_a, p_b) + 15.0).abs() < 1e-9, "50 mm out the spring presses 15 N more");

    let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
    (0..500).for_each(|_| simulator.advance(0.0, 1.0e-3));
    assert!(simulator.state().y_m.abs() < 1e-4, "{}", simulator.state().y_m);
    (0..1500).for_each(|_| simulator.advance(3.0, 1.0e-3));
    assert_eq!(simulator.state().y_m, 0.1, "out with air");
    (0..3000).for_each(|_| simulator.advance(-3.0, 1.0e-3));
    assert_eq!(simulator.state().y_m, -0.1, "in by the spring");
    assert_eq!(simulator.state().p_b_pa, rig.supply.atmosphere_pa);
}

#[test]
fn a_spool_with_inertia_answers_a_step_as_a_lag_of_second_order_does() {
    let lag = Effects::none().with(Effect::ValveLag, &[2.0e-3]);
    for inertia in [0.1, 0.25, 0.4, 1.0] {
        let mut rig = single_rod();
        rig.valve.spool_inertia = inertia;
        let mut simulator = Simulator::<f64>::new(&rig, &lag).unwrap();
        let (mut most, mut sum) = (0.0_f64, 0.0);
        for k in 1..=200 {
            simulator.advance(1.0, 1.0e-4);
            let (t, w) = (1.0e-4 * f64::from(k), simulator.state().spool_v);
            // Poles of m tau^2 s^2 + tau s + 1.
            let (sigma, product) = (0.5 / (inertia * 2.0e-3), 1.0 / (inertia * 4.0e-6));
            let root = (sigma * sigma - product).abs().sqrt();
            let (c, s) = match product - sigma * sigma {
                circular if circular > 1.0 => ((root * t).cos(), (root * t).sin() / root),
                circular if circular < -1.0 => ((root * t).cosh(), (root * t).sinh() / root),
                _ => (1.0, t),
            };
            let expected = 1.0 - (-sigma * t).exp() * (c + sigma * s);
            assert!((w - expected).abs() < 1.0e-3, "inertia {inertia} at {t} s: {w} instead of {expected}");
            most = most.max(w);
            sum += (1.0 - w) * 1.0e-4;
        }
        // What overshoots is what oscillates, and the time constant is the area above any such answer.
        assert_eq!(most > 1.001, inertia > 0.3, "{inertia}: {most}");
        assert!((sum - 2.0e-3).abs() < 1.0e-4, "{inertia}: {sum}");
    }
}

#[test]
fn cushions_and_springs_are_stated_whole() {
    let refused = |change: fn(&mut Rig<f64>)| {
        let mut rig = single_rod();
        change(&mut rig);
        rig.validate().expect_err("must be refused").key
    };
    assert_eq!(refused(|rig| rig.cushions.cushion_b_length_m = 0.01), "cushion_b.length_m");
    assert_eq!(refused(|rig| rig.cushions.cushion_a_conductance_m3_per_s_pa = 1e-9), "cushion_a.length_m");
    assert_eq!(
        refused(|rig| {
            (rig.cushions.cushion_a_length_m, rig.cushions.cushion_a_conductance_m3_per_s_pa) = (0.15, 1e-9);
        }),
        "cushion_a.length_m"
    );
    assert_eq!(refused(|rig| rig.cylinder.spring_n_per_m = -5.0), "cylinder.spring_n_per_m");
}
