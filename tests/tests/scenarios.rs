//! Every scenario file by name, on the host.

use scenarios::listing::{assert_complete, assert_fulfilled, named};
use scenarios::{Scenario, run, tests_by_name};
use std::path::Path;

fn holds(name: &str) {
    let scenario = named(name);
    let outcome = run(&scenario).unwrap_or_else(|error| panic!("{name}: {error}"));
    assert_fulfilled(&scenario, &outcome);
}

tests_by_name! { holds:
    paper_a_overshoots_and_hunts,
    a_noiseless_position_frozen_in_mid_move_is_caught_without_a_model,
    a_noiseless_slam_into_an_end_stop_is_no_fault,
    paper_b_does_not_overshoot,
    paper_c_behaves_like_b,
    a_real_valve_with_dead_zone_reaches_the_target,
    without_the_inverse_the_dead_zone_leaves_a_large_error,
    power_on_arm_move_disarm,
    position_sensor_lost_in_mid_move_is_safe_within_20_ms,
    position_sensor_frozen_in_mid_move_is_safe_within_20_ms,
    a_quiet_position_sensor_frozen_is_found_by_the_monitor,
    supply_loss_is_safe_within_20_ms,
    a_dead_tick_timer_is_safe_at_the_next_ticks,
    a_single_lost_tick_is_bridged,
    lost_samples_are_safe_within_20_ms,
    a_silent_host_is_noticed_when_a_time_out_is_set,
    a_fault_is_cleared_by_hand_and_the_move_is_finished,
    the_identification_sequence_runs_without_a_trip,
    ten_thousand_ticks_per_second_move_and_catch_a_lost_sensor,
    ten_thousand_ticks_per_second_under_the_positioning_law,
    a_jammed_valve_is_found_and_the_dump_valve_takes_the_air,
    a_lost_pressure_sensor_may_be_ridden_through,
    without_pressure_sensors_the_law_goes_by_its_model,
}

#[test]
fn every_scenario_file_is_a_test() {
    assert_complete(NAMES.iter().copied());
}

#[test]
fn the_same_scenario_gives_the_same_codes_every_time_and_another_seed_gives_others() {
    let mut scenario = named("paper_b_does_not_overshoot");
    let first = run(&scenario).unwrap();
    assert_eq!(first, run(&scenario).unwrap());
    scenario.seed += 1;
    assert_ne!(first.fingerprint, run(&scenario).unwrap().fingerprint);
}

#[test]
fn malformed_scenarios_are_refused_with_file_line_and_remedy() {
    let good = "name = \"x\"\nrig = \"paper-a\"\nduration_s = 1.0\n[expect]\n";
    assert!(Scenario::parse(good, "good.toml", Path::new(".")).is_ok());
    for (text, expected) in [
        (good.replace("duration_s", "duration"), "duration"),
        (good.replace("1.0", "nan"), "duration_s"),
        (good.replace("paper-a", "paper-z"), "paper-z"),
        (format!("{good}ended = 1\n"), "ended"),
        (format!("{good}[control]\ngain = 1.0\n"), "gain"),
        (format!("{good}[control]\ngain_v_per_m = -1.0\n"), "gain_v_per_m"),
        (format!("{good}[[fault]]\nkind = \"off\"\nat_s = 0.1\n"), "channel"),
        (format!("{good}[[reference]]\nat_s = 0.1\n"), "reference"),
        (format!("{good}[effects.leak]\nx = 1\n"), "leak"),
        (format!("{good}[effects.valve-lag]\nx = 1\n"), "time_constant_s"),
    ] {
        let error = Scenario::parse(&text, "bad.toml", Path::new(".")).unwrap_err().to_string();
        assert!(error.contains(expected), "{error} does not mention {expected}");
    }
}
