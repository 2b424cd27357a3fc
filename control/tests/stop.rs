//! The controlled stop: when it begins, what ends it, and that it ends by itself.

mod bench;
use bench::Bench;
use control::{
    AdcCode, Contradicts, ControllerState, Inputs, LawChoice, Mode, OperatorCommand, Parameters, Pressure, Reason,
};

/// Ticks of the stop at the default of 0.1 s and 1 kHz.
const TICKS: usize = 100;

fn parameters() -> Parameters {
    Parameters {
        law: LawChoice::Servo,
        dead_zone_right_v: 0.42,
        dead_zone_left_v: -0.42,
        command_time_out_s: Some(0.01),
        ..Parameters::default()
    }
}

/// Running towards a target 0.1 m away, with more force from chamber A than from B: what a stop lets out.
fn running(p: &Parameters) -> Bench {
    let mut bench = Bench::new(p, ControllerState::armed()).noisy(20);
    bench.inputs.pressure_a = AdcCode(30_000);
    assert_eq!(bench.run(400), Mode::Run);
    bench
}

type Spoil = fn(&mut Inputs);

/// What one cause alone may be.
const PERMITTED: [(&str, Spoil); 10] = [
    ("position-range", |inputs| inputs.position = AdcCode(0)),
    ("position-stuck", |inputs| inputs.position = AdcCode(32_768)),
    ("pressure-a-range", |inputs| inputs.pressure_a = AdcCode(0)),
    ("pressure-b-stuck", |inputs| inputs.pressure_b = AdcCode(23_700)),
    ("supply-range", |inputs| inputs.supply = None),
    ("supply-low", |inputs| inputs.supply = inputs.supply.map(|code| AdcCode(code.0.saturating_sub(25_000)))),
    ("missed-tick", |inputs| inputs.faults.missed_ticks = 1),
    ("late-tick", |inputs| inputs.faults.late_tick = true),
    ("overrun", |inputs| inputs.faults.overrun = true),
    ("command-time-out", |inputs| inputs.host_heard = false),
];

#[test]
fn what_a_run_has_learned_up_to_a_fault_of_a_sensor_or_the_valve_is_forgotten() {
    let forgotten = |spoil: Spoil| {
        let mut bench = Bench::new(&parameters(), ControllerState::armed()).noisy(20);
        let start = bench.config.learned(bench.state.servo()).expect("the positioning law");
        // To and fro, so that the law believes that it has moved something.
        for n in 0..400_u16 {
            let out = if n % 200 < 100 { n % 100 } else { 100 - n % 100 };
            bench.inputs.position = AdcCode(32_768 + 10 * out);
            bench.inputs.pressure_a = AdcCode(23_700 + 10 * out);
            assert_eq!(bench.run(1), Mode::Run);
            control::learn(&bench.config, &mut bench.state);
        }
        let learned = bench.config.learned(bench.state.servo()).expect("the positioning law");
        assert_ne!(learned, start);
        trip(&mut bench, spoil);
        let after = bench.config.learned(bench.state.servo()).expect("the positioning law");
        assert!(after == start || after == learned, "{after:?}");
        after == start
    };
    for (word, spoil) in PERMITTED {
        let sensor = word.starts_with("position") || word.starts_with("pressure");
        assert_eq!(forgotten(spoil), sensor, "{word}");
    }
    assert!(forgotten(|inputs| inputs.faults.valve_output = true));
    assert!(forgotten(|inputs| inputs.faults.model_disagreement = true));
}

/// Spoils every tick until the trip, that tick included; its word.
fn trip(bench: &mut Bench, spoil: Spoil) -> String {
    for _ in 0..100 {
        let outputs = bench.tick(spoil);
        if let Mode::Safe(_) = outputs.mode {
            return outputs.mode.to_string();
        }
    }
    panic!("never tripped")
}

#[test]
fn one_named_cause_leads_to_a_stop_of_so_many_ticks_that_lets_the_force_out_and_then_to_the_safe_voltage() {
    for (word, spoil) in PERMITTED {
        let mut bench = running(&parameters());
        assert!(!bench.state.stopping());
        assert_eq!(trip(&mut bench, spoil), format!("safe:{word}"));
        let safe = bench.config.safe_code();
        let mut ticks = 1;
        while bench.state.stopping() {
            let outputs = bench.tick(spoil);
            assert_eq!(outputs.mode.to_string(), format!("safe:{word}"), "the reason stays");
            if bench.state.stopping() {
                ticks += 1;
                assert!(outputs.dac < safe, "{word}: {:?} fills the fuller chamber at tick {ticks}", outputs.dac);
            } else {
                assert_eq!(outputs.dac, safe, "{word}");
            }
        }
        // Ticks that did not happen count: the stop is bounded in time.
        assert_eq!(ticks, if word == "missed-tick" { TICKS / 2 } else { TICKS }, "{word}");
        for _ in 0..3 * TICKS {
            assert_eq!(
                (bench.tick(|_| ()).dac, bench.state.stopping()),
                (safe, false),
                "{word}: it does not begin again"
            );
        }
    }
}

#[test]
fn what_names_no_sensor_or_doubts_the_valve_leads_to_the_safe_voltage_at_once() {
    let at_once: [(&str, Spoil); 3] = [
        ("model-disagreement", |inputs| inputs.faults.model_disagreement = true),
        ("valve-output", |inputs| inputs.faults.valve_output = true),
        // Two sensors in the same tick.
        ("pressure-a-range", |inputs| (inputs.pressure_a, inputs.pressure_b) = (AdcCode(0), AdcCode(0))),
    ];
    for (word, spoil) in at_once {
        let mut bench = running(&parameters());
        let (_, found) = bench.until_safe(100, |_, inputs| spoil(inputs));
        assert_eq!((found, bench.state.stopping()), (format!("safe:{word}"), false));
    }
}

#[test]
fn a_second_cause_ends_the_stop_in_the_tick_in_which_it_is_found_and_the_reason_stays_the_first() {
    let ends = PERMITTED.into_iter().chain([
        ("model-disagreement", (|inputs| inputs.faults.model_disagreement = true) as Spoil),
        ("valve-output", |inputs| inputs.faults.valve_output = true),
    ]);
    // A word's first part is what it is wrong with, but for the sources of timing faults.
    let source = |word: &str| match word {
        "missed-tick" | "late-tick" | "overrun" => "timing".to_owned(),
        _ => word.trim_end_matches("-range").trim_end_matches("-stuck").trim_end_matches("-low").to_owned(),
    };
    for (second, end) in ends {
        for (first, spoil) in PERMITTED {
            let mut bench = running(&parameters());
            trip(&mut bench, spoil);
            for _ in 0..10 {
                bench.tick(spoil);
            }
            assert!(bench.state.stopping());
            let mut ticks = 0;
            while bench.state.stopping() {
                ticks += 1;
                let outputs = bench.tick(|inputs| {
                    spoil(inputs);
                    end(inputs);
                });
                assert_eq!(outputs.mode.to_string(), format!("safe:{first}"));
                assert!(bench.state.stopping() || outputs.dac == bench.config.safe_code());
            }
            // Found as soon as in a run: within the time of its check.
            let ended = ticks <= TICKS / 2 - 10;
            assert_eq!(
                ended,
                source(first) != source(second) || first == "missed-tick",
                "{first}, then {second}: {ticks}"
            );
        }
    }
}

#[test]
fn a_contradiction_leads_to_a_stop_only_where_a_sensor_is_named() {
    for (contradicts, ticks) in [(None, 0), (Some(Contradicts::Position), TICKS)] {
        let mut bench = running(&parameters());
        let outputs = bench.tick(|inputs| {
            inputs.faults.model_disagreement = true;
            inputs.faults.contradicts = contradicts;
        });
        assert_eq!(outputs.mode, Mode::Safe(Reason::ModelDisagreement));
        let mut found = 0;
        while bench.state.stopping() {
            found += 1;
            // Whatever the position reads now.
            bench.tick(|inputs| inputs.position = AdcCode(if found % 2 == 0 { 0 } else { 50_000 }));
        }
        assert_eq!(found, ticks);
    }
    // Alone it says nothing.
    let mut bench = running(&parameters());
    for contradicts in [Contradicts::Position, Contradicts::PressureA(Pressure::from_num(3e5))] {
        assert_eq!(bench.tick(|inputs| inputs.faults.contradicts = Some(contradicts)).mode, Mode::Run);
    }
}

#[test]
fn a_pressure_that_contradicts_is_what_the_monitor_says_in_the_tick_of_the_trip_and_from_the_model_then() {
    // Both chambers as at the beginning of the run; one reads more and more, up to 1.5 bar, as fast as its air could.
    let codes = |b: bool, told_pa: f64, later: u16| {
        let mut bench = running(&parameters());
        fn reading(inputs: &mut Inputs, b: bool) -> &mut AdcCode {
            if b { &mut inputs.pressure_b } else { &mut inputs.pressure_a }
        }
        let right = reading(&mut bench.inputs, b).0;
        for n in 1..10 {
            bench.tick(|inputs| *reading(inputs, b) = AdcCode(right + n * 983));
        }
        let told = Pressure::from_num(told_pa);
        let outputs = bench.tick(|inputs| {
            *reading(inputs, b) = AdcCode(right + 9_830);
            inputs.faults.model_disagreement = true;
            inputs.faults.contradicts =
                Some(if b { Contradicts::PressureB(told) } else { Contradicts::PressureA(told) });
        });
        assert_eq!(outputs.mode, Mode::Safe(Reason::ModelDisagreement));
        let mut codes = vec![outputs.dac];
        while bench.state.stopping() {
            codes.push(bench.tick(|inputs| *reading(inputs, b) = AdcCode(later)).dac);
        }
        assert_eq!(codes.len(), TICKS + 1);
        (codes, bench.config.safe_code())
    };
    for (b, right_pa) in [(false, 4.58e5), (true, 3.62e5)] {
        let (as_before, safe) = codes(b, right_pa, 30_000);
        assert!(as_before[..10].iter().all(|code| *code < safe), "A has more force, and it is let out: {as_before:?}");
        // What the sensor reads then counts for nothing.
        assert_eq!(as_before, codes(b, right_pa, 20_000).0);
        // But what the monitor says does: more force from the other side, and the valve opens the other way.
        let opposite_pa = if b { right_pa + 3e5 } else { right_pa - 3e5 };
        let (other_way, _) = codes(b, opposite_pa, 30_000);
        assert!(other_way[..10].iter().all(|code| *code > safe), "{other_way:?}");
    }
}

#[test]
fn resetting_the_fault_ends_the_stop_and_another_fault_in_safe_begins_none() {
    let mut bench = running(&parameters());
    trip(&mut bench, |inputs| inputs.faults.late_tick = true);
    bench.tick(|inputs| inputs.command = Some(OperatorCommand::Arm));
    assert!(bench.state.stopping(), "no other command is heard");
    let outputs = bench.tick(|inputs| inputs.command = Some(OperatorCommand::ResetFault));
    assert!(matches!(outputs.mode, Mode::SelfTest { .. }));
    assert_eq!((outputs.dac, bench.state.stopping()), (bench.config.safe_code(), false));
    // A sensor lost in self-test: safe, and nothing moves.
    let (_, word) = bench.until_safe(100, |_, inputs| inputs.pressure_a = AdcCode(0));
    assert_eq!((word.as_str(), bench.state.stopping()), ("safe:pressure-a-range", false));
}

#[test]
fn disarming_a_rest_in_hold_the_papers_law_and_a_rig_without_pressure_sensors_close_the_valve_at_once() {
    let mut bench = running(&parameters());
    let outputs = bench.tick(|inputs| inputs.command = Some(OperatorCommand::Disarm));
    assert_eq!((outputs.mode, outputs.dac, bench.state.stopping()), (Mode::Idle, bench.config.safe_code(), false));

    for p in [
        Parameters { law: LawChoice::Paper, ..parameters() },
        Parameters { pressure_sensors: false, ..parameters() },
        Parameters { stop_time_s: 0.0, ..parameters() },
    ] {
        let mut bench = running(&p);
        let (_, word) = bench.until_safe(100, |_, inputs| inputs.position = AdcCode(0));
        assert_eq!((word.as_str(), bench.state.stopping()), ("safe:position-range", false));
    }

    // It rests where it is sent, and a load is held with more force from A: none of it must be let out.
    let mut bench = Bench::new(&parameters(), ControllerState::armed());
    bench.inputs.pressure_a = AdcCode(30_000);
    bench.inputs.reference = control::Position::ZERO;
    bench.run(2000);
    assert!(bench.state.servo().hold.on);
    let (_, word) = bench.until_safe(100, |_, inputs| inputs.faults.late_tick = true);
    assert_eq!((word.as_str(), bench.state.stopping()), ("safe:late-tick", false));
}

#[test]
fn a_stop_changes_no_code_of_a_run_before_its_trip_and_nothing_that_is_learned() {
    let run = |stop_time_s: f32| {
        let mut bench = running(&Parameters { stop_time_s, ..parameters() });
        let mut codes = Vec::new();
        for n in 0..500 {
            let outputs = bench.tick(|inputs| {
                if n >= 200 {
                    inputs.pressure_b = AdcCode(0);
                }
            });
            control::learn(&bench.config, &mut bench.state);
            codes.push((outputs.mode, outputs.dac));
        }
        let learned = bench.config.learned(bench.state.servo());
        (codes, bench.config.safe_code(), learned)
    };
    let (closed, safe, learned_closed) = run(0.0);
    let (stopped, _, learned) = run(0.1);
    let trip = closed.iter().position(|(mode, _)| *mode != Mode::Run).expect("a trip");
    assert_eq!(closed[..trip], stopped[..trip]);
    assert_eq!(closed[trip..], vec![(Mode::Safe(Reason::Range(control::Channel::PressureB)), safe); 500 - trip]);
    assert_ne!(closed[trip..trip + TICKS], stopped[trip..trip + TICKS]);
    assert_eq!(closed[trip + TICKS..], stopped[trip + TICKS..]);
    assert_eq!(learned_closed, learned);
}

#[test]
fn a_failed_pressure_is_taken_from_the_model_whatever_its_sensor_reads_later() {
    let codes = |later: AdcCode| {
        let mut bench = running(&parameters());
        trip(&mut bench, |inputs| inputs.pressure_b = AdcCode(0));
        (1..TICKS)
            .map(|_| {
                let outputs = bench.tick(|inputs| inputs.pressure_b = later);
                assert!(bench.state.stopping());
                outputs.dac
            })
            .collect::<Vec<_>>()
    };
    // Out of range, plausible again, and plausible but wrong.
    assert_eq!(codes(AdcCode(0)), codes(AdcCode(23_700)));
    assert_eq!(codes(AdcCode(0)), codes(AdcCode(40_000)));
}
