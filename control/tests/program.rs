//! The references made on the board.

use control::program::{Program, ProgramParameters, ProgramState, Shape};
use proptest::prelude::*;

fn run(shape: Shape, period_s: f32, tick_hz: u32, ticks: usize) -> Vec<f64> {
    let p = ProgramParameters { shape, centre_m: 0.1, amplitude_m: 0.2, period_s };
    let program = Program::from_parameters(&p, tick_hz).unwrap();
    let mut state = ProgramState::default();
    (0..ticks).map(|_| program.advance(&mut state).to_num()).collect()
}

#[test]
fn a_step_program_stays_half_a_period_on_each_side() {
    let y = run(Shape::Step, 2.0, 1000, 4000);
    for (n, y) in y.iter().enumerate() {
        // the last tick of a half period may fall to either side: 2^32 is no multiple of the period
        if n % 1000 > 1 && n % 1000 < 999 {
            let expected = if n % 2000 < 1000 { 0.3 } else { -0.1 };
            assert!((y - expected).abs() < 1e-7, "{y} at tick {n}");
        }
    }
}

#[test]
fn a_ramp_program_has_one_speed() {
    let y = run(Shape::Ramp, 4.0, 1000, 4000);
    assert!((y[1000] - 0.3).abs() < 1e-6 && (y[3000] + 0.1).abs() < 1e-6);
    for pair in y.windows(2) {
        assert!((pair[1] - pair[0]).abs() * 1000.0 <= 0.2 * 1.001);
    }
}

#[test]
fn a_sine_program_is_a_sine_period_after_period() {
    let y = run(Shape::Sine, 0.5, 10_000, 20_000);
    for (n, y) in y.iter().enumerate() {
        let exact = 0.1 + 0.2 * (n as f64 / 5000.0 * std::f64::consts::TAU).sin();
        assert!((y - exact).abs() < 1e-5, "{y} against {exact} at tick {n}");
    }
}

#[test]
fn the_identification_sequence_uses_the_whole_range_rests_creeps_and_hurries() {
    let y = run(Shape::Identification, 40.0, 1000, 40_000);
    let (low, high) = y.iter().fold((f64::MAX, f64::MIN), |(l, h), y| (l.min(*y), h.max(*y)));
    assert!(low >= -0.1 - 1e-7 && high <= 0.3 + 1e-7, "{low} … {high}");
    assert!(low < -0.08 && high > 0.28, "{low} … {high}");
    assert!(y[..1600].iter().all(|y| (y - 0.1).abs() < 1e-7));
    // the slow triangle: 4 A / (T/2) with T = 8 s
    let creeping = y.windows(2).filter(|p| (0.05..0.25).contains(&((p[1] - p[0]).abs() * 1000.0))).count();
    assert!(creeping > 7000, "{creeping}");
    let levels = y[1600..16_000].windows(2).filter(|p| (p[1] - p[0]).abs() > 1e-3).count();
    assert!((12..=15).contains(&levels), "{levels} level changes");
    // and it repeats in time, with fresh random levels
    assert_eq!(run(Shape::Identification, 40.0, 1000, 41_000)[40_500], y[500]);
}

#[test]
fn bad_programs_are_refused_by_name() {
    let good = ProgramParameters { shape: Shape::Sine, centre_m: 0.0, amplitude_m: 0.1, period_s: 1.0 };
    for (p, key) in [
        (ProgramParameters { centre_m: f32::NAN, ..good }, "centre_m"),
        (ProgramParameters { amplitude_m: -0.1, ..good }, "amplitude_m"),
        (ProgramParameters { period_s: 0.0, ..good }, "period_s"),
    ] {
        assert_eq!(Program::from_parameters(&p, 1000).unwrap_err().key, key);
    }
    assert_eq!(Program::from_parameters(&good, 0).unwrap_err().key, "tick_hz");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]

    #[test]
    fn no_program_leaves_centre_plus_minus_amplitude(
        shape in prop::sample::select(vec![Shape::Step, Shape::Ramp, Shape::Sine, Shape::Identification]),
        centre in -3.9_f32..3.9, amplitude in 0.0_f32..3.9, period in 0.01_f32..100.0,
        tick_hz in 50_u32..20_000,
    ) {
        let p = ProgramParameters { shape, centre_m: centre, amplitude_m: amplitude, period_s: period };
        let program = Program::from_parameters(&p, tick_hz).unwrap();
        let mut state = ProgramState::default();
        for _ in 0..5000 {
            let y: f64 = program.advance(&mut state).to_num();
            prop_assert!((y - f64::from(centre)).abs() <= f64::from(amplitude) + 1e-7);
        }
    }
}
