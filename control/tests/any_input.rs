//! Any codes, any commands, any faults, any configuration that the checks let through: no panic, no code out of range, and
//! nothing but run and a controlled stop that follows it moves the valve. The same target is fuzzed in `fuzz/`.

use control::{
    AdcCode, Config, Contradicts, ControllerState, End, ExternalFaults, Inputs, Key, LawChoice, Mode, OperatorCommand,
    Parameters, Position, Pressure, Value, learn, step,
};
use proptest::prelude::*;

fn any_number() -> impl Strategy<Value = f32> {
    prop_oneof![any::<f32>(), -10.0_f32..10.0, Just(f32::NAN), Just(f32::INFINITY), Just(0.0), Just(f32::MAX)]
}

fn inputs() -> impl Strategy<Value = Inputs> {
    let code = || prop_oneof![any::<u16>(), Just(0), Just(u16::MAX), 30_000_u16..30_010];
    let command = prop_oneof![
        8 => Just(None),
        1 => Just(Some(OperatorCommand::Arm)),
        1 => Just(Some(OperatorCommand::Disarm)),
        1 => Just(Some(OperatorCommand::ResetFault))
    ];
    ((code(), code(), code(), prop::option::of(code())), any::<i32>(), command, any::<(bool, [bool; 4])>()).prop_map(
        |(codes, reference, command, (heard, f))| Inputs {
            reference: Position::from_bits(reference),
            position: AdcCode(codes.0),
            pressure_a: AdcCode(codes.1),
            pressure_b: AdcCode(codes.2),
            supply: codes.3.map(AdcCode),
            command,
            host_heard: heard,
            faults: ExternalFaults {
                missed_ticks: u8::from(f[0]) * 7,
                late_tick: f[1],
                overrun: f[2],
                model_disagreement: f[3] && f[0],
                contradicts: [
                    None,
                    Some(Contradicts::Position),
                    Some(Contradicts::PressureA(Pressure::from_bits(reference))),
                    Some(Contradicts::PressureB(Pressure::from_bits(reference))),
                ][usize::from(f[1]) + 2 * usize::from(f[2])],
                valve_output: f[3] && f[1] && f[2],
            },
        },
    )
}

/// A parameter of the positioning law: `part` of the way from its default, or from the middle of its range, to an end of that.
fn put_servo(p: &mut Parameters, key: Key, part: f64) {
    let limits = key.row().limits;
    let value = match key.default_value() {
        Value::Flag(_) | Value::Choice(..) => f64::from(part > 0.0),
        // Decades, where the range has them.
        _ if limits.low > 0.0 => {
            let default = match key.default_value() {
                Value::Number(default) => f64::from(default),
                _ => (limits.low * limits.high).sqrt(),
            };
            default * (if part < 0.0 { default / limits.low } else { limits.high / default }).powf(part)
        }
        _ => limits.high * part.abs().powi(8),
    };
    p.put(key, End::First, value.clamp(limits.low, limits.high) as f32);
}

/// The parameters of the positioning law, each somewhere between its default and an end of its range; tables of openings rise.
fn servo_parameters() -> impl Strategy<Value = Vec<(Key, f64)>> {
    let keys: Vec<Key> = Key::ALL.into_iter().filter(|key| key.row().key.starts_with("servo_")).collect();
    let (count, openings) = (keys.len(), |key: &Key| key.row().key.starts_with("servo_opening"));
    let any = (prop::collection::vec(-1.0_f64..1.0, count), 0.0_f64..1.0, any::<[bool; 3]>());
    any.prop_map(move |(mut parts, most, [table, choked, sides])| {
        let steps = keys.iter().position(openings).unwrap_or(count);
        parts[steps..].sort_by(f64::total_cmp);
        let given = |key: &Key| match key.row().key {
            name if name.starts_with("servo_opening") => table,
            name if name.ends_with("critical_ratio") => choked,
            name if name.contains("_b_") => sides,
            _ => true,
        };
        keys.iter().zip(&parts).filter(|(key, _)| given(key)).map(|(key, part)| (*key, part * most)).collect()
    })
}

/// Converters and laws over the whole accepted space.
fn accepted_parameters() -> impl Strategy<Value = Parameters> {
    (
        (-3.9_f32..3.0, 0.01_f32..3.0, 8_u8..=16, 8_u8..=16, 50_u32..20_000),
        (0.0_f32..300.0, prop::option::of(1e-4_f32..50.0), prop::option::of(0.1_f32..1000.0)),
        (-1.0_f32..0.0, 0.0_f32..1.0, 0.05_f32..20.0, 0.0_f32..0.1, 0.0_f32..0.1),
        (any::<bool>(), 0.0_f32..0.2, any::<[bool; 2]>()),
        servo_parameters(),
    )
        .prop_map(|(c, l, z, s, servo)| {
            let mut p = Parameters {
                law: if s.0 { LawChoice::Servo } else { LawChoice::Paper },
                stop_time_s: s.1,
                position_range_m: [c.0, c.0 + c.1],
                adc_bits: c.2,
                dac_bits: c.3,
                tick_hz: c.4,
                gain_v_per_m: l.0,
                setpoint_velocity_m_per_s: l.1,
                setpoint_acceleration_m_per_s2: l.2,
                dead_zone_left_v: z.0,
                dead_zone_right_v: z.1,
                slope_right: z.2,
                glitch_time_s: z.3,
                stuck_time_s: z.4,
                pressure_sensors: s.2[0],
                pressure_loss_trips: s.2[1],
                ..Parameters::default()
            };
            for (key, part) in servo {
                put_servo(&mut p, key, part);
            }
            p
        })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(test_stages::of(2000, 400) as u32) })]

    #[test]
    fn no_input_sequence_panics_or_leaves_the_range(
        p in accepted_parameters(), start in 0_u8..3, ticks in prop::collection::vec((inputs(), 1_usize..30), 1..60),
    ) {
        let Ok(config) = Config::from_parameters(&p) else { return Ok(()) };
        let mut state = match start {
            0 => ControllerState::boot(None),
            1 => ControllerState::boot(Some(control::Reason::Panic)),
            _ => ControllerState::armed(),
        };
        let mut stopping = 0.0;
        for (inputs, repeats) in ticks {
            for _ in 0..repeats {
                let before = (state.mode(), state.stopping());
                let outputs = step(&config, &mut state, inputs);
                learn(&config, &mut state);
                prop_assert!(outputs.dac <= config.dac_scale().max_code());
                prop_assert!(outputs.telemetry.u.abs() <= p.max_voltage_v);
                if state.stopping() {
                    prop_assert!(matches!(outputs.mode, Mode::Safe(_)));
                    prop_assert!(before.0 == Mode::Run || before.1);
                    stopping = if before.1 { stopping + 1.0 } else { 1.0 };
                    prop_assert!(stopping - 1.0 < p.stop_time_s * p.tick_hz as f32);
                } else if outputs.mode != Mode::Run {
                    prop_assert_eq!(outputs.dac, config.safe_code());
                }
                let before = before.0;
                if matches!(before, Mode::Safe(_)) && inputs.command != Some(OperatorCommand::ResetFault) {
                    prop_assert_eq!(outputs.mode, before);
                }
                if outputs.mode == Mode::Run && before != Mode::Run {
                    prop_assert!(before == Mode::Idle && inputs.command == Some(OperatorCommand::Arm));
                }
            }
        }
    }

    #[test]
    fn no_numbers_make_the_configuration_panic(numbers in prop::collection::vec((any_number(), any_number()), Key::ALL.len())) {
        let put = |p: &mut Parameters, key, (first, second)| {
            p.put(key, End::First, first);
            p.put(key, End::Second, second);
        };
        let mut all = Parameters::default();
        for (key, number) in Key::ALL.into_iter().zip(&numbers) {
            put(&mut all, key, *number);
        }
        let _ = Config::from_parameters(&all);
        // and one wrong number at a time, so that every check is reached
        for (key, number) in Key::ALL.into_iter().zip(&numbers) {
            let mut p = Parameters::default();
            put(&mut p, key, *number);
            if let Ok(config) = Config::from_parameters(&p) {
                let outputs = step(&config, &mut ControllerState::armed(), Inputs::default());
                prop_assert!(outputs.dac <= config.dac_scale().max_code());
            }
        }
    }
}
