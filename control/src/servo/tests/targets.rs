//! Streamed targets.

use super::*;

#[test]
fn a_sine_that_a_slow_sender_holds_has_its_own_velocity_too() {
    let tuning = tuning();
    let w = core::f64::consts::PI;
    for (every, within_m, within_m_per_s) in [(2, 2e-5, 0.004), (5, 1e-4, 0.01), (20, 6e-4, 0.03)] {
        let mut stream = Stream::at(Position::ZERO);
        for tick in 0..2000_u32 {
            let sent = metres(0.05 * (w * f64::from(tick / every * every) * 1e-3).sin());
            let next = f64::from(tick + 1) * 1e-3;
            let motion = stream.take(sent, &tuning.stream, &tuning.tick).motion;
            let (y, v) = (value(motion.position()), motion.v);
            if tick > 500 {
                assert!((y - 0.05 * (w * next).sin()).abs() < within_m, "every {every} ms: {y} at {next}");
                let wrong = value(v) - 0.05 * w * (w * next).cos();
                assert!(wrong.abs() < within_m_per_s, "every {every} ms: {wrong} at {next}");
            }
        }
    }
}

#[test]
fn a_target_within_20_um_of_where_it_stands_is_the_same_and_one_that_stops_stands_within_25_ms() {
    let tuning = tuning();
    let mut stream = Stream::at(metres(0.01));
    let mut take = |y: f64| stream.take(metres(y), &tuning.stream, &tuning.tick);
    for tick in 0..100 {
        assert_eq!(take(0.01 + if tick % 2 == 0 { 15e-6 } else { -15e-6 }), standing(0.01));
    }
    // A ramp that ends in noise.
    let mut aim = standing(0.01);
    for tick in 0..150 {
        aim = take(0.01 + 1e-4 * f64::from(tick));
    }
    assert!((value(aim.motion.v) - 0.1).abs() < 1e-3, "{aim:?}");
    let stands =
        (0..60).map(|tick| take(0.025 + if tick % 2 == 0 { 5e-6 } else { -5e-6 })).position(|aim| aim.motion.v == 0);
    assert!(stands.is_some_and(|ticks| ticks <= 26), "{stands:?}");
}

#[test]
fn a_step_has_no_velocity_and_a_sine_has_its_own() {
    let tuning = tuning();
    let mut stream = Stream::at(Position::ZERO);
    for _ in 0..5 {
        assert_eq!(stream.take(metres(0.045), &tuning.stream, &tuning.tick), standing(0.045));
    }
    let mut stream = Stream::at(Position::ZERO);
    let w = core::f64::consts::PI;
    for tick in 0..2000 {
        let (now, next) = (f64::from(tick) * 1e-3, f64::from(tick + 1) * 1e-3);
        let aim = stream.take(metres(0.05 * (w * now).sin()), &tuning.stream, &tuning.tick);
        if tick > 200 {
            let motion = aim.motion;
            assert!((value(motion.position()) - 0.05 * (w * next).sin()).abs() < 2e-6, "{motion:?} at {next}");
            assert!((value(motion.v) - 0.05 * w * (w * next).cos()).abs() < 2e-3, "{motion:?} at {next}");
        }
    }
}

#[test]
fn a_target_is_new_until_the_reference_is_within_a_tenth_of_a_millimetre_and_again_once_it_jumps() {
    let tuning = tuning();
    let read = Readings { y: Position::ZERO, chambers: [None; 2], supply: None };
    for (off_m, new) in [(1e-3, true), (0.05e-3, false)] {
        let (mut state, target) = (ServoState::default(), metres(off_m));
        tuning.step(&mut state, Stage::Begin, target, &read);
        assert_eq!(state.stream.take(target, &tuning.stream, &tuning.tick).new, new, "{off_m} m");
        assert!(state.stream.take(metres(0.01), &tuning.stream, &tuning.tick).new);
    }
}
