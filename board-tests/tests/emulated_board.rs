//! The checks on the emulated board: they are known to work, and each is known to fail where the board is not as it should be.
//! Skipped with a message without POSITIONER_TESTS=all.

use board_tests::emulated::Emulated;
use board_tests::{Bench as _, Check, Outcome};
use std::sync::OnceLock;
use test_stages::firmware::build_for_target;
use test_stages::skipped;

fn board() -> Option<Emulated> {
    static ELF: OnceLock<Result<Vec<u8>, String>> = OnceLock::new();
    let built = ELF.get_or_init(|| {
        let path = build_for_target("firmware")?;
        Ok(std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    });
    let elf = built.as_deref().map_err(|why| skipped("checks of the emulated board", why)).ok()?;
    Some(Emulated::power_up(elf).unwrap_or_else(|error| panic!("{error}")))
}

fn passes(check: Check) {
    let Some(mut board) = board() else { return };
    match check.run(&mut board) {
        Ok(Outcome::Passed(numbers)) => println!("{check:?}: {numbers}"),
        other => panic!("{check:?}: {other:?}"),
    }
}

macro_rules! pass {
    ($($name:ident: $check:ident;)+) => { $(#[test] fn $name() { passes(Check::$check); })+ };
}

pass! {
    the_emulated_board_boots: Boot;
    its_clock_is_right: Clocks;
    its_converters_read_its_output: Converters;
    its_model_is_the_desktops: Model;
    its_ticks_keep_to_their_time: Cycles;
    it_saves_a_hundred_times: Saves;
    its_watchdog_bites: Watchdog;
}

/// What a check says of a board with a fault.
fn fails(check: Check, fault: impl FnOnce(&mut Emulated)) -> Option<String> {
    let mut board = board()?;
    fault(&mut board);
    match check.run(&mut board) {
        Err(failure) => Some(failure.to_string()),
        other => panic!("{check:?} finds nothing wrong: {other:?}"),
    }
}

#[test]
fn flash_that_refuses_is_found_by_the_saves() {
    if let Some(said) = fails(Check::Saves, |board| board.board().machine().chip.flash.refusing = true) {
        assert!(said.contains("flash could not be written"), "{said}");
    }
}

#[test]
fn a_tick_that_never_comes_is_found_at_boot() {
    let stopped = |board: &mut Emulated| {
        board.board().machine().chip.tim6.trigger_stuck = true;
        board.pause(0.1);
    };
    if let Some(said) = fails(Check::Boot, stopped) {
        assert!(said.contains("does not stay up"), "{said}");
    }
}

#[test]
fn a_wire_that_is_off_is_found_by_the_converters() {
    // Channel 7 is p_b.
    if let Some(said) = fails(Check::Converters, |board| board.board().analog().broken = Some(7)) {
        // A wire that is off is silent, if nothing else tells first.
        assert!(said.contains("input 2 reads") || said.contains("pressure-b"), "{said}");
    }
}
