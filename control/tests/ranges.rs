//! The controller takes both ends of every range of its table, and nothing beyond.

use control::{Config, End, Key, Must, Parameters, Value};

/// Parameters in which `key` is `value` (both ends of a pair as far apart as they may be), and whatever depends on it makes
/// room for it.
fn with(key: Key, value: f32) -> Parameters {
    let mut p = Parameters::default();
    match key {
        Key::setpoint_range_m | Key::position_margin_m => p.position_range_m = [-3.9, 3.9],
        Key::valve_range_v | Key::dead_zone_right_v | Key::dead_zone_left_v | Key::safe_voltage_v => {
            (p.valve_range_v, p.max_voltage_v) = ([-100.0, 100.0], 100.0);
            let voltage = if value.is_finite() { value.clamp(-100.0, 100.0) } else { 0.0 };
            (p.dead_zone_right_v, p.dead_zone_left_v) = (voltage, voltage);
        }
        Key::setpoint_acceleration_m_per_s2 if value < 1.0 => p.tick_hz = 50,
        _ => {}
    }
    p.put(key, End::First, value);
    if key.row().limits.pair {
        p.put(key, End::First, key.row().limits.low as f32);
        p.put(key, End::Second, value);
    }
    p
}

#[test]
fn every_parameter_is_taken_at_both_ends_of_its_range() {
    for key in Key::ALL {
        let limits = key.row().limits;
        let low = if limits.pair { limits.low + f64::from(limits.apart) } else { limits.low };
        for end in [low, limits.high] {
            assert_eq!(
                Config::from_parameters(&with(key, end as f32)).map(|_| ()),
                Ok(()),
                "{} = {end}",
                key.row().key
            );
        }
    }
}

#[test]
fn no_parameter_is_taken_beyond_its_range_and_the_refusal_states_the_range() {
    // These types cannot hold what is just beyond.
    let whole = [Key::adc_bits, Key::dac_bits, Key::tick_hz, Key::timing_fault_ticks];
    let chosen = |key: Key| matches!(key.default_value(), Value::Flag(_) | Value::Choice(..));
    for key in Key::ALL.into_iter().filter(|key| !whole.contains(key) && !chosen(*key)) {
        let limits = &key.row().limits;
        let step = 1.0e-6 * (limits.low.abs() + limits.high.abs());
        for beyond in [limits.low - step, limits.high + step, f64::NAN, f64::INFINITY] {
            let error = Config::from_parameters(&with(key, beyond as f32)).expect_err(key.row().key);
            assert_eq!((error.key, error.must), (key.row().key, Must::Fit(limits)), "{beyond}");
        }
    }
}

#[test]
fn whole_numbers_are_refused_one_beyond_their_range() {
    let good = Parameters::default();
    for (p, must) in [
        (Parameters { adc_bits: 7, ..good.clone() }, "adc_bits = 7 must be from 8 to 16"),
        (Parameters { dac_bits: 17, ..good.clone() }, "dac_bits = 17 must be from 8 to 16"),
        (Parameters { tick_hz: 49, ..good.clone() }, "tick_hz = 49 must be from 50 to 20000 1/s"),
        (Parameters { tick_hz: 20_001, ..good }, "tick_hz = 20001 must be from 50 to 20000 1/s"),
    ] {
        assert_eq!(Config::from_parameters(&p).unwrap_err().to_string(), must);
    }
}

#[test]
fn a_refusal_tells_unit_order_and_whether_the_parameter_may_be_left_out() {
    let good = Parameters::default();
    for (p, must) in [
        (Parameters { gain_v_per_m: -1.0, ..good.clone() }, "gain_v_per_m = -1 must be from 0 to 10000 V/m"),
        (
            Parameters { setpoint_velocity_m_per_s: Some(0.0), ..good.clone() },
            "setpoint_velocity_m_per_s = 0 must be from 1e-4 to 50 m/s, or absent",
        ),
        // The tick rate narrows what the table says.
        (
            Parameters { setpoint_acceleration_m_per_s2: Some(0.001953125), ..good.clone() },
            "setpoint_acceleration_m_per_s2 = 0.001953125 must be from 0.0038146973 to 30000 m/s2, or absent",
        ),
        (
            Parameters { valve_range_v: [5.0, -5.0], ..good },
            "valve_range_v = -5 must be two values from -100 to 100 V, the first at least 1 V below the second",
        ),
    ] {
        assert_eq!(Config::from_parameters(&p).unwrap_err().to_string(), must);
    }
}
