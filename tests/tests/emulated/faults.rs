//! Faults below the software: lost triggers, flash that fails, words that rot, a supply that goes. Each ends in a named state.

use board_link::{
    Command, FRAME_BYTES, Generator, PROTOCOL_VERSION, Parameter, Refusal, Reply, Request, Response, Shape, encode,
};
use defmt_decoder::DecodeError;
use stm32_emulator::peripherals::flash::Ecc;
use stm32_emulator::peripherals::rcc::ResetCause;
use stm32_emulator::rtt;
use stm32_emulator::time::to_seconds;

use control::Reason;
use firmware_core::output_tolerance;

use super::{Bench, CONTROL_INTERRUPT, MILLISECOND, elf};

/// The pages of the parameters, as offsets into flash.
const PARAMETERS: std::ops::Range<usize> = 0x7_E000..0x8_0000;
/// The valve's code at mid.
const MID: Option<u16> = Some(2048);

impl Bench {
    /// No triggers for so many ticks. A reset ends it.
    fn lose_triggers(&mut self, ticks: u32) -> Option<ResetCause> {
        // From the middle between two ticks to the middle between two others.
        let ran = self.machine().chip.adc1.sequences;
        while self.machine().chip.adc1.sequences == ran {
            assert_eq!(self.run(50e-6), None);
        }
        assert_eq!(self.run(0.4 * MILLISECOND), None);
        self.machine().chip.tim6.trigger_stuck = true;
        let reset = self.run(f64::from(ticks) * MILLISECOND);
        self.machine().chip.tim6.trigger_stuck = false;
        reset
    }

    /// What a command is answered with, if that happens before a reset.
    fn answer_or_reset(&mut self, command: Command) -> Result<Result<Reply, Refusal>, ResetCause> {
        self.send(command);
        for _ in 0..500 {
            if let Some(cause) = self.run(MILLISECOND) {
                return Err(cause);
            }
            for byte in self.machine().chip.lpuart.take_sent() {
                if let Some(Ok(answer)) = self.answers.push::<Response>(byte) {
                    return Ok(answer.result);
                }
            }
        }
        panic!("no answer to {command:?} within 0.5 s");
    }

    /// Whether a valve behind PB0 lets air in.
    pub(super) fn air(&mut self) -> bool {
        self.machine().chip.gpio[1].driven(0) == Some(true)
    }

    /// The lines of the log since the last call.
    fn lines(&mut self, elf: &[u8]) -> Vec<String> {
        let table = plant_sim::telemetry::format_table(elf, "firmware").expect("formats");
        let bytes = rtt::take(self.machine()).expect("a log block");
        let mut lines = Vec::new();
        let mut decoder = table.new_stream_decoder();
        decoder.received(&bytes);
        loop {
            match decoder.decode() {
                Ok(frame) => lines.push(frame.display_message().to_string()),
                Err(DecodeError::Malformed) => {}
                Err(DecodeError::UnexpectedEof) => return lines,
            }
        }
    }
}

/// A frame of some session.
fn frame(session: u32, sequence: u32, command: Command) -> Vec<u8> {
    let request = Request { version: PROTOCOL_VERSION, session, sequence, command };
    let mut buffer = [0; FRAME_BYTES];
    encode(&request, &mut buffer).expect("a request fits its frame").to_vec()
}

#[test]
fn triggers_that_stop_and_return_leave_no_loop_running_and_the_reason_is_latched() {
    let Some(elf) = elf() else { return };
    let armed = Bench::armed(elf);
    for ticks in (10..=24).step_by(2) {
        let mut bench = armed.copy();
        let reset = bench.lose_triggers(ticks);
        let reset = reset.or_else(|| {
            // Two checks of the supervisor without a sample, 5 ms apart, and up to 5 ms to the first of them.
            if ticks > 15 {
                assert!(!bench.air(), "air after {ticks} ms without triggers");
                assert_eq!(bench.machine().chip.dac.pin(), MID, "after {ticks} ms without triggers");
            }
            bench.run(0.1)
        });
        if let Some(cause) = reset {
            bench.reset(cause, Some(Reason::WatchdogReset));
            assert_eq!(bench.run(0.3), None);
        }
        bench.open_session();
        let state = bench.state();
        assert!(state.starts_with("safe:"), "after {ticks} ms without triggers the state is {state}");
        assert_eq!(bench.machine().chip.dac.pin(), MID);
    }
}

#[test]
fn three_lost_triggers_in_a_row_trip_and_two_are_bridged() {
    let Some(elf) = elf() else { return };
    let armed = Bench::armed(elf);
    for ticks in 1..10 {
        let mut bench = armed.copy();
        assert_eq!(bench.lose_triggers(ticks), None);
        assert_eq!(bench.run(2.5 * MILLISECOND), None);
        if ticks >= 3 {
            assert_eq!(bench.machine().chip.dac.pin(), MID, "after {ticks} lost triggers");
        }
        let state = bench.state();
        assert_eq!(state, if ticks < 3 { "run" } else { "safe:missed-tick" }, "after {ticks} lost triggers");
    }
}

#[test]
fn sixty_saves_in_a_row_succeed_and_each_is_what_the_next_start_finds() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    for save in 1..=60_u16 {
        bench.done(Command::Set(Parameter::TelemetryEvery, save.into()));
        assert_eq!(bench.answer_or_reset(Command::Save), Ok(Ok(Reply::Done)), "save {save}");
        let mut later = bench.copy();
        later.power_cycle();
        assert_eq!(later.run(0.05), None);
        later.open_session();
        assert_eq!(later.get(Parameter::TelemetryEvery), f32::from(save));
    }
    assert!(bench.machine().chip.flash.erased >= 3, "pages were erased on the way");
}

#[test]
fn a_supply_that_fails_at_any_operation_of_the_flash_leaves_the_old_set_or_the_new_one() {
    let Some(elf) = elf() else { return };
    let parameter = Parameter::TelemetryEvery;
    let mut bench = Bench::idle(elf);
    let mut seen = [0, 0];
    // No page is blank any more.
    for _ in 0..16 {
        bench.done(Command::Save);
    }
    for save in 1..=5_u16 {
        let (old, new) = (f32::from(save), f32::from(save + 1));
        bench.done(Command::Set(parameter, old));
        bench.done(Command::Save);
        bench.done(Command::Set(parameter, new));
        bench.send(Command::Save);
        let mut before = bench.machine().chip.flash.programmed + bench.machine().chip.flash.erased;
        let mut busy = false;
        for _ in 0..6_000 {
            assert_eq!(bench.run(20e-6), None, "save {save}");
            let flash = &bench.machine().chip.flash;
            let (done, now_busy) = (flash.programmed + flash.erased, flash.busy());
            // The first look at an operation under way.
            if now_busy && (!busy || done != before) {
                let mut cut = bench.copy();
                cut.power_cycle();
                assert_eq!(cut.run(0.05), None);
                cut.open_session();
                let found = cut.get(parameter);
                assert!(found == old || found == new, "save {save}, cut in operation {done}: {found}");
                seen[usize::from(found == new)] += 1;
            }
            (before, busy) = (done, now_busy);
        }
        for byte in bench.machine().chip.lpuart.take_sent() {
            let _ = bench.answers.push::<Response>(byte);
        }
    }
    println!("cut before the new set was complete {} times, behind it {} times", seen[0], seen[1]);
    assert!(seen[0] > 200, "{seen:?}");
}

#[test]
fn pages_full_of_rubbish_latch_a_reason_forbid_arming_and_the_first_save_works() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    for (n, byte) in bench.machine().chip.flash.bytes[PARAMETERS].iter_mut().enumerate() {
        *byte = ((n as u32).wrapping_mul(2_654_435_761) >> 24) as u8;
    }
    assert_eq!(bench.run(0.3), None);
    bench.open_session();
    assert_eq!(bench.state(), "safe:parameters-unreadable");
    assert_eq!(bench.answer_or_reset(Command::Arm), Ok(Err(Refusal::State)));
    assert_eq!(bench.answer_or_reset(Command::Save), Ok(Ok(Reply::Done)));
    bench.power_cycle();
    assert_eq!(bench.run(0.3), None);
    bench.open_session();
    assert_eq!(bench.state(), "idle");
}

#[test]
fn a_restart_by_command_is_never_taken_for_the_watchdogs() {
    let Some(elf) = elf() else { return };
    for n in 0..20 {
        let mut bench = Bench::boot(elf);
        bench.machine().chip.iwdg.oscillator = 1.05;
        assert_eq!(bench.run(0.15 + 0.000_25 * f64::from(n)), None);
        bench.open_session();
        let answered = bench.answer_or_reset(Command::Restart);
        assert_eq!(answered, Ok(Ok(Reply::Done)), "restart {n}");
        assert_eq!(bench.run(0.2), Some(ResetCause::Software), "restart {n}");
    }
}

#[test]
fn a_host_that_asks_faster_than_the_line_can_answer_does_not_stop_a_running_board() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    // A non-maskable interrupt out of nothing is a panic, and its long message is what `last-fault` answers.
    bench.machine().chip.system.raise_nmi();
    assert_eq!(bench.run(0.01), Some(ResetCause::Software));
    bench.reset(ResetCause::Software, Some(Reason::Panic));
    bench.machine().chip.iwdg.oscillator = 1.05;
    assert_eq!(bench.run(0.1), None);
    bench.open_session();
    assert_eq!(bench.state(), "safe:panic");
    bench.done(Command::Acknowledge);
    assert_eq!(bench.run(0.2), None);
    bench.done(Command::Arm);
    let repeated = frame(bench.session, bench.sequence, Command::LastFault);
    for _ in 0..50 {
        for _ in 0..6 {
            bench.machine().chip.send(&repeated);
            // One number after another: pipelined, then each of them again.
            bench.send(Command::LastFault);
        }
        assert_eq!(bench.run(0.01), None, "a reset in the midst of the questions");
    }
    assert_eq!(bench.host.mode().to_string(), "run");
    bench.agrees();
}

#[test]
fn two_wrong_bits_in_a_word_of_the_program_stop_it_with_the_valve_at_mid() {
    let Some(elf) = elf() else { return };
    let mut armed = Bench::armed(elf);
    // Every double word that one millisecond executes.
    let mut words = std::collections::BTreeSet::new();
    let mut tick = armed.copy();
    let end = tick.machine().chip.now + stm32_emulator::time::from_seconds(MILLISECOND);
    while tick.machine().chip.now < end {
        words.insert((tick.machine().core.pc - 0x0800_0000) as usize & !7);
        assert_eq!(tick.machine().step(end).expect("the run is modelled"), None);
    }
    let words: Vec<usize> = words.into_iter().collect();
    assert!(armed.machine().chip.now > 0 && words.len() > 400, "{} words", words.len());
    for (n, at) in words.iter().step_by(words.len() / 40).enumerate() {
        let mut bench = armed.copy();
        let flash = &mut bench.machine().chip.flash;
        flash.bytes[at + n % 8] ^= 0x11 << (n % 4);
        flash.damage(*at, Ecc::Detected);
        let before = bench.machine().chip.now;
        let reset = bench.run(0.1);
        let after = to_seconds(bench.machine().chip.now - before);
        assert!(reset.is_some(), "the word at {at:#x} is wrong and the board goes on");
        assert!(after < 0.03, "the word at {at:#x} is wrong and the reset comes after {after} s");
        if reset == Some(ResetCause::Software) {
            assert_eq!(bench.machine().chip.dac.pin(), MID, "the word at {at:#x}");
        }
    }
}

#[test]
fn a_wrong_word_among_the_parameters_is_no_fault_of_the_program() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    bench.done(Command::Set(Parameter::TelemetryEvery, 7.0));
    bench.done(Command::Save);
    let written = PARAMETERS.step_by(8).filter(|at| bench.machine().chip.flash.bytes[*at] != 0xFF).count();
    assert!(written > 20, "{written} double words");
    for at in PARAMETERS.step_by(8) {
        bench.machine().chip.flash.damage(at, Ecc::Detected);
    }
    bench.power_cycle();
    assert_eq!(bench.run(0.3), None);
    bench.open_session();
    assert!(["idle", "safe:parameters-unreadable"].contains(&bench.state().as_str()));
}

#[test]
fn a_save_that_the_flash_refuses_is_not_answered_with_done() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    bench.done(Command::Save);
    bench.done(Command::Set(Parameter::TelemetryEvery, 7.0));
    bench.machine().chip.flash.refusing = true;
    assert_eq!(bench.answer_or_reset(Command::Save), Ok(Err(Refusal::Storage)));
    bench.machine().chip.flash.refusing = false;
    assert_eq!(bench.answer_or_reset(Command::Save), Ok(Ok(Reply::Done)));
}

#[test]
fn with_a_single_bank_nothing_is_erased_and_the_parameters_count_as_unreadable() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    bench.machine().chip.flash.optr &= !(1 << 22);
    assert_eq!(bench.run(0.3), None);
    bench.open_session();
    assert_eq!(bench.state(), "safe:parameters-unreadable");
    assert_eq!(bench.answer_or_reset(Command::Save), Ok(Err(Refusal::Storage)));
    let flash = &bench.machine().chip.flash;
    assert_eq!((flash.erased, flash.programmed), (0, 0));
    // Somebody changes the option bytes behind the firmware's back.
    let mut bench = Bench::idle(elf);
    bench.machine().chip.flash.optr &= !(1 << 22);
    assert_eq!(bench.answer_or_reset(Command::Save), Ok(Err(Refusal::Storage)));
    let flash = &bench.machine().chip.flash;
    assert_eq!((flash.erased, flash.programmed), (0, 0));
}

#[test]
fn the_log_is_in_the_new_units_as_soon_as_a_range_is_set() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    let scales = |lines: &[String]| lines.iter().rev().find(|line| line.starts_with("scales ")).cloned();
    let before = scales(&bench.lines(elf)).expect("scales at the start");
    assert!(before.contains("hz=1000 ") && !before.contains("y1=0.75"), "{before}");
    bench.done(Command::Set(Parameter::PositionHigh, 0.75));
    // The rate is the timer's until the next start.
    bench.done(Command::Set(Parameter::TickHz, 2_000.0));
    assert_eq!(bench.run(0.01), None);
    let after = scales(&bench.lines(elf)).expect("scales behind the change");
    assert!(after.contains("hz=1000 ") && after.contains("y1=0.75"), "{after}");
}

#[test]
fn frames_that_are_refused_replayed_or_foreign_do_not_count_as_the_host() {
    let Some(elf) = elf() else { return };
    let mut silent = Bench::idle(elf);
    silent.done(Command::Set(Parameter::CommandTimeOut, 0.1));
    assert_eq!(silent.run(0.2), None);
    silent.done(Command::Arm);
    let (session, sequence) = (silent.session, silent.sequence);
    let frames = [
        ("refused", None),
        ("replayed", Some(frame(session, sequence - 1, Command::Arm))),
        ("foreign", Some(frame(session ^ 1, sequence, Command::Status))),
    ];
    for (kind, bytes) in frames {
        let mut bench = silent.copy();
        for _ in 0..15 {
            match &bytes {
                Some(bytes) => bench.machine().chip.send(bytes),
                // Running already.
                None => bench.send(Command::Arm),
            }
            assert_eq!(bench.run(0.02), None);
        }
        let _ = bench.machine().chip.lpuart.take_sent();
        assert_eq!(bench.state(), "safe:command-time-out", "{kind} frames");
    }
    for _ in 0..15 {
        silent.send(Command::Status);
        assert_eq!(silent.run(0.02), None);
    }
    let _ = silent.machine().chip.lpuart.take_sent();
    assert_eq!(silent.state(), "run");
}

#[test]
fn the_first_conversion_is_the_timers() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    let mut entered = Vec::new();
    while entered.len() < 4 {
        let machine = bench.machine();
        let inside = machine.chip.system.current() == CONTROL_INTERRUPT;
        let end = machine.chip.now + 1_000_000;
        assert_eq!(machine.step(end).expect("the run is modelled"), None);
        if !inside && machine.chip.system.current() == CONTROL_INTERRUPT {
            entered.push(to_seconds(machine.chip.now));
        }
    }
    for pair in entered.windows(2) {
        assert!((pair[1] - pair[0] - MILLISECOND).abs() < 2e-6, "ticks at {entered:?}");
    }
}

#[test]
fn clocks_or_a_converter_that_never_become_ready_end_in_a_reset_by_the_watchdog() {
    let Some(elf) = elf() else { return };
    for pll in [true, false] {
        let mut bench = Bench::boot(elf);
        if pll {
            bench.machine().chip.rcc.pll_stuck = true;
        } else {
            bench.machine().chip.adc1.ready_stuck = true;
        }
        assert_eq!(bench.run(0.1), Some(ResetCause::Watchdog));
        assert_eq!(bench.machine().chip.dac.pin(), MID);
        assert!(!bench.air());
    }
}

#[test]
fn bench_mode_at_ten_thousand_ticks_a_second_is_never_late() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    bench.done(Command::Set(Parameter::TickHz, 10_000.0));
    bench.done(Command::Save);
    bench.power_cycle();
    assert_eq!(bench.run(0.2), None);
    bench.open_session();
    bench.done(Command::Bench { on: true });
    assert_eq!(bench.run(0.2), None);
    bench.done(Command::Arm);
    bench.done(Command::Generate(Generator::Hold { position_um: 50_000 }));
    assert_eq!(bench.run(0.3), None);
    bench.agrees();
    let Ok(Reply::Status(status)) = bench.ask(Command::Status).result else { panic!("no status") };
    assert_eq!((status.state.as_str(), status.overruns, status.late_ticks), ("run", 0, 0));
}

#[test]
fn lost_ticks_late_codes_and_overwritten_samples_are_counted_apart() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::armed(elf);
    let counters = |bench: &mut Bench| match bench.ask(Command::Status).result {
        Ok(Reply::Status(status)) => [status.missed_ticks, status.late_ticks, status.overruns],
        other => panic!("status answered {other:?}"),
    };
    assert_eq!(counters(&mut bench), [0, 0, 0]);
    assert_eq!(bench.lose_triggers(2), None);
    assert_eq!(counters(&mut bench), [2, 0, 0]);
    // The interrupt waits until 10 us before the update that follows its own, then until 10 us behind it.
    for (wait_s, expected) in [(0.99 * MILLISECOND, [2, 1, 0]), (1.01 * MILLISECOND, [2, 1, 1])] {
        let begun = |bench: &mut Bench| {
            let now = bench.machine().chip.now;
            bench.machine().chip.tim6.count(now) < 200
        };
        while !begun(&mut bench) {
            assert_eq!(bench.run(1e-6), None);
        }
        bench.machine().core.primask = true;
        assert_eq!(bench.run(wait_s), None);
        bench.machine().core.primask = false;
        bench.machine().chip.system.attention = true;
        assert_eq!(bench.run(5.0 * MILLISECOND), None);
        assert_eq!(counters(&mut bench), expected);
    }
}

#[test]
fn an_output_stuck_at_a_code_takes_the_air_within_four_ticks_of_the_first_wrong_code() {
    let Some(elf) = elf() else { return };
    let mut moving = Bench::armed(elf);
    let shape = Shape::Sine;
    moving.done(Command::Generate(Generator::Repeat { shape, centre_um: 0, amplitude_um: 200_000, period_ms: 1_000 }));
    assert_eq!(moving.run(0.6), None);
    let mut worst = (0_u32, 0.0_f64);
    for instant in 0..10 {
        assert_eq!(moving.run(0.1), None);
        let code = moving.machine().chip.dac.holding();
        for stuck in [code, 0, 4095, 2048] {
            let mut bench = moving.copy();
            bench.machine().chip.dac.stuck_at = Some(stuck);
            let mut wrong = None;
            let mut ticks = 0;
            while bench.air() {
                // What the timer latches next.
                let written = bench.machine().chip.dac.holding();
                if wrong.is_none() && written.abs_diff(stuck) > output_tolerance(written) {
                    wrong = Some((ticks, bench.machine().chip.analog.position_m()));
                }
                assert_eq!(bench.run(MILLISECOND), None);
                ticks += 1;
                assert!(ticks < 2_000, "stuck at {stuck}, instant {instant}: nobody noticed");
            }
            let to_m = bench.machine().chip.analog.position_m();
            let state = bench.state();
            let (since, from_m) =
                wrong.unwrap_or_else(|| panic!("{state}: stuck at {stuck}, which is right, instant {instant}"));
            let moved_m = (to_m - from_m).abs();
            worst = (worst.0.max(ticks - since), worst.1.max(moved_m));
            assert_eq!(state, "safe:valve-output", "stuck at {stuck}, instant {instant}");
        }
    }
    println!("air off at most {} ticks after the first wrong code, {:.1} mm further on", worst.0, 1e3 * worst.1);
    assert!(worst.0 <= 4, "{worst:?}");
    assert!(worst.1 < 0.005, "{worst:?}");
}

#[test]
fn an_output_stuck_while_idle_takes_the_air_and_cannot_be_acknowledged_away() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    assert!(bench.air());
    bench.machine().chip.dac.stuck_at = Some(4095);
    assert_eq!(bench.run(5.0 * MILLISECOND), None);
    assert!(!bench.air());
    assert_eq!(bench.state(), "safe:valve-output");
    assert_eq!(bench.ask(Command::Acknowledge).result, Err(Refusal::State));
    bench.machine().chip.dac.stuck_at = None;
    bench.done(Command::Acknowledge);
    assert_eq!(bench.run(0.3), None);
    assert_eq!(bench.state(), "idle");
}
