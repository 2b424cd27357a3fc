#![no_main]
//! Any conversation with the board: bytes → frames → sessions → desk → control loop. No panic; what is not accepted changes
//! nothing; every accepted set of parameters fits together; no valve code out of range, and only run moves the valve.
//!
//! Frames carry a check value that a fuzzer does not guess, so most requests are framed here; some are damaged on the way,
//! and some bytes go in as they are.
use board_link::{Accumulator, Admission, Command, FRAME_BYTES, PROTOCOL_VERSION, Request, Response, Session, encode};
use control::{ExternalFaults, Mode};
use firmware_core::{Action, ControlLoop, Desk, Settings, Snapshot};
use libfuzzer_sys::fuzz_target;

struct Board {
    accumulator: Accumulator,
    session: Session,
    desk: Desk,
    control_loop: ControlLoop,
    snapshot: Snapshot,
    codes: [u16; 4],
}

impl Board {
    fn new() -> Self {
        let settings = Settings::default();
        let setup = settings.setup().expect("defaults fit together");
        Self {
            accumulator: Accumulator::new(),
            session: Session::new(),
            control_loop: ControlLoop::new(setup, None),
            desk: Desk::new(settings, "fuzz", "0.0.0", "".try_into().expect("empty")),
            snapshot: Snapshot::new(),
            codes: [32_767, 23_710, 23_712, 45_870],
        }
    }

    fn run(&mut self, ticks: u32) {
        for _ in 0..ticks {
            let tick = self.control_loop.tick(self.codes, ExternalFaults::default(), true);
            self.control_loop.conclude();
            assert!(tick.valve <= 4095);
            let moves = self.control_loop.mode() == Mode::Run && !self.control_loop.bench();
            assert!(moves || tick.valve == self.control_loop.safe_code());
            self.snapshot.publish(&tick.record, &self.control_loop);
            // A little noise, as a converter has it.
            self.codes[0] ^= 1;
        }
    }

    /// One byte of the line; the answer, if a request was complete.
    fn hear(&mut self, byte: u8) -> Option<Response> {
        let request = self.accumulator.push::<Request>(byte)?.ok()?;
        let (before, mode) = (self.desk.settings().clone(), self.control_loop.mode());
        let answer = match self.session.admit(&request, 1) {
            Admission::Answer(answer) => answer,
            Admission::Execute(command) => {
                let decision = self.desk.decide(command, &self.snapshot, 0);
                if decision.is_err() {
                    assert_eq!(self.desk.settings(), &before);
                }
                assert!(self.desk.settings().check().is_ok());
                let reply = match decision {
                    Err(refusal) => Err(refusal),
                    Ok(Action::Reply(reply)) => Ok(reply),
                    Ok(Action::Save | Action::Restart | Action::Bootloader | Action::Samples) => Ok(board_link::Reply::Done),
                    Ok(Action::Keep(kept)) => {
                        self.desk.keep(kept);
                        Ok(board_link::Reply::Done)
                    }
                    Ok(Action::Order(order, _)) => {
                        assert!(!(mode == Mode::Run && matches!(command, Command::Set(..) | Command::Bench { .. })));
                        self.control_loop.order(&order);
                        Ok(board_link::Reply::Done)
                    }
                };
                self.session.answered(reply)
            }
        };
        assert!(encode(&answer, &mut [0; FRAME_BYTES]).is_ok());
        self.run(2);
        Some(answer)
    }
}

fuzz_target!(|bytes: &[u8]| {
    let mut board = Board::new();
    board.run(150);
    let mut request = Request { version: PROTOCOL_VERSION, session: 0, sequence: 0, command: Command::Hello { nonce: 1 } };
    let mut rest = bytes;
    while let Some((kind, more)) = rest.split_first() {
        let (chunk, after) = more.split_at(more.len().min(usize::from(kind & 31)));
        rest = after;
        if kind >> 5 == 0 {
            // As they are; the frame they began ends here.
            for byte in chunk.iter().chain(&[0]) {
                board.hear(*byte);
            }
            continue;
        }
        if let Ok(command) = postcard::from_bytes(chunk) {
            (request.sequence, request.command) = (request.sequence.wrapping_add(1), command);
        }
        // Otherwise the last one again, under its old number.
        let mut buffer = [0; FRAME_BYTES];
        let frame = encode(&request, &mut buffer).expect("fits").to_vec();
        let damaged = kind >> 5 == 1;
        for (place, byte) in frame.into_iter().enumerate() {
            let flip = u8::from(damaged && place == chunk.len() % 8 + 1) * 0x55;
            if let Some(answer) = board.hear(byte ^ flip) {
                assert!(!damaged);
                if matches!(request.command, Command::Hello { .. }) {
                    request.session = answer.session;
                }
            }
        }
        board.run(1);
    }
});
