//! The controlled stop on the simulated rigs: where the piston goes with it, and without.

use control::{Channel, Mode, Reason};
use scenarios::{Outcome, Sample, Scenario, host_target, run_observed};
use std::path::Path;

/// Paper (a) on its way from 0 to 0.3 m, which takes from 1.0 to 1.55 s, when something fails.
fn scenario(stop_time_s: f64, at_s: f64, fault: &str) -> Scenario {
    let text = format!(
        "name = \"stop\"\nrig = \"paper-a\"\ndead_zone_v = 0.42\nduration_s = 2.5\noutput_delay_ticks = 1\n\
         reference = [{{ at_s = 1.0, position_m = 0.3 }}]\nfault = [{{ {fault}, at_s = {at_s:?} }}]\n\
         [control]\nlaw = \"servo\"\nstop_time_s = {stop_time_s:?}\n[effects.valve-lag]\ntime_constant_s = 0.0017\n[expect]\n"
    );
    Scenario::parse(&text, "stop.toml", Path::new(".")).unwrap_or_else(|error| panic!("{error}"))
}

fn run(scenario: &Scenario) -> (Outcome, Vec<Sample>) {
    let mut samples = Vec::new();
    let mut target = host_target(scenario).expect("a target");
    let outcome = run_observed(scenario, &mut target, |sample| samples.push(*sample)).expect("a run");
    (outcome, samples)
}

/// What fails at 1.4 s, on the last 70 mm at 0.65 m/s, and the word of the trip.
const FAULTS: [(&str, &str); 6] = [
    ("position-range", "kind = \"off\", channel = \"position\""),
    ("pressure-a-range", "kind = \"off\", channel = \"pressure-a\""),
    ("pressure-b-stuck", "kind = \"stuck\", channel = \"pressure-b\""),
    ("supply-range", "kind = \"shorted\", channel = \"supply\""),
    ("late-tick", "kind = \"late-ticks\""),
    ("missed-tick", "kind = \"dropped-ticks\", ticks = 1, every = 2"),
];

#[test]
fn a_piston_caught_while_it_brakes_stays_in_its_span_where_a_closed_valve_throws_it_back() {
    for (word, fault) in FAULTS {
        let [closed, stopped] = [0.0, 0.1].map(|stop_time_s| run(&scenario(stop_time_s, 1.4, fault)).0);
        println!("{word}: {:.1} mm, with the stop {:.1} mm", 1e3 * closed.excursion_m, 1e3 * stopped.excursion_m);
        assert_eq!(closed.tripped, stopped.tripped, "as soon as ever");
        assert_eq!(stopped.end.to_string(), format!("safe:{word}"));
        assert!(closed.excursion_m > 9e-3, "the scenario itself has gone blunt: {closed:?}");
        assert!(stopped.excursion_m < 5e-3, "{word}: {stopped:?}");
    }
}

#[test]
fn a_piston_caught_while_it_speeds_up_goes_less_far_than_with_a_closed_valve() {
    for (word, fault) in FAULTS {
        let way = |stop_time_s: f64| {
            let (_, samples) = run(&scenario(stop_time_s, 1.2, fault));
            let trip = samples.iter().position(|sample| sample.mode != Mode::Run).expect("a trip");
            let from = samples[trip].position_m;
            samples[trip..].iter().map(|sample| sample.position_m - from).fold(0.0, f64::max)
        };
        let [closed, stopped] = [0.0, 0.1].map(way);
        println!("{word}: {:.0} mm, with the stop {:.0} mm", 1e3 * closed, 1e3 * stopped);
        assert!(closed > 0.15 && stopped < 0.14, "{word}: {closed} m, {stopped} m");
    }
}

#[test]
fn the_air_stays_on_until_the_stop_has_ended_and_then_drops() {
    let dumped = Scenario { dump_valve_s: Some(0.01), ..scenario(0.1, 1.4, "kind = \"late-ticks\"") };
    let (_, samples) = run(&dumped);
    let trip = samples.iter().position(|sample| sample.mode == Mode::Safe(Reason::LateTick)).expect("a trip");
    let end = samples.iter().rposition(|sample| sample.stopping).expect("a stop");
    assert_eq!(end + 1 - trip, 100);
    let supply = |tick: usize| f64::from(samples[tick].codes[3]) / 65_535.0 * 10.0;
    // Sampled before the output that ends it.
    assert!((trip..end + 2).all(|tick| (supply(tick) - 7.0).abs() < 0.05), "7 bar all along");
    assert!(supply(end + 30) < 1.5, "{} bar", supply(end + 30));
}

/// What is wrong, how, and whether a stop follows.
const CONTRADICTIONS: [(&str, &str, bool); 8] = [
    ("a sensor that lags", "kind = \"slow\", channel = \"position\", time_constant_s = 0.1", true),
    ("a sensor that is late", "kind = \"delayed\", channel = \"position\", delay_s = 0.05", true),
    ("a pressure A of the wrong scale", "kind = \"scale\", channel = \"pressure-a\", factor = 0.7", true),
    ("a pressure B of the wrong scale", "kind = \"scale\", channel = \"pressure-b\", factor = 1.5", true),
    ("a pressure A that is garbage", "kind = \"garbage\", channel = \"pressure-a\"", true),
    ("a pressure B that is garbage", "kind = \"garbage\", channel = \"pressure-b\"", true),
    ("a pressure A that lags", "kind = \"slow\", channel = \"pressure-a\", time_constant_s = 0.1", true),
    ("a jammed valve", "kind = \"jammed-valve\"", false),
];

#[test]
fn of_the_contradictions_that_a_wrong_sensor_makes_comes_a_stop_and_of_a_jammed_valve_none() {
    for at_s in [1.2, 1.25, 1.4, 1.45] {
        for (what, fault, stops) in CONTRADICTIONS {
            let (outcome, samples) = run(&scenario(0.1, at_s, fault));
            let stopped = samples.iter().filter(|sample| sample.stopping).count();
            let (reason, _) = outcome.tripped.unwrap_or_else(|| panic!("{what} at {at_s} s is not found"));
            println!("{what} at {at_s} s: {reason}, {stopped} ticks, {:.1} mm", 1e3 * outcome.excursion_m);
            // A sensor that steps may be tripped by its own channel before.
            if matches!(reason, Reason::ModelDisagreement | Reason::Rate(_)) {
                assert_eq!(stopped, if stops { 100 } else { 0 }, "{what} at {at_s} s");
            }
        }
    }
}

#[test]
fn a_pressure_that_steps_is_tripped_by_its_name_and_leaves_the_piston_in_its_span_where_a_closed_valve_throws_it_out() {
    for (what, fault) in [
        ("A x 1.5", "kind = \"scale\", channel = \"pressure-a\", factor = 1.5"),
        ("A x 0.7", "kind = \"scale\", channel = \"pressure-a\", factor = 0.7"),
        ("A garbage", "kind = \"garbage\", channel = \"pressure-a\""),
        ("B x 1.5", "kind = \"scale\", channel = \"pressure-b\", factor = 1.5"),
        ("B x 0.7", "kind = \"scale\", channel = \"pressure-b\", factor = 0.7"),
        ("B garbage", "kind = \"garbage\", channel = \"pressure-b\""),
    ] {
        let [closed, stopped] = [0.0, 0.1].map(|stop_time_s| run(&scenario(stop_time_s, 1.4, fault)).0);
        println!("{what}: {:.1} mm, with the stop {:.1} mm", 1e3 * closed.excursion_m, 1e3 * stopped.excursion_m);
        assert_eq!(closed.tripped, stopped.tripped, "as soon as ever");
        let channel = if what.starts_with('A') { Channel::PressureA } else { Channel::PressureB };
        assert_eq!(stopped.end, Mode::Safe(Reason::Rate(channel)), "{what}");
        assert!(closed.excursion_m > 9e-3, "the scenario itself has gone blunt: {closed:?}");
        assert!(stopped.excursion_m < 5e-3, "{what}: {stopped:?}");
    }
}
