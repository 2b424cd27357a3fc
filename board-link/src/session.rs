//! Who may change something: sessions and sequence numbers, on the board's side.
//!
//! | request | admitted as |
//! | --- | --- |
//! | other protocol version | refused |
//! | `Hello` | opens a new session; nothing else changes |
//! | unknown session | refused |
//! | same number as the last | repeated: the last answer again, nothing done |
//! | smaller number | refused |
//! | larger number | new: carry it out |
//!
//! So a lost answer can be asked for again without stepping twice, and a recorded frame sent later does nothing.

use crate::message::{Command, PROTOCOL_VERSION, Refusal, Reply, Request, Response};

/// What to do with a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Admission {
    /// Send this; do nothing.
    Answer(Response),
    /// Carry the command out, then call [`Session::answered`] and send what it returns.
    Execute(Command),
}

/// The board's memory of the conversation.
#[derive(Clone, Debug, Default)]
pub struct Session {
    session: Option<u32>,
    last: Option<(u32, Response)>,
    executing: u32,
    hellos: u32,
}

impl Session {
    /// Nobody has said hello.
    #[must_use]
    pub const fn new() -> Self {
        Self { session: None, last: None, executing: 0, hellos: 0 }
    }

    /// Judges a request. `clock` is any quickly changing counter; it makes session numbers of different runs differ.
    pub fn admit(&mut self, request: &Request, clock: u32) -> Admission {
        let answer = |session, result| {
            Admission::Answer(Response { version: PROTOCOL_VERSION, session, sequence: request.sequence, result })
        };
        if request.version != PROTOCOL_VERSION {
            return answer(0, Err(Refusal::Version));
        }
        if let Command::Hello { nonce } = request.command {
            self.hellos = self.hellos.wrapping_add(1);
            // Weyl sequences with odd increments: distinct hellos give distinct sessions, clock and nonce scatter runs.
            let session =
                clock.wrapping_mul(0x9E37_79B1) ^ nonce.rotate_left(16) ^ self.hellos.wrapping_mul(0x85EB_CA77);
            self.session = Some(session);
            self.last = None;
            return answer(session, Ok(Reply::Done));
        }
        if self.session != Some(request.session) {
            return answer(request.session, Err(Refusal::Session));
        }
        match &self.last {
            Some((number, response)) if *number == request.sequence => return Admission::Answer(response.clone()),
            Some((number, _)) if *number > request.sequence => return answer(request.session, Err(Refusal::Replayed)),
            _ => {}
        }
        self.executing = request.sequence;
        Admission::Execute(request.command)
    }

    /// Records the outcome of the command last admitted, and returns the answer to send.
    pub fn answered(&mut self, result: Result<Reply, Refusal>) -> Response {
        let response = Response {
            version: PROTOCOL_VERSION,
            session: self.session.unwrap_or(0),
            sequence: self.executing,
            result,
        };
        self.last = Some((self.executing, response.clone()));
        response
    }
}
