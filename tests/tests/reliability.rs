//! The reliability study in small: what must be caught is caught, and normal running never trips.

use control::{Channel, LawChoice};
use scenarios::Deviation;
use scenarios::fault::Kind;
use scenarios::reliability::{
    CONDITIONS, Condition, RIGS, THREAT_M, far_runs, moves_m, normal_running, one_move, rows, study,
};
use scenarios::sound_twin::{FLOW, Freedom, LIMIT, Log, NULL_V, Twin};

fn select(choose: impl Fn(Kind, Option<Channel>) -> bool) -> Vec<scenarios::reliability::Row> {
    let rows: Vec<_> = rows().into_iter().filter(|row| choose(row.fault.kind, row.fault.channel)).collect();
    assert!(!rows.is_empty());
    rows
}

#[test]
fn a_position_that_vanishes_is_always_caught_in_20_ms_and_the_piston_goes_no_further_than_it_coasts() {
    for row in select(|kind, channel| channel == Some(Channel::Position) && matches!(kind, Kind::Off | Kind::Shorted)) {
        let tally = study(&row, LawChoice::Servo, 7, 1).unwrap();
        assert!(tally.threatening >= 3, "{}: the study itself has gone blunt: {tally:?}", row.label);
        assert_eq!((tally.in_time, tally.missed), (tally.threatening, 0), "{}: {tally:?}", row.label);
        assert!(tally.worst_excursion_m < 0.06, "{}: {tally:?}", row.label);
        // What the fault itself adds to a valve that closes at once.
        assert!(tally.beyond_closed_m < THREAT_M, "{}: {tally:?}", row.label);
    }
}

/// The positioning law's observer takes little of a garbled position, the paper's law all of it.
#[test]
fn a_position_that_turns_to_garbage_is_always_caught_in_20_ms_under_either_law() {
    let row = &select(|kind, channel| channel == Some(Channel::Position) && kind == Kind::Garbage)[0];
    for (law, threatens) in [(LawChoice::Servo, 0), (LawChoice::Paper, 3)] {
        let tally = study(row, law, 7, 1).unwrap();
        assert!(tally.threatening >= threatens, "the study itself has gone blunt: {tally:?}");
        assert_eq!((tally.in_time, tally.missed), (tally.threatening, 0), "{tally:?}");
        assert_eq!(tally.reasons.values().sum::<usize>(), tally.runs, "{tally:?}");
    }
}

#[test]
fn a_noisy_position_that_freezes_is_always_caught_in_20_ms() {
    let row = &select(|kind, channel| channel == Some(Channel::Position) && kind == Kind::Stuck)[0];
    let tally = study(row, LawChoice::Servo, 7, 1).unwrap();
    assert_eq!(tally.in_time, tally.threatening, "{tally:?}");
    assert_eq!(tally.reasons.values().sum::<usize>(), tally.runs, "{tally:?}");
}

#[test]
fn every_lost_or_frozen_pressure_sensor_is_caught_in_every_run() {
    for row in select(|kind, channel| {
        channel.is_some_and(|c| c != Channel::Position) && matches!(kind, Kind::Off | Kind::Shorted | Kind::Garbage)
    }) {
        let tally = study(&row, LawChoice::Servo, 7, 1).unwrap();
        assert_eq!(tally.reasons.values().sum::<usize>(), tally.runs, "{}: {tally:?}", row.label);
    }
}

#[test]
fn timing_faults_supply_loss_and_a_dead_clock_reach_the_safe_state_in_every_run() {
    for row in select(|kind, _| matches!(kind, Kind::DroppedTicks | Kind::LateTicks | Kind::Overrun | Kind::SupplyLoss))
    {
        let tally = study(&row, LawChoice::Servo, 7, 1).unwrap();
        assert_eq!(tally.reasons.values().sum::<usize>(), tally.runs, "{}: {tally:?}", row.label);
        assert_eq!(tally.missed, 0, "{}: {tally:?}", row.label);
    }
}

/// In one of these runs the sensor turns late on the last millimetres. Without the test for jumps the piston goes 15 mm further than it
/// coasts, without a controlled stop 51 mm.
#[test]
fn a_position_sensor_that_is_suddenly_late_leads_the_piston_nowhere() {
    let row = &select(|kind, channel| channel == Some(Channel::Position) && kind == Kind::Delayed)[0];
    let tally = study(row, LawChoice::Servo, 4711, 1).unwrap();
    assert!(tally.reasons.values().sum::<usize>() >= 4, "the study itself has gone blunt: {tally:?}");
    assert!(tally.beyond_closed_m < 4e-3 && tally.furthest_m < 4e-3, "{tally:?}");
}

#[test]
fn normal_running_never_trips_even_when_the_rig_file_is_a_fifth_off() {
    for (rig, _) in RIGS {
        for condition in &CONDITIONS {
            let (outcome, closest) = normal_running(rig, LawChoice::Servo, condition, 60.0, 3).unwrap();
            assert_eq!(outcome.tripped, None, "{rig}, {}", condition.label);
            // Without noise little is left of what the monitor sees, but never nothing.
            assert!(closest > 0.02, "{rig}, {}: {closest}", condition.label);
        }
    }
}

/// A monitor that takes the valve to follow at once stops case (a) in most of these moves, one that knows its lag alone where there is none.
#[test]
fn fast_moves_never_trip_even_when_the_rig_file_is_a_fifth_off() {
    // Near its ends no chamber of these rigs has so much dead volume to spare.
    let less = Deviation { volumes: [0.9; 2], ..Deviation::NONE };
    let smaller = Condition { label: "volumes × 0.9", deviation: less, quiet: false };
    for (rig, _) in RIGS {
        for condition in CONDITIONS.iter().chain([&smaller]) {
            for to_m in moves_m(rig) {
                for seed in 0..2 {
                    let (outcome, _) = one_move(rig, LawChoice::Servo, condition, to_m, seed).unwrap();
                    assert_eq!(outcome.tripped, None, "{rig}, {} to {to_m} m", condition.label);
                }
            }
        }
    }
}

/// What the comparison says of a slow position sensor: errors of the rig file that differ in every tick would nearly explain its
/// readings, errors that the rig always has do not.
#[test]
fn a_sound_rig_with_a_load_reads_as_a_slow_sensor_does_only_where_its_errors_change_with_time() {
    let row = &select(|kind, channel| channel == Some(Channel::Position) && kind == Kind::Slow)[0];
    let far = far_runs(row, 4711, 3).unwrap();
    assert!(!far.is_empty(), "the study itself has gone blunt");
    for run in far {
        let rig = run.spoilt.rig_file().unwrap();
        let struck = (run.spoilt.fault[0].at_s / rig.io.tick_s()).round() as usize;
        let faulty = Log::of(&run.spoilt).unwrap();
        let tripped = faulty.tripped.expect("the monitor trips");
        let since = tripped + 1 - struck;
        let mean = |freedom: Freedom, log: &Log| {
            let twin = Twin::new(&rig, freedom, log, tripped + 1, row.quiet()).unwrap();
            twin.fit(&(struck - 300..tripped + 1)).largest_mean(since)
        };
        let sound = Log::of(&run.healthy).unwrap();
        assert!(mean(Freedom::Constants, &sound) < LIMIT, "{}", run.label);
        let by_constants = mean(Freedom::Constants, &faulty);
        assert!(by_constants > 2.0 * LIMIT, "{}: {by_constants}", run.label);
        let by_anything = mean(Freedom::Anything, &faulty);
        assert!(by_anything < 0.2 * by_constants, "{}: {by_anything} and {by_constants}", run.label);
    }
}

#[test]
fn a_sound_twin_is_allowed_what_the_monitor_allows() {
    let monitor = monitor::MonitorParameters::default();
    assert_eq!([FLOW as f32, NULL_V as f32], [monitor.relative, monitor.opening_v]);
}
