//! The inverse dead zone: continuous, monotone, quiet, saturated.

use control::{AdcCode, Config, ControllerState, Inputs, Outputs, Parameters, Position, Voltage, step};
use proptest::prelude::*;

fn real_valve() -> Parameters {
    Parameters { dead_zone_right_v: 0.42, dead_zone_left_v: -0.42, ..Parameters::default() }
}

fn tick(config: &Config, reference: Position, position: u16) -> Outputs {
    let healthy = AdcCode(u16::MAX / 2);
    let inputs = Inputs {
        reference,
        position: AdcCode(position),
        pressure_a: healthy,
        pressure_b: healthy,
        supply: Some(healthy),
        ..Inputs::default()
    };
    step(config, &mut ControllerState::armed(), inputs)
}

/// The valve (3.1).
fn dead_zone(p: &Parameters, u: f64) -> f64 {
    let (right, left) = (f64::from(p.dead_zone_right_v), f64::from(p.dead_zone_left_v));
    if u > right {
        f64::from(p.slope_right) * (u - right)
    } else if u < left {
        f64::from(p.slope_left) * (u - left)
    } else {
        0.0
    }
}

#[test]
fn outside_the_band_valve_and_inverse_cancel() {
    let p = Parameters { slope_right: 0.8, slope_left: 1.3, dead_zone_left_v: -0.3, ..real_valve() };
    let config = Config::from_parameters(&p).unwrap();
    for code in (1..u16::MAX).step_by(7) {
        let telemetry = tick(&config, Position::ZERO, code).telemetry;
        let (u, w): (f64, f64) = (telemetry.u.to_num(), telemetry.w.to_num());
        if w.abs() > 2.5e-3 {
            assert!((dead_zone(&p, u) - w).abs() < 1e-4, "w {w} came out as {}", dead_zone(&p, u));
        }
    }
}

#[test]
fn without_a_dead_zone_the_inverse_is_the_identity_to_one_unit() {
    let config = Config::from_parameters(&Parameters::default()).unwrap();
    for code in 1..u16::MAX {
        let telemetry = tick(&config, Position::ZERO, code).telemetry;
        assert!((telemetry.u - telemetry.w).abs() <= Voltage::DELTA, "{telemetry:?}");
    }
}

#[test]
fn at_zero_error_the_valve_stands_in_the_middle_of_the_dead_zone() {
    let p = Parameters { dead_zone_left_v: -0.2, ..real_valve() };
    let config = Config::from_parameters(&p).unwrap();
    let position = config.scales()[0].position(AdcCode(40_000));
    let u: f64 = tick(&config, position, 40_000).telemetry.u.to_num();
    assert!((u - 0.11).abs() < 1e-6, "{u}");
}

#[test]
fn one_code_of_noise_about_the_target_never_lets_air_through() {
    let p = real_valve();
    let config = Config::from_parameters(&p).unwrap();
    for code in [1000_u16, 32_767, 32_768, 60_000] {
        let target = config.scales()[0].position(AdcCode(code));
        for noisy in code - 1..=code + 1 {
            let u: f64 = tick(&config, target, noisy).telemetry.u.to_num();
            assert_eq!(dead_zone(&p, u), 0.0, "u {u} at code {noisy}");
        }
    }
}

#[test]
fn four_sigma_of_a_twentieth_of_a_millimetre_never_lets_air_through() {
    let p = real_valve();
    let config = Config::from_parameters(&p).unwrap();
    for noise in [-0.2e-3, 0.2e-3] {
        let target = config.scales()[0].position(AdcCode(30_000)) + Position::from_num(noise);
        let u: f64 = tick(&config, target, 30_000).telemetry.u.to_num();
        assert_eq!(dead_zone(&p, u), 0.0, "u {u}");
    }
}

#[test]
fn a_band_that_one_code_of_noise_could_cross_is_refused() {
    let p = Parameters { gain_v_per_m: 400.0, dead_zone_blend_v: Some(2.5e-3), ..real_valve() };
    assert_eq!(Config::from_parameters(&p).unwrap_err().key, "dead_zone_blend_v");
    assert!(Config::from_parameters(&Parameters { dead_zone_blend_v: None, ..p }).is_ok());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    /// More error never means less voltage, and one code of position never moves `u` by more than the steepest slope times
    /// its own `w`: no jump anywhere, in particular not through zero.
    #[test]
    fn the_valve_voltage_is_monotone_and_continuous_in_the_position(
        gain in 0.1_f32..100.0, left in -1.0_f32..0.5, width in 0.0_f32..1.0,
        slopes in (0.2_f32..5.0, 0.2_f32..5.0), start in 1_u16..64_000,
    ) {
        let p = Parameters {
            gain_v_per_m: gain, dead_zone_left_v: left, dead_zone_right_v: left + width,
            slope_right: slopes.0, slope_left: slopes.1, ..Parameters::default()
        };
        let config = Config::from_parameters(&p).unwrap();
        let target = config.scales()[0].position(AdcCode(start + 500));
        let per_code = f64::from(gain) / 65_535.0;
        let blend = (10.0_f64 / 4095.0).max(2.0 * per_code).max(1e-3);
        let steepest = f64::from(width) / 2.0 / blend + 5.0;
        let mut last: Option<Voltage> = None;
        for code in start..start + 1000 {
            let u = tick(&config, target, code).telemetry.u;
            if let Some(last) = last {
                prop_assert!(u <= last, "{u} after {last}");
                prop_assert!((last - u).to_num::<f64>() <= steepest * per_code * 1.01 + 1e-6);
            }
            last = Some(u);
        }
    }
}

#[test]
fn the_largest_error_and_gain_saturate_at_the_valves_limit_and_never_change_sign() {
    for max_voltage_v in [1.0_f32, 5.0] {
        let p = Parameters { gain_v_per_m: 10_000.0, max_voltage_v, ..real_valve() };
        let config = Config::from_parameters(&p).unwrap();
        let highest = (5.0 + max_voltage_v) / 10.0 * 4095.0;
        for (reference, code, dac) in
            [(Position::MAX, 1, highest.round()), (Position::MIN, u16::MAX - 1, (4095.0 - highest).round())]
        {
            let outputs = tick(&config, reference, code);
            assert_eq!(f32::from(outputs.dac.0), dac);
            assert_eq!(outputs.telemetry.u.abs(), Voltage::from_num(max_voltage_v));
        }
    }
}
