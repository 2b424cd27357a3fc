//! Scenarios on the flashed ELF: the emulated chip in the runner's loop, every valve code equal to the desktop's.
//!
//! The expectations of each scenario file must hold, too, and the board's own word for its state at the end. Skipped with a
//! message where the target is not installed, and without POSITIONER_TESTS=all.

use scenarios::emulated::EmulatedTarget;
use scenarios::listing::{assert_complete, assert_fulfilled, named};
use scenarios::{run_observed, tests_by_name};
use std::sync::{Once, OnceLock};
use test_stages::firmware::build_for_target;
use test_stages::skipped;

fn elf() -> Option<&'static [u8]> {
    static ELF: OnceLock<Result<Vec<u8>, String>> = OnceLock::new();
    static SAID: Once = Once::new();
    let built = ELF.get_or_init(|| {
        let path = build_for_target("firmware")?;
        Ok(std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    });
    built.as_deref().inspect_err(|why| SAID.call_once(|| skipped("scenarios on the emulated chip", why))).ok()
}

fn holds(name: &str) {
    let Some(elf) = elf() else { return };
    let mut scenario = named(name);
    // The timer latches a code with the tick after: the chip knows no other delay.
    scenario.output_delay_ticks = 1;
    let mut target = EmulatedTarget::start(elf, &scenario).unwrap_or_else(|error| panic!("{name}: {error}"));
    let outcome = run_observed(&scenario, &mut target, |_| ()).unwrap_or_else(|error| panic!("{name}: {error}"));
    let facts = target.finish().unwrap_or_else(|error| panic!("{name}: {error}"));
    println!(
        "{name}: {} ticks, no code differs; at most {} instructions and {} cycles to the valve code",
        facts.ticks, facts.instructions, facts.cycles
    );
    assert_fulfilled(&scenario, &outcome);
}

tests_by_name! { holds:
    a_lost_pressure_sensor_may_be_ridden_through,
    without_pressure_sensors_the_law_goes_by_its_model,
    paper_a_overshoots_and_hunts,
    a_noiseless_position_frozen_in_mid_move_is_caught_without_a_model,
    a_noiseless_slam_into_an_end_stop_is_no_fault,
    paper_b_does_not_overshoot,
    paper_c_behaves_like_b,
    a_real_valve_with_dead_zone_reaches_the_target,
    power_on_arm_move_disarm,
    position_sensor_lost_in_mid_move_is_safe_within_20_ms,
    position_sensor_frozen_in_mid_move_is_safe_within_20_ms,
    a_quiet_position_sensor_frozen_is_found_by_the_monitor,
    supply_loss_is_safe_within_20_ms,
    a_dead_tick_timer_is_safe_at_the_next_ticks,
    a_single_lost_tick_is_bridged,
    a_silent_host_is_noticed_when_a_time_out_is_set,
    a_fault_is_cleared_by_hand_and_the_move_is_finished,
    the_identification_sequence_runs_without_a_trip,
    ten_thousand_ticks_per_second_move_and_catch_a_lost_sensor,
    ten_thousand_ticks_per_second_under_the_positioning_law,
    a_jammed_valve_is_found_and_the_dump_valve_takes_the_air,
}

/// Scenarios that the chip cannot be brought into, and why.
const ELSEWHERE: &[(&str, &str)] = &[
    (
        "lost_samples_are_safe_within_20_ms",
        "a conversion is overwritten only while the core stands still, which no input brings about",
    ),
    (
        "without_the_inverse_the_dead_zone_leaves_a_large_error",
        "the board's monitor takes the dead zone from the law, which here knows of none: it trips",
    ),
];

#[test]
fn every_scenario_file_runs_on_the_chip_or_is_listed_with_the_reason_why_not() {
    assert_complete(NAMES.iter().copied().chain(ELSEWHERE.iter().map(|(name, _)| *name)));
}
