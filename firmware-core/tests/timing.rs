//! The interrupt's clock: what it calls a timing fault, and what the loop makes of several in a row.

use control::{ControllerState, ExternalFaults, Mode, Reason};
use firmware_core::{ControlLoop, Settings, Timing};

/// 1 kHz at 170 MHz.
const TICK: u32 = 170_000;

/// What the shell saw of one tick.
#[derive(Clone, Copy)]
struct Seen {
    /// Ticks lost ahead of it.
    missed: u32,
    /// From its update to the reading of its samples, in cycles; beyond a tick, the next conversion is under way.
    read_after: u32,
    /// The valve code came too late.
    overran: bool,
}

const GOOD: Seen = Seen { missed: 0, read_after: TICK / 20, overran: false };
const MISSED: Seen = Seen { missed: 1, ..GOOD };
const MIXED: Seen = Seen { read_after: TICK + TICK / 100, ..GOOD };
const OVERRAN: Seen = Seen { read_after: TICK * 99 / 100, overran: true, ..GOOD };

fn begin(timing: &mut Timing, update: u32, seen: Seen) -> ExternalFaults {
    timing.begin(update.wrapping_add(seen.read_after), seen.read_after % TICK, seen.read_after >= TICK)
}

/// The interrupt's sequence of calls, armed from the beginning; the cycle counter wraps on the way.
fn mode_after(ticks: impl IntoIterator<Item = Seen>) -> Mode {
    let mut control_loop =
        ControlLoop::in_state(Settings::default().setup().expect("defaults"), ControllerState::armed());
    let mut timing = Timing::new(TICK);
    let mut update = u32::MAX - 10 * TICK;
    for (n, seen) in ticks.into_iter().enumerate() {
        update = update.wrapping_add((seen.missed + 1) * TICK);
        let faults = begin(&mut timing, update, seen);
        let noise = (n % 3) as u16;
        control_loop.tick([32_767 + noise, 23_710 + noise, 23_712, 45_870], faults, true);
        timing.end(seen.overran);
        control_loop.conclude();
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
        // Read a little early and a little late, as jitter makes it.
        for read_after in [TICK / 20, TICK * 99 / 100] {
            let mut timing = Timing::new(TICK);
            begin(&mut timing, 0, GOOD);
            let gap = Seen { read_after, ..GOOD };
            assert_eq!(u32::from(begin(&mut timing, (missed + 1) * TICK, gap).missed_ticks), missed.min(255));
        }
        let mode = mode_after([vec![GOOD; 20], vec![Seen { missed, ..GOOD }], vec![GOOD; 2]].concat());
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
fn an_interrupt_that_comes_late_has_not_missed_a_tick() {
    let mut timing = Timing::new(TICK);
    for (n, share) in [5, 40, 97, 5, 60, 99, 5].into_iter().enumerate() {
        let seen = Seen { read_after: TICK / 100 * share, ..GOOD };
        let update = (n as u32 * TICK).wrapping_sub(2 * TICK);
        assert_eq!(begin(&mut timing, update, seen), ExternalFaults::default(), "tick {n}");
        timing.end(false);
    }
}
