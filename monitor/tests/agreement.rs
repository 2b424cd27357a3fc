//! A healthy rig agrees with its model; a rig with one lie in it does not.

use monitor::{Contradicts, Monitor, MonitorParameters, Readings};
use plant_model::{Effect, Effects, Rig, Simulator};

const TICK_S: f64 = 1.0e-3;

/// Gaussian noise, the same on every machine.
struct Noise(u64);

impl Noise {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
    fn gauss(&mut self) -> f64 {
        (0..12).map(|_| self.uniform()).sum::<f64>() - 6.0
    }
}

fn rigs() -> [(&'static str, Rig<f64>, Rig<f32>); 3] {
    [
        ("a", Rig::paper_a(), Rig::paper_a()),
        ("b", Rig::paper_b(), Rig::paper_b()),
        ("c", Rig::paper_c(), Rig::paper_c()),
    ]
}

/// What a test may do to truth on its way to the monitor: (tick, readings as sensed, true state is untouched).
type Spoil<'s> = dyn FnMut(usize, &mut Readings) + 's;

/// The first tick of a disagreement.
#[derive(Debug, PartialEq)]
struct Disagreement {
    tick: usize,
    travel_m: f64,
    pressures_pa: [f64; 2],
    contradicts: Option<Contradicts>,
}

/// Positions the piston between ± a fifth of the stroke, a new target every 0.7 s; returns tick, true travel since
/// `from` in m, true pressures in Pa and what is named when the monitor first disagrees.
fn first_disagreement(
    rig: &Rig<f64>,
    rig_f32: &Rig<f32>,
    effects: &Effects<f64>,
    ticks: usize,
    from: usize,
    jam_at: Option<usize>,
    spoil: &mut Spoil<'_>,
) -> Option<Disagreement> {
    let mut simulator = Simulator::<f64>::new(rig, effects).unwrap();
    let parameters = MonitorParameters::default();
    let mut monitor = Monitor::new(rig_f32, &effects.convert(), &parameters, TICK_S as f32, 0).unwrap();
    let mut noise = Noise(7);
    let (mut u, mut y_from) = (0.0, 0.0);
    let mut valve_u = 0.0;
    for n in 0..ticks {
        let truth = simulator.measure();
        let mut readings = Readings {
            position_m: (truth.y_m + 5.0e-5 * noise.gauss()) as f32,
            pressure_a_pa: (truth.p_a_pa + 600.0 * noise.gauss()) as f32,
            pressure_b_pa: (truth.p_b_pa + 600.0 * noise.gauss()) as f32,
            supply_pa: Some((truth.p_sup_pa + 600.0 * noise.gauss()) as f32),
        };
        if n <= from {
            y_from = truth.y_m;
        } else {
            spoil(n - from, &mut readings);
        }
        let verdict = monitor.step(&readings, u as f32);
        if verdict.disagreement {
            return Some(Disagreement {
                tick: n,
                travel_m: (truth.y_m - y_from).abs(),
                pressures_pa: [truth.p_a_pa, truth.p_b_pa],
                contradicts: verdict.contradicts,
            });
        }
        let target = rig.cylinder.stroke_m * [0.2, -0.1, 0.0, -0.2, 0.15, 0.05][n / 700 % 6];
        u = (10.0 * (target - f64::from(readings.position_m)) * (1.0 / rig.cylinder.stroke_m)).clamp(-5.0, 5.0);
        if jam_at.is_none_or(|jam| n < jam) {
            valve_u = u;
        }
        simulator.advance(valve_u, TICK_S);
    }
    None
}

fn mpye() -> Effects<f64> {
    Effects::none().with(Effect::ValveLag, &[1.7e-3]).with(Effect::ValveHysteresis, &[0.01])
}

#[test]
fn a_healthy_rig_agrees_for_a_minute_with_and_without_valve_dynamics() {
    for (name, rig, rig_f32) in rigs() {
        for effects in [Effects::none(), mpye()] {
            let found = first_disagreement(&rig, &rig_f32, &effects, 60_000, usize::MAX, None, &mut |_, _| ());
            assert_eq!(found, None, "rig {name}");
        }
    }
}

#[test]
fn coefficients_that_are_a_tenth_off_do_not_disagree() {
    for (name, mut rig, rig_f32) in rigs() {
        rig.valve.fill_coefficient_kg_per_s_pa *= 1.1;
        rig.valve.exhaust_coefficient_kg_per_s_pa *= 0.9;
        rig.cylinder.volume_a0_m3 *= 1.05;
        let found = first_disagreement(&rig, &rig_f32, &Effects::none(), 20_000, usize::MAX, None, &mut |_, _| ());
        assert_eq!(found, None, "rig {name}");
    }
}

#[test]
fn a_position_that_freezes_while_moving_is_found_before_the_piston_has_gone_15_mm() {
    for (name, rig, rig_f32) in rigs() {
        // 730: under way to the second target
        let mut frozen = None;
        let found = first_disagreement(&rig, &rig_f32, &mpye(), 1400, 730, None, &mut |_, readings| {
            readings.position_m = *frozen.get_or_insert(readings.position_m);
        });
        let Disagreement { travel_m, .. } = found.unwrap_or_else(|| panic!("rig {name}: not found"));
        assert!(travel_m < 0.015, "rig {name}: {travel_m} m");
    }
}

#[test]
fn a_pressure_sensor_that_jumps_by_a_fifth_is_found_in_5_ms_named_and_told_what_it_should_read() {
    for (name, rig, rig_f32) in rigs() {
        for (side, factor) in [(0, 1.2), (0, 0.8), (1, 1.2), (1, 0.8)] {
            let found = first_disagreement(&rig, &rig_f32, &mpye(), 1400, 900, None, &mut |_, readings| {
                *[&mut readings.pressure_a_pa, &mut readings.pressure_b_pa][side] *= factor;
            });
            let found = found.unwrap_or_else(|| panic!("rig {name}: not found"));
            assert!(found.tick <= 905, "rig {name}: {} ms", found.tick - 900);
            let told_pa = match (side, found.contradicts) {
                (0, Some(Contradicts::PressureA(told_pa))) | (1, Some(Contradicts::PressureB(told_pa))) => told_pa,
                _ => panic!("rig {name}, side {side}: {found:?}"),
            };
            let wrong_pa = (f64::from(told_pa) - found.pressures_pa[side]).abs();
            assert!(wrong_pa < 5e3, "rig {name}, side {side}: {wrong_pa} Pa of {found:?}");
        }
    }
}

#[test]
fn a_pressure_sensor_that_freezes_or_lags_is_named_or_none_is() {
    let mut named = 0;
    for (name, rig, rig_f32) in rigs() {
        for side in 0..2 {
            for lag_ticks in [1e9_f32, 100.0] {
                let mut lagged = None;
                let found = first_disagreement(&rig, &rig_f32, &mpye(), 4200, 730, None, &mut |_, readings| {
                    let reading = if side == 0 { &mut readings.pressure_a_pa } else { &mut readings.pressure_b_pa };
                    let lagged = lagged.get_or_insert(*reading);
                    *lagged += (*reading - *lagged) / lag_ticks;
                    *reading = *lagged;
                });
                let found = found.unwrap_or_else(|| panic!("rig {name}: not found"));
                match (side, found.contradicts) {
                    (_, None) => (),
                    (0, Some(Contradicts::PressureA(_))) | (1, Some(Contradicts::PressureB(_))) => named += 1,
                    _ => panic!("rig {name}, side {side}: {found:?}"),
                }
            }
        }
    }
    assert!(named >= 6, "{named} of 12");
}

#[test]
fn a_jammed_valve_is_found_within_a_second() {
    for (name, rig, rig_f32) in rigs() {
        let found = first_disagreement(&rig, &rig_f32, &Effects::none(), 4200, 720, Some(720), &mut |_, _| ());
        let Disagreement { tick, travel_m, contradicts, .. } = found.unwrap_or_else(|| panic!("rig {name}: not found"));
        // Nothing is wrong until the command has moved away from where the valve stands.
        assert!(tick - 720 < 1000, "rig {name}: {} ms, {travel_m} m", tick - 720);
        assert_eq!(contradicts, None, "rig {name}");
    }
}

#[test]
fn a_reading_that_is_no_number_is_a_disagreement() {
    let (_, rig, rig_f32) = rigs()[0];
    let found = first_disagreement(&rig, &rig_f32, &Effects::none(), 100, 50, None, &mut |_, readings| {
        readings.pressure_b_pa = f32::NAN;
    });
    assert!(found.as_ref().is_some_and(|found| found.tick <= 54 && found.contradicts.is_none()), "{found:?}");
}

#[test]
fn bad_parameters_are_refused_by_name() {
    let rig = Rig::<f32>::paper_a();
    let p = MonitorParameters { horizon_s: f32::NAN, ..MonitorParameters::default() };
    let error = Monitor::new(&rig, &Effects::none(), &p, 1.0e-3, 0).unwrap_err();
    assert_eq!(error.key, "monitor.horizon_s");
    let late = Effects::none().with(Effect::LineDelay, &[0.1]);
    let error = Monitor::new(&rig, &late, &MonitorParameters::default(), 1.0e-3, 0).unwrap_err();
    assert_eq!(error.key, "effects.line-delay.delay_s");
}

#[test]
fn a_position_that_freezes_or_lags_at_full_speed_is_found_within_20_ms_and_one_that_shrinks_within_40() {
    for (name, rig, rig_f32) in rigs() {
        // 150 ms into the second move each piston is fast.
        let from = 850;
        let mut frozen = None;
        let mut freeze = |_: usize, readings: &mut Readings| {
            readings.position_m = *frozen.get_or_insert(readings.position_m);
        };
        let mut lagged = None;
        let mut lag = |_: usize, readings: &mut Readings| {
            let value = lagged.get_or_insert(readings.position_m);
            *value += (readings.position_m - *value) * 0.01;
            readings.position_m = *value;
        };
        let mut first = None;
        let mut shrink = |_: usize, readings: &mut Readings| {
            // Without a jump: the scale changes about the present position.
            let pivot = *first.get_or_insert(readings.position_m);
            readings.position_m = pivot + 0.6 * (readings.position_m - pivot);
        };
        let spoils: [(&str, &mut Spoil<'_>, usize); 3] =
            [("freeze", &mut freeze, 20), ("lag", &mut lag, 20), ("shrink", &mut shrink, 40)];
        for (what, spoil, limit) in spoils {
            let found = first_disagreement(&rig, &rig_f32, &mpye(), 1400, from, None, spoil);
            let Disagreement { tick, .. } = found.unwrap_or_else(|| panic!("rig {name}, {what}: not found"));
            assert!(tick - from <= limit, "rig {name}, {what}: {} ms", tick - from);
        }
    }
}

#[test]
fn a_slam_into_an_end_stop_is_no_disagreement() {
    for (name, mut rig, mut rig_f32) in rigs() {
        // Case (b) has no dead volume at all, which no cylinder is without: a twentieth, as in the others.
        if name == "b" {
            (rig.cylinder.volume_a0_m3, rig.cylinder.volume_b0_m3) = (1.47e-3, 1.47e-3);
            (rig_f32.cylinder.volume_a0_m3, rig_f32.cylinder.volume_b0_m3) = (1.47e-3, 1.47e-3);
        }
        let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).unwrap();
        let mut monitor =
            Monitor::new(&rig_f32, &Effects::none(), &MonitorParameters::default(), TICK_S as f32, 0).unwrap();
        let mut noise = Noise(11);
        let (mut farthest, mut last_u): (f64, f32) = (0.0, 0.0);
        for n in 0..6000 {
            let truth = simulator.measure();
            let readings = Readings {
                position_m: (truth.y_m + 5.0e-5 * noise.gauss()) as f32,
                pressure_a_pa: (truth.p_a_pa + 600.0 * noise.gauss()) as f32,
                pressure_b_pa: (truth.p_b_pa + 600.0 * noise.gauss()) as f32,
                supply_pa: Some((truth.p_sup_pa + 600.0 * noise.gauss()) as f32),
            };
            let u: f32 = if n % 4000 < 2000 { 4.0 } else { -4.0 };
            let verdict = monitor.step(&readings, last_u);
            assert!(!verdict.disagreement, "rig {name}, tick {n}, {truth:?}: {verdict:?}");
            simulator.advance(f64::from(u), TICK_S);
            last_u = u;
            farthest = farthest.max(truth.y_m.abs());
        }
        assert!(farthest > 0.49 * rig.cylinder.stroke_m, "rig {name}: {farthest} m is no end stop");
    }
}
