//! The desktop's side of the virtual COM port: asks, waits, asks again.

use board_link::{
    Accumulator, Command, FRAME_BYTES, GeneratorError, PROTOCOL_VERSION, Refusal, Reply, Request, Response, encode,
};
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// How long to wait for an answer before asking again: an order takes the board 10 ms at most, saving to flash 60 ms.
const WAIT: Duration = Duration::from_millis(300);
/// How often to ask.
const ATTEMPTS: u32 = 4;

/// Why there is no good answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BoardError {
    /// The line broke.
    Line(String),
    /// Nothing came back.
    Silent,
    /// The board turned the request down.
    Refused(Refusal),
    /// The board speaks another version of the protocol.
    Version {
        /// The board's.
        board: u8,
    },
    /// An answer that does not belong to the question.
    Unexpected,
}

impl std::fmt::Display for BoardError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Line(error) => write!(f, "the serial port failed: {error}; check the cable and the port's name"),
            Self::Silent => write!(
                f,
                "the board does not answer; check that this firmware is flashed, that --port is the ST-LINK's virtual COM \
                 port, and that no other program has it open"
            ),
            Self::Version { board } => write!(
                f,
                "the board speaks protocol version {board}, this program {PROTOCOL_VERSION}; flash the firmware of this \
                 version (cargo flash-g4)"
            ),
            Self::Unexpected => {
                write!(f, "the board's answer does not fit the question; is another program talking to it?")
            }
            Self::Refused(refusal) => f.write_str(match refusal {
                Refusal::Version => "refused: another protocol version",
                Refusal::Session => "refused: another program has opened a session since; try again",
                Refusal::Replayed => "refused: an old request",
                Refusal::State => {
                    "refused in this state; `plant-sim board … status` shows it (safe: acknowledge first; \
                                   run: disarm first)"
                }
                Refusal::Parameter(_) => {
                    "refused: the value is out of range; `plant-sim board parameters` lists the ranges"
                }
                Refusal::Generator(GeneratorError::Position) => {
                    let farthest = control::Key::position_range_m.row().limits.high;
                    return write!(f, "refused: a position beyond ±{farthest} m");
                }
                Refusal::Generator(GeneratorError::Time) => "refused: a period outside 0.01 … 3600 s",
                Refusal::Generator(GeneratorError::Amplitude) => "refused: a negative amplitude",
                Refusal::Configuration(Some(key)) => {
                    let name = key.name();
                    return write!(
                        f,
                        "refused: the parameters would not fit together; `{name}` stands in the way (`get {name}` shows its \
                         value), change both at once"
                    );
                }
                Refusal::Configuration(None) => "refused: the parameters would not fit together",
                Refusal::NotBegun => "refused: the change was interrupted; nothing of it took effect, begin anew",
                Refusal::NothingLearned => {
                    "refused: nothing is learned; the paper's law learns nothing, and the positioning law begins when it first runs"
                }
                Refusal::Storage => "flash could not be written; what was saved before is still there",
                Refusal::Busy => "the control loop did not take the order; is it running? (`status`, ticks)",
            }),
        }
    }
}

/// An open conversation.
pub struct Client<P> {
    port: P,
    wait: Duration,
    session: u32,
    sequence: u32,
}

impl<P: Read + Write> Client<P> {
    /// Opens a session on a port whose reads time out within 50 ms or so.
    ///
    /// # Errors
    /// No answer, or one of another protocol version.
    pub fn open(port: P, nonce: u32) -> Result<Self, BoardError> {
        Self::open_waiting(port, nonce, WAIT)
    }

    /// The same, waiting for each answer as long as given before asking again: a simulated line is faster than a cable.
    ///
    /// # Errors
    /// No answer, or one of another protocol version.
    pub fn open_waiting(port: P, nonce: u32, wait: Duration) -> Result<Self, BoardError> {
        let mut client = Self { port, wait, session: 0, sequence: 0 };
        let answer = client.exchange(Command::Hello { nonce })?;
        client.session = answer.session;
        match answer.result {
            Ok(_) => Ok(client),
            Err(Refusal::Version) => Err(BoardError::Version { board: answer.version }),
            Err(refusal) => Err(BoardError::Refused(refusal)),
        }
    }

    /// Asks for something. A lost answer is asked for again, under the same number, so that nothing is done twice.
    ///
    /// # Errors
    /// No answer, or a refusal.
    pub fn ask(&mut self, command: Command) -> Result<Reply, BoardError> {
        self.sequence += 1;
        let answer = self.exchange(command)?;
        answer.result.map_err(BoardError::Refused)
    }

    /// Asks, and does not wait for the answer: it is passed over when it comes.
    ///
    /// # Errors
    /// The line broke.
    pub fn post(&mut self, command: Command) -> Result<(), BoardError> {
        self.sequence += 1;
        self.send(command)
    }

    fn send(&mut self, command: Command) -> Result<(), BoardError> {
        let request = Request { version: PROTOCOL_VERSION, session: self.session, sequence: self.sequence, command };
        let mut buffer = [0; FRAME_BYTES];
        let frame = encode(&request, &mut buffer).map_err(|_| BoardError::Unexpected)?;
        self.port.write_all(frame).and_then(|()| self.port.flush()).map_err(|e| BoardError::Line(e.to_string()))
    }

    fn exchange(&mut self, command: Command) -> Result<Response, BoardError> {
        for _ in 0..ATTEMPTS {
            self.send(command)?;
            if let Some(response) = self.listen()? {
                return Ok(response);
            }
        }
        Err(BoardError::Silent)
    }

    /// The answer to the present number, if it comes in time; older ones and damaged frames are passed over.
    fn listen(&mut self) -> Result<Option<Response>, BoardError> {
        let mut accumulator = Accumulator::new();
        let begin = Instant::now();
        while begin.elapsed() < self.wait {
            let mut bytes = [0; 256];
            let count = match self.port.read(&mut bytes) {
                Ok(count) => count,
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => 0,
                Err(e) => return Err(BoardError::Line(e.to_string())),
            };
            for byte in bytes.get(..count).unwrap_or_default() {
                if let Some(Ok(response)) = accumulator.push::<Response>(*byte)
                    && response.sequence == self.sequence
                {
                    return Ok(Some(response));
                }
            }
        }
        Ok(None)
    }
}
