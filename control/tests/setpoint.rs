//! The setpoint limiter: range, velocity, acceleration, no overshoot, no needless delay.

use control::setpoint::{SetpointLimits, SetpointState};
use control::{Config, Parameters, Position};
use proptest::prelude::*;

fn limits(velocity: Option<f32>, acceleration: Option<f32>, tick_hz: u32) -> SetpointLimits {
    let p = Parameters {
        tick_hz,
        setpoint_range_m: Some([-0.4, 0.4]),
        setpoint_velocity_m_per_s: velocity,
        setpoint_acceleration_m_per_s2: acceleration,
        ..Parameters::default()
    };
    *Config::from_parameters(&p).unwrap().setpoint_limits()
}

#[test]
fn without_limits_a_step_passes_as_a_step_clamped_to_the_range() {
    let limits = limits(None, None, 1000);
    let mut state = SetpointState::at(Position::ZERO);
    assert_eq!(limits.advance(&mut state, Position::from_num(0.25)), Position::from_num(0.25));
    assert!((limits.advance(&mut state, Position::MAX).to_num::<f64>() - 0.4).abs() < 1e-7);
    assert!((limits.advance(&mut state, Position::MIN).to_num::<f64>() + 0.4).abs() < 1e-7);
}

#[test]
fn with_a_velocity_limit_a_step_becomes_a_ramp_that_ends_exactly_on_the_target() {
    let limits = limits(Some(0.1), None, 1000);
    let (target, mut state) = (Position::from_num(0.05), SetpointState::at(Position::ZERO));
    let ramp: Vec<f64> = (0..600).map(|_| limits.advance(&mut state, target).to_num()).collect();
    assert!((ramp[249] - 0.025).abs() < 1e-6, "{}", ramp[249]);
    assert_eq!(ramp[505], target.to_num::<f64>());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(400) })]

    #[test]
    fn a_smooth_move_keeps_both_limits_does_not_overshoot_and_takes_the_least_time(
        from in -0.4_f64..0.4, to in -0.4_f64..0.4, v_max in 0.02_f64..2.0, a_max in 0.1_f64..40.0,
        tick_hz in prop::sample::select(vec![1000_u32, 2000, 10_000]),
    ) {
        let hz = f64::from(tick_hz);
        let limits = limits(Some(v_max as f32), Some(a_max as f32), tick_hz);
        let (start, target) = (Position::from_num(from), Position::from_num(to));
        let mut state = SetpointState::at(start);
        let (mut y, mut v) = (start.to_num::<f64>(), 0.0);
        let end: f64 = target.to_num();
        let direction = (end - y).signum();
        let distance = (end - y).abs();
        // trapezoid or triangle, plus the cost of ticks and of rounding the braking speed down
        let ideal = if distance > v_max * v_max / a_max {
            distance / v_max + v_max / a_max
        } else {
            2.0 * (distance / a_max).sqrt()
        };
        let allowed = (1.02 * ideal * hz) as usize + 20;
        let mut arrived = None;
        // differences of two roundings of the position
        let slack = 2.0 * 2.0_f64.powi(-28) * hz;
        for n in 0..allowed + 50 {
            let next: f64 = limits.advance(&mut state, target).to_num();
            let velocity = (next - y) * hz;
            prop_assert!(velocity.abs() <= v_max * 1.0001 + slack, "velocity {velocity} at tick {n}");
            prop_assert!((velocity - v).abs() * hz <= a_max * 1.01 + 2.0 * slack * hz, "acceleration at tick {n}");
            prop_assert!((next - end) * direction <= 1e-8, "overshoot to {next} of {end} at tick {n}");
            (y, v) = (next, velocity);
            if arrived.is_none() && next == end {
                arrived = Some(n);
            }
        }
        prop_assert!(arrived.is_some_and(|n| n <= allowed), "arrived {arrived:?}, allowed {allowed}, at {y} of {end}");
        prop_assert_eq!(y, end);
    }

    /// Targets that jump about in mid-move: the limits hold, the range holds, nothing wraps.
    #[test]
    fn restless_targets_never_break_the_limits(
        targets in prop::collection::vec((-9.0_f64..9.0, 1_usize..300), 1..20),
        v_max in 0.02_f64..40.0, a_max in 0.1_f64..1000.0,
    ) {
        let limits = limits(Some(v_max as f32), Some(a_max as f32), 1000);
        let mut state = SetpointState::at(Position::ZERO);
        let (mut y, mut v) = (0.0, 0.0);
        for (target, ticks) in targets {
            for _ in 0..ticks {
                let next: f64 = limits.advance(&mut state, Position::saturating_from_num(target)).to_num();
                let velocity = (next - y) * 1000.0;
                prop_assert!(next.abs() <= 0.4 + 1e-7);
                prop_assert!(velocity.abs() <= v_max * 1.0001 + 1e-5);
                // at the end of the range the reference may stop at once: there is nowhere left to go
                if next.abs() < 0.4 - 1e-7 {
                    prop_assert!((velocity - v).abs() <= a_max * 1.01e-3 + 2e-5, "{v} to {velocity}");
                }
                (y, v) = (next, velocity);
            }
        }
    }
}
