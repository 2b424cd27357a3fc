//! What the law takes of parameters and of earlier runs.

use super::*;
use crate::parameters::Key;
use crate::servo::learned::{MEASURED_AGAINST, Quantity};

#[test]
fn the_law_refuses_a_tick_too_slow_for_it_and_limits_that_do_not_fit_each_other() {
    let refused = |change: fn(&mut Parameters)| {
        let mut p = Parameters { law: LawChoice::Servo, ..Parameters::default() };
        change(&mut p);
        Config::from_parameters(&p).expect_err("refused").key
    };
    assert_eq!(refused(|p| p.tick_hz = 200), "tick_hz");
    assert_eq!(refused(|p| p.servo_jerk_m_per_s3 = 1.0e4), "servo_jerk_m_per_s3");
    assert_eq!(refused(|p| p.servo_observer_rad_per_s = 600.0), "servo_observer_rad_per_s");
    assert_eq!(refused(|p| p.servo_area_m2_per_kg = 0.5), "servo_area_m2_per_kg");
}

#[test]
fn every_parameter_of_the_law_is_the_rigs_or_says_how_fast_it_moves() {
    let others: Vec<&str> = Key::ALL
        .into_iter()
        .filter(|key| !MEASURED_AGAINST.contains(key))
        .map(|key| key.row().key)
        .filter(|key| key.starts_with("servo_"))
        .collect();
    let speeds = ["speed_m_per_s", "acceleration_m_per_s2", "jerk_m_per_s3", "bandwidth_rad_per_s"];
    let following = ["observer_rad_per_s", "force_rate_per_s", "lead_s"];
    assert_eq!(
        others,
        [&speeds[..], &following[..]].concat().iter().map(|key| format!("servo_{key}")).collect::<Vec<_>>()
    );
}

#[test]
fn without_pressures_a_run_begins_with_less_friction_since_too_much_is_hardly_unlearned() {
    let tuning = tuning();
    let begun = |chambers: [Option<Pressure>; 2]| {
        let mut state = ServoState::default();
        let readings = Readings { y: Position::ZERO, chambers, supply: None };
        tuning.step(&mut state, Stage::Begin, Position::ZERO, &readings);
        value(state.body.coulomb) / value(tuning.learning.coulomb)
    };
    let measured = Some(Pressure::from_num(3));
    assert!((begun([measured; 2]) - 0.92).abs() < 1e-3);
    assert!((begun([measured, None]) - 0.8).abs() < 1e-3 && (begun([None; 2]) - 0.8).abs() < 1e-3);
}

#[test]
fn what_was_learned_is_begun_with_again_within_its_limits_and_nothing_else_is() {
    for quantity in Quantity::ALL {
        let index = usize::from(quantity.number());
        let mut tuning = tuning();
        let nominal = tuning.nominal().values(HZ);
        // The load may be what the supply holds.
        let [low, high] =
            quantity.limits().map_or([-29.096, 29.096], |limits| limits.map(|part| part * f64::from(nominal[index])));
        let [low, high] = [low, high].map(|end| end as f32);
        for (value, fits) in [
            (low - 0.001 * low.abs(), false),
            (low + 0.001 * low.abs(), true),
            (nominal[index], true),
            (high * 0.999, true),
            (high * 1.001, false),
            // What kept values lack is nominal where it was not learned once.
            (f32::NAN, quantity.is_newer()),
            (f32::INFINITY, false),
        ] {
            let before = tuning.start;
            let mut values = nominal;
            values[index] = value;
            let taken = tuning.start_from(&values, HZ);
            assert_eq!(taken, if fits { Ok(()) } else { Err(quantity) }, "{} {value}", quantity.name());
            if fits {
                let found = tuning.start.values(HZ)[index];
                let value = if value.is_nan() { nominal[index] } else { value };
                assert!((found - value).abs() <= 2e-5 + 1e-4 * value.abs(), "{}: {found}", quantity.name());
            } else {
                assert_eq!(tuning.start, before);
            }
        }
        // The very ends, as learning leaves them, go out and in again.
        for end in tuning.limits() {
            assert_eq!(tuning.start_from(&end.values(HZ), HZ), Ok(()));
            assert_eq!(tuning.start.values(HZ), end.values(HZ));
        }
    }
}
