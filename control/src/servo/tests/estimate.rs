//! The observer.

use super::*;
use crate::servo::observer::Estimate;

#[test]
fn the_observer_finds_velocity_and_disturbance_of_a_motion_that_it_did_not_expect() {
    let tuning = tuning();
    let (mut estimate, valve) = (Estimate::default(), ValveModel::nominal(&tuning.valve));
    let rest = tuning.chambers.rest;
    let air = tuning.chambers.air(Position::ZERO, [rest[0], rest[1], tuning.chambers.nominal_supply]);
    let (_, body, lag, ..) = tuning.start.parts();
    for tick in 0..400 {
        estimate.correct(metres(0.1e-3 * f64::from(tick)), Some(Acceleration::ZERO), &tuning.observer);
        let valve = (&tuning.valve, &valve);
        estimate.predict(Voltage::ZERO, &air, valve, (lag, &body), (&tuning.observer, &tuning.tick));
    }
    assert!((value(estimate.v) - 0.1).abs() < 1e-3, "{estimate:?}");
    assert!((value(estimate.y) - 0.04).abs() < 1e-5, "one tick ahead: {estimate:?}");
    // What moves the piston against friction without force in the chambers is a disturbance.
    let friction = value(body.coulomb) + value(body.viscous) * 0.1;
    assert!((value(estimate.disturbance) / friction - 1.0).abs() < 0.2, "{estimate:?} against {friction}");
}

#[test]
fn a_run_begins_with_the_means_of_its_first_samples_and_without_a_velocity() {
    let tuning = tuning();
    let start = metres(0.02);
    let mut estimate = Estimate { y: start, force: Acceleration::ZERO, ..Estimate::default() };
    let samples = [40e-6, -20e-6, 10e-6, -50e-6];
    for (k, noise) in samples.iter().enumerate() {
        let force = Acceleration::from_num(noise * 1e5);
        estimate.correct_standing(metres(0.02 + noise), Some(force), k as u16 + 1);
    }
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    assert!((value(estimate.y) - 0.02 - mean).abs() < 2e-7, "{estimate:?}");
    assert!((value(estimate.force) - mean * 1e5).abs() < 1e-4 && estimate.v == 0, "{estimate:?}");
    assert!((value(estimate.force) + value(estimate.disturbance)).abs() < 1e-6, "the piston stands: {estimate:?}");
    assert_eq!(tuning.standing_ticks, 8);
}

#[test]
fn bristles_stiffer_than_the_format_hold_no_more_than_the_coulomb_friction() {
    for stiffness in [1.0e7, 3.0e8, 1.0e9] {
        let p = Parameters { law: LawChoice::Servo, servo_bristle_per_s2: stiffness, ..Parameters::default() };
        let tuning = Config::from_parameters(&p).expect("valid").servo.expect("the positioning law");
        let (_, body, lag, ..) = tuning.start.parts();
        let air = tuning.chambers.air(Position::ZERO, [tuning.chambers.rest[0]; 3]);
        let mut estimate = Estimate::default();
        for tick in 0..2000_u32 {
            // To and fro within and beyond what friction holds.
            estimate.force = Acceleration::from_num(4.0 * (f64::from(tick) / 50.0).sin());
            let _ = estimate.predict(
                tuning.valve.centre,
                &air,
                (&tuning.valve, &ValveModel::nominal(&tuning.valve)),
                (lag, &body),
                (&tuning.observer, &tuning.tick),
            );
            assert!(estimate.bristle.saturating_abs() <= body.coulomb, "{stiffness}: {estimate:?}");
        }
    }
}

#[test]
fn a_pressure_that_is_measured_again_teaches_nothing_of_what_the_model_made_of_it_meanwhile() {
    let tuning = tuning();
    let mut state = ServoState::default();
    let readings = |force: f64, measured: bool| {
        let p_a = (17.0 + force) / 4.849383e-5;
        let pressures = [p_a, 17.0 / 4.849383e-5].map(|p: f64| measured.then(|| Pressure::from_num(p)));
        Readings { y: Position::ZERO, chambers: pressures, supply: None }
    };
    tuning.step(&mut state, Stage::Begin, Position::ZERO, &readings(0.0, true));
    for _ in 0..200 {
        tuning.step(&mut state, Stage::Run, metres(1e-5), &readings(0.0, false));
        tuning.learn(&mut state);
    }
    let before = tuning.learned(&state);
    tuning.step(&mut state, Stage::Run, metres(1e-5), &readings(2.0, true));
    tuning.learn(&mut state);
    assert!((value(state.estimate.force) - 2.0).abs() < 0.1, "{:?}", state.estimate);
    for (then, now) in before.bits.into_iter().zip(tuning.learned(&state).bits).take(5) {
        assert!((then - now).abs() <= then.abs() / 1000, "{before:?}, {state:?}");
    }
}
