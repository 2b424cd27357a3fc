//! The functions with which one balance is evaluated against measured signals say what the simulation does.

use plant_model::effects::ChamberFlow;
use plant_model::{Effect, Effects, Plant, Rig, Side, Simulator};

fn plant(effects: &Effects<f64>) -> Plant<f64> {
    Plant::new(&Rig::paper_a(), effects).unwrap()
}

#[test]
fn leaks_sum_up_and_conserve_what_crosses_the_piston() {
    let cross = Effects::none().with(Effect::LeakCrossPiston, &[2.0e-10]);
    let both = cross.with(Effect::LeakChamberA, &[1.0e-10]);
    let (p_a, p_b) = (5.0e5, 3.0e5);
    let a = plant(&cross).leaks(Side::A, p_a, Some(p_b));
    let b = plant(&cross).leaks(Side::B, p_b, Some(p_a));
    assert_eq!(a, ChamberFlow { mass_flow: -2.0e-10 * 2.0e5, by_chamber: -2.0e-10, by_other: 2.0e-10 });
    assert_eq!(a.mass_flow, -b.mass_flow);
    let sum = plant(&both).leaks(Side::A, p_a, Some(p_b)).mass_flow;
    assert!((sum + 2.0e-10 * 2.0e5 + 1.0e-10 * 4.0e5).abs() < 1e-18, "{sum}");
    // A log without p_b tells nothing of what crosses, and everything of what leaves.
    assert!((plant(&both).leaks(Side::A, p_a, None).mass_flow + 1.0e-10 * 4.0e5).abs() < 1e-18);
}

#[test]
fn true_pressures_and_the_true_position_are_what_the_sensors_showed_without_gain_offset_and_lag() {
    let effects = Effects::none()
        .with(Effect::PressureAOffset, &[1.5e4])
        .with(Effect::PressureBOffset, &[-1.0e4])
        .with(Effect::PressureAGain, &[1.04])
        .with(Effect::PressureBGain, &[0.93])
        .with(Effect::PressureLag, &[0.02])
        .with(Effect::PositionScale, &[1.05])
        .with(Effect::PositionLag, &[0.01]);
    let mut simulator = Simulator::<f64>::new(&Rig::paper_a(), &effects).unwrap();
    for _ in 0..300 {
        simulator.advance(0.8, 1.0e-3);
    }
    let plant = *simulator.plant();
    let (state, shown) = (*simulator.state(), simulator.measure());
    let lag = plant.added().pressure_lag;
    for (side, p, sensed, shown, [gain, offset]) in [
        (Side::A, state.p_a_pa, state.p_a_sensed_pa, shown.p_a_pa, [1.04, 1.5e4]),
        (Side::B, state.p_b_pa, state.p_b_sensed_pa, shown.p_b_pa, [0.93, -1.0e4]),
    ] {
        assert!((gain * sensed + offset - shown).abs() < 1e-9, "a gain, then an offset: {side:?}");
        assert!((plant.shown_pressure_pa(side, sensed) - shown).abs() < 1e-9);
        assert!((plant.pressure_behind_lag_pa(side, shown) - sensed).abs() < 1e-6);
        let slope = gain * (p - sensed) / lag.time_constant_s;
        assert!((plant.true_pressure_pa(side, shown, slope) - p).abs() < 1e-6, "{side:?}");
    }
    assert!((plant.true_position_m(shown.y_m) - state.y_sensed_m).abs() < 1e-12);
    let slope = 1.05 * (state.y_m - state.y_sensed_m) / 0.01;
    assert!((state.y_m - state.y_sensed_m).abs() > 1e-3, "the piston moves");
    assert!((plant.true_position_m(plant.added().position_lag.ahead(shown.y_m, slope)) - state.y_m).abs() < 1e-12);
}

#[test]
fn spool_and_sensor_lags_over_an_interval_are_those_of_many_short_ones() {
    let effects = Effects::none()
        .with(Effect::ValveLag, &[0.01])
        .with(Effect::PressureLag, &[0.02])
        .with(Effect::PositionLag, &[0.004]);
    let added = *plant(&effects).added();
    let (interval, steps) = (5.0e-3, 5000);
    let h = interval / f64::from(steps);
    let (mut spool, mut sum, mut sensed) = (0.2, 0.0, 3.0e5);
    // Accelerated by 30 m/s2 from 0.2 m/s.
    let place = |t: f64| 0.01 + t * (0.2 + 15.0 * t);
    let mut shown = 0.005;
    for k in 0..steps {
        let before = spool;
        spool += h * (1.0 - spool) / 0.01;
        sum += 0.5 * (before + spool);
        let p = 4.0e5 + 2.0e4 * (f64::from(k) + 0.5) / f64::from(steps);
        sensed += h * (p - sensed) / 0.02;
        shown += h * (place((f64::from(k) + 0.5) * h) - shown) / 0.004;
    }
    let (mean, end) = added.valve_lag.over(0.2, 1.0, interval, (-interval / 0.01_f64).exp());
    assert!((mean - sum / f64::from(steps)).abs() < 1e-4, "mean {mean}");
    assert!((end - spool).abs() < 1e-4, "end {end}");
    let behind = added.pressure_lag.over(3.0e5, [4.0e5, 4.2e5], interval, (-interval / 0.02_f64).exp());
    assert!((behind - sensed).abs() < 10.0, "{behind} instead of {sensed}");
    let velocities = [0.2, 0.2 + 30.0 * interval];
    let rest = (-interval / 0.004_f64).exp();
    let late = added.position_lag.over_bend(0.005, [0.01, place(interval)], velocities, interval, rest);
    assert!((late - shown).abs() < 1e-6, "{late} instead of {shown}");
    // The way bends 0.1 mm off the straight line between its ends, which counts.
    let straight = added.position_lag.over(0.005, [0.01, place(interval)], interval, rest);
    assert!((straight - shown).abs() > 2e-5, "{straight}");
}

#[test]
fn play_follows_its_command_only_beyond_its_half_width() {
    let hysteresis = plant(&Effects::none().with(Effect::ValveHysteresis, &[0.1])).added().valve_hysteresis;
    for (played, command, expected) in [(0.0, 0.05, 0.0), (0.0, 0.3, 0.2), (0.2, 0.15, 0.2), (0.2, -0.3, -0.2)] {
        assert!((hysteresis.play(played, command) - expected).abs() < 1e-12, "from {played} to {command}");
    }
}

#[test]
fn the_supply_settles_where_its_droop_balances_what_is_drawn() {
    let droop = plant(&Effects::none().with(Effect::SupplyDroop, &[3.0e7, 0.1])).added().supply_droop;
    assert!((droop.settled_pa(7.0e5, 1.0e-3) - 6.7e5).abs() < 1e-6);
}

#[test]
fn the_net_force_is_that_which_accelerates_without_friction() {
    let plant = plant(&Effects::none().with(Effect::ConstantForce, &[8.0]));
    let area = plant.area_m2(Side::A);
    assert_eq!(area, plant.area_m2(Side::B));
    assert!((plant.net_force_n(0.1, 0.2, 5.0e5, 3.0e5) - (area * 2.0e5 - 8.0)).abs() < 1e-9);
    assert_eq!(plant.minimum_volume_m3(Side::A), plant.minimum_volume_m3(Side::B));
}
