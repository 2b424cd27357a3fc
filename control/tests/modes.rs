//! What may follow what.

mod bench;
use bench::Bench;
use control::{AdcCode, Config, ControllerState, DacCode, Mode, OperatorCommand, Parameters, Position, Reason};

#[test]
fn power_on_leads_through_self_test_to_idle_and_stays_there_with_the_valve_at_mid() {
    let mut bench = Bench::new(&Parameters::default(), ControllerState::boot(None));
    assert_eq!(bench.state.mode(), Mode::Boot);
    for n in 0..101 {
        let outputs = bench.tick(|_| ());
        assert!(n == 100 || matches!(outputs.mode, Mode::SelfTest { .. }), "{} at tick {n}", outputs.mode);
        assert_eq!(outputs.dac, DacCode(2048));
    }
    assert_eq!(bench.run(5000), Mode::Idle);
}

#[test]
fn a_reset_caused_by_a_fault_is_latched_and_never_leads_to_run_by_itself() {
    for reason in [Reason::WatchdogReset, Reason::StackOverflow, Reason::Panic] {
        let mut bench = Bench::new(&Parameters::default(), ControllerState::boot(Some(reason)));
        assert_eq!(bench.run(1000), Mode::Safe(reason));
        assert_eq!(bench.command(OperatorCommand::Arm), Mode::Safe(reason));
        bench.command(OperatorCommand::ResetFault);
        assert_eq!(bench.run(101), Mode::Idle);
    }
}

#[test]
fn safe_is_left_only_by_reset_fault_and_run_is_reached_only_by_arming_anew() {
    let mut bench = Bench::armed();
    bench.run(10);
    let (_, word) = bench.until_safe(100, |_, inputs| inputs.pressure_a = AdcCode(0));
    assert_eq!(word, "safe:pressure-a-range");
    for command in [OperatorCommand::Arm, OperatorCommand::Disarm] {
        assert_eq!(bench.command(command).to_string(), word, "the latch holds although the sensor is healthy again");
    }
    assert!(matches!(bench.command(OperatorCommand::ResetFault), Mode::SelfTest { .. }));
    assert_eq!(bench.run(1000), Mode::Idle);
    assert_eq!(bench.command(OperatorCommand::Arm), Mode::Run);
    assert_eq!(bench.command(OperatorCommand::Disarm), Mode::Idle);
}

#[test]
fn resetting_a_fault_that_is_still_there_ends_in_safe_again() {
    let mut bench = Bench::armed();
    bench.run(10);
    let dead = |inputs: &mut control::Inputs| inputs.position = AdcCode(65_535);
    let (_, word) = bench.until_safe(100, |_, inputs| dead(inputs));
    bench.tick(|inputs| {
        dead(inputs);
        inputs.command = Some(OperatorCommand::ResetFault);
    });
    assert_eq!(bench.until_safe(6, |_, inputs| dead(inputs)).1, word);
}

#[test]
fn commands_that_do_not_fit_the_mode_change_nothing() {
    let mut bench = Bench::new(&Parameters::default(), ControllerState::boot(None));
    bench.run(50);
    assert!(matches!(bench.command(OperatorCommand::Arm), Mode::SelfTest { .. }));
    bench.run(60);
    assert_eq!(bench.command(OperatorCommand::Disarm), Mode::Idle);
    assert_eq!(bench.command(OperatorCommand::ResetFault), Mode::Idle);
    bench.command(OperatorCommand::Arm);
    assert_eq!(bench.command(OperatorCommand::Arm), Mode::Run);
    assert_eq!(bench.command(OperatorCommand::ResetFault), Mode::Run);
}

#[test]
fn only_run_moves_the_valve() {
    let p = Parameters { safe_voltage_v: Some(-0.5), ..Parameters::default() };
    let mut bench = Bench::new(&p, ControllerState::boot(None));
    let safe = bench.config.safe_code();
    assert_eq!(safe, DacCode(1843));
    for _ in 0..200 {
        assert_eq!(bench.tick(|_| ()).dac, safe);
    }
    let outputs = bench.tick(|inputs| inputs.command = Some(OperatorCommand::Arm));
    assert_eq!(outputs.mode, Mode::Run);
    assert_eq!(outputs.dac, DacCode(2211)); // 4 V/m · 0.1 m
    assert_eq!(bench.tick(|inputs| inputs.command = Some(OperatorCommand::Disarm)).dac, safe);
}

#[test]
fn a_limited_reference_starts_where_the_piston_is() {
    let p = Parameters { setpoint_velocity_m_per_s: Some(0.1), ..Parameters::default() };
    let mut bench = Bench::new(&p, ControllerState::boot(None));
    bench.run(200);
    bench.inputs.position = AdcCode(32_768 + 200); // moved by hand while idle
    bench.run(100);
    let outputs = bench.tick(|inputs| inputs.command = Some(OperatorCommand::Arm));
    let start = bench.config.scales()[0].position(AdcCode(32_968));
    assert!((outputs.telemetry.reference - start).abs() <= Position::from_num(1.01e-4));
}

#[test]
fn the_host_may_be_silent_unless_a_time_out_is_set() {
    let mut bench = Bench::armed();
    bench.inputs.host_heard = false;
    assert_eq!(bench.run(100_000), Mode::Run);

    let p = Parameters { command_time_out_s: Some(0.5), ..Parameters::default() };
    let mut bench = Bench::new(&p, ControllerState::boot(None));
    bench.inputs.host_heard = false;
    assert_eq!(bench.run(2000), Mode::Idle, "silence counts while running only");
    bench.command(OperatorCommand::Arm);
    assert_eq!(bench.run(498), Mode::Run);
    bench.tick(|inputs| inputs.host_heard = true);
    assert_eq!(bench.run(499), Mode::Run);
    assert_eq!(bench.run(1).to_string(), "safe:command-time-out");
}

#[test]
fn two_timing_faults_in_a_row_are_bridged_and_three_are_not() {
    type Spoil = fn(&mut control::ExternalFaults);
    let kinds: [(Spoil, &str); 3] = [
        (|faults| faults.missed_ticks = 1, "safe:missed-tick"),
        (|faults| faults.late_tick = true, "safe:late-tick"),
        (|faults| faults.overrun = true, "safe:overrun"),
    ];
    for (spoil, word) in kinds {
        let mut bench = Bench::armed();
        bench.run(10);
        for _ in 0..20 {
            for _ in 0..2 {
                assert_eq!(bench.tick(|inputs| spoil(&mut inputs.faults)).mode, Mode::Run);
            }
            assert_eq!(bench.run(12), Mode::Run);
        }
        assert_eq!(bench.until_safe(10, |_, inputs| spoil(&mut inputs.faults)), (3, word.to_owned()));
    }
    // Ticks that did not happen count one by one, though they are heard of at once.
    for missed in 1..=20 {
        let mut bench = Bench::armed();
        bench.run(10);
        let mode = bench.tick(|inputs| inputs.faults.missed_ticks = missed).mode;
        assert_eq!(mode == Mode::Run, missed < 3, "{missed} missed: {mode}");
    }
}

#[test]
fn the_monitors_word_is_taken_at_once() {
    let mut bench = Bench::armed();
    bench.run(10);
    let tripped = bench.until_safe(10, |_, inputs| inputs.faults.model_disagreement = true);
    assert_eq!(tripped, (1, "safe:model-disagreement".to_owned()));
}

#[test]
fn an_output_that_does_not_obey_trips_at_once_armed_or_not() {
    let mut armed = Bench::armed();
    armed.run(10);
    let tripped = armed.until_safe(10, |_, inputs| inputs.faults.valve_output = true);
    assert_eq!(tripped, (1, "safe:valve-output".to_owned()));
    let mut idle = Bench::new(&Parameters::default(), ControllerState::boot(None));
    assert_eq!(idle.run(1000), Mode::Idle);
    assert_eq!(idle.until_safe(10, |_, inputs| inputs.faults.valve_output = true), tripped);
}

#[test]
fn low_supply_trips_in_run_only() {
    let mut bench = Bench::new(&Parameters::default(), ControllerState::boot(None));
    bench.inputs.supply = Some(AdcCode(20_000)); // 3.05 bar: air still off
    assert_eq!(bench.run(1000), Mode::Idle);
    assert_eq!(bench.command(OperatorCommand::Arm).to_string(), "safe:supply-low");
}

#[test]
fn an_armed_controller_without_a_credible_position_keeps_the_valve_at_mid() {
    let mut bench = Bench::armed();
    bench.inputs.position = AdcCode(0);
    for _ in 0..4 {
        let outputs = bench.tick(|_| ());
        assert_eq!((outputs.mode, outputs.dac), (Mode::Run, DacCode(2048)));
    }
    assert_eq!(bench.run(1).to_string(), "safe:position-range");
}

#[test]
fn every_reason_has_its_own_word_and_a_number_that_leads_back_to_it() {
    let mut words: Vec<&str> = Reason::ALL.iter().map(|reason| reason.as_str()).collect();
    for reason in Reason::ALL {
        assert_eq!(Reason::from_code(reason.code()), Some(reason));
        assert!(reason.as_str().chars().all(|c| c.is_ascii_lowercase() || c == '-'));
    }
    words.sort_unstable();
    words.dedup();
    assert_eq!(words.len(), Reason::ALL.len());
    let last = Reason::ALL.map(Reason::code).into_iter().max().unwrap();
    assert_eq!(Reason::from_code(last + 1), None);
}

#[test]
fn bad_parameters_are_refused_with_key_and_remedy() {
    let good = Parameters::default();
    for (p, key) in [
        (Parameters { tick_hz: 0, ..good.clone() }, "tick_hz"),
        (Parameters { adc_bits: 17, ..good.clone() }, "adc_bits"),
        (Parameters { dac_bits: 0, ..good.clone() }, "dac_bits"),
        (Parameters { gain_v_per_m: f32::NAN, ..good.clone() }, "gain_v_per_m"),
        (Parameters { gain_v_per_m: -1.0, ..good.clone() }, "gain_v_per_m"),
        (Parameters { position_range_m: [0.5, -0.5], ..good.clone() }, "position_range_m"),
        (Parameters { pressure_range_pa: [0.0, f32::INFINITY], ..good.clone() }, "pressure_range_pa"),
        (Parameters { dead_zone_left_v: 0.5, dead_zone_right_v: 0.4, ..good.clone() }, "dead_zone_left_v"),
        (Parameters { slope_left: 0.0, ..good.clone() }, "slope_left"),
        (Parameters { safe_voltage_v: Some(6.0), ..good.clone() }, "safe_voltage_v"),
        (Parameters { setpoint_range_m: Some([-0.6, 0.5]), ..good.clone() }, "setpoint_range_m"),
        (Parameters { setpoint_velocity_m_per_s: Some(0.0), ..good.clone() }, "setpoint_velocity_m_per_s"),
        (Parameters { setpoint_acceleration_m_per_s2: Some(1e9), ..good.clone() }, "setpoint_acceleration_m_per_s2"),
        (Parameters { command_time_out_s: Some(-1.0), ..good.clone() }, "command_time_out_s"),
    ] {
        let error = Config::from_parameters(&p).unwrap_err();
        assert_eq!(error.key, key);
        assert!(error.to_string().contains(" must "), "{error}");
    }
}
