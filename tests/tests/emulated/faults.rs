//! Faults below the software: lost triggers, flash that fails, words that rot, a supply that goes. Each ends in a named state.

use board_link::{Command, FRAME_BYTES, PROTOCOL_VERSION, Parameter, Refusal, Reply, Request, Response, encode};
use defmt_decoder::DecodeError;
use stm32_emulator::peripherals::flash::Ecc;
use stm32_emulator::peripherals::rcc::ResetCause;
use stm32_emulator::rtt;
use stm32_emulator::time::to_seconds;

use control::Reason;

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
    fn air(&mut self) -> bool {
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
