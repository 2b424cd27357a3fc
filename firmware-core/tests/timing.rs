//! The interrupt's clock: what it calls a timing fault, and what the loop makes of several in a row.

use control::{ControllerState, ExternalFaults, Mode, Reason};
use firmware_core::{ControlLoop, Settings, Timing};

/// 1 kHz at 170 MHz.
const TICK: u32 = 170_000;

/// What the shell saw in one tick: cycles since the last entry, samples mixed, valve code late.
#[derive(Clone, Copy)]
struct Seen {
    elapsed: u32,
    mixed: bool,
    overran: bool,
}

const GOOD: Seen = Seen { elapsed: TICK, mixed: false, overran: false };
const MISSED: Seen = Seen { elapsed: 2 * TICK, ..GOOD };
const MIXED: Seen = Seen { mixed: true, ..GOOD };
const OVERRAN: Seen = Seen { overran: true, ..GOOD };

/// The interrupt's sequence of calls, armed from the beginning; the cycle counter wraps on the way.
fn mode_after(ticks: impl IntoIterator<Item = Seen>) -> Mode {
    let mut control_loop =
        ControlLoop::in_state(Settings::default().setup().expect("defaults"), ControllerState::armed());
    let mut timing = Timing::new(TICK);
    let mut entry = u32::MAX - 10 * TICK;
    for (n, seen) in ticks.into_iter().enumerate() {
        entry = entry.wrapping_add(seen.elapsed);
        let faults = timing.begin(entry, seen.mixed);
        let noise = (n % 3) as u16;
        control_loop.tick([32_767 + noise, 23_710 + noise, 23_712, 45_870], faults, true);
        timing.end(seen.overran);
        control_loop.watch();
    }
    control_loop.mode()
}

#[test]
fn two_timing_faults_in_a_row_are_bridged_and_a_third_is_safe_with_its_reason() {
    for (fault, reason) in [(MISSED, Reason::MissedTick), (MIXED, Reason::Overrun), (OVERRAN, Reason::LateTick)] {
        let row = |faults: usize| [vec![GOOD; 20], vec![fault; faults], vec![GOOD; 2]].concat();
        assert_eq!(mode_after(row(2)), Mode::Run, "{reason}");
        assert_eq!(mode_after(row(3)), Mode::Safe(reason));
    }
}

#[test]
fn ticks_missed_in_one_gap_count_one_by_one() {
    for missed in 1..300 {
        // A little early and a little late, as jitter makes it.
        for elapsed in [(missed + 1) * TICK - TICK / 3, (missed + 1) * TICK + TICK / 3] {
            let mut timing = Timing::new(TICK);
            timing.begin(0, false);
            assert_eq!(u32::from(timing.begin(elapsed, false).missed_ticks), missed.min(255));
        }
        let gap = Seen { elapsed: (missed + 1) * TICK, ..GOOD };
        let mode = mode_after([vec![GOOD; 20], vec![gap], vec![GOOD; 2]].concat());
        assert_eq!(mode, if missed < 3 { Mode::Run } else { Mode::Safe(Reason::MissedTick) }, "{missed} missed");
    }
}

#[test]
fn faults_of_different_kinds_in_a_row_are_bridged_and_good_ticks_make_room_for_the_next() {
    assert_eq!(mode_after([vec![GOOD; 20], vec![MISSED, MIXED, OVERRAN], vec![GOOD; 20]].concat()), Mode::Run);
    let spell = [vec![MISSED; 2], vec![GOOD; 8]].concat();
    assert_eq!(mode_after([vec![GOOD; 20], spell.repeat(50)].concat()), Mode::Run);
}

#[test]
fn every_second_tick_missed_is_safe_even_though_never_two_are_missed_in_a_row() {
    assert_eq!(mode_after([GOOD, MISSED].repeat(10)), Mode::Safe(Reason::MissedTick));
}

#[test]
fn jitter_of_a_third_of_a_tick_and_a_wrapping_counter_are_no_faults() {
    let mut timing = Timing::new(TICK);
    let none = ExternalFaults::default();
    for (n, entry) in [0, TICK * 4 / 3, TICK * 2, TICK * 10 / 3].into_iter().enumerate() {
        assert_eq!(timing.begin(entry.wrapping_sub(TICK * 2), false), none, "tick {n}");
        timing.end(false);
    }
}
