//! Requests and answers.

use control::Quantities;
use heapless::String;
use serde::{Deserialize, Serialize};

use crate::generator::{Generator, GeneratorError};
use crate::parameter::{Parameter, ParameterError};

/// Version of this protocol: raised whenever a message changes its meaning or layout. Both sides must agree.
pub const PROTOCOL_VERSION: u8 = 9;

/// One request of the desktop. The version stands first and is one byte, so that any version can read it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Request {
    /// [`PROTOCOL_VERSION`] of the sender.
    pub version: u8,
    /// The session the board gave in answer to [`Command::Hello`]; ignored for `Hello` itself.
    pub session: u32,
    /// Rises with every new request of a session. A request sent again (because its answer was lost) keeps its number.
    pub sequence: u32,
    /// What to do.
    pub command: Command,
}

/// What the board can be asked to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Opens a session. `nonce` is any number; it is mixed into the session's.
    Hello {
        /// Any number.
        nonce: u32,
    },
    /// Firmware and protocol version.
    Version,
    /// State, readings and counters.
    Status,
    /// Idle → running, holding the present position. Refused in any other state.
    Arm,
    /// Running → idle, valve to mid.
    Disarm,
    /// Safe → self-test → idle; acknowledges the reason. Falls back to safe while the reason persists.
    Acknowledge,
    /// What drives the setpoint.
    Generate(Generator),
    /// Reads one parameter.
    Get(Parameter),
    /// Changes one parameter until the next reset. Not while running.
    Set(Parameter, f32),
    /// Begins a change of several parameters at once: from those in force, [`Command::Stage`] by stage. Not while running.
    Begin,
    /// Notes one parameter of the change; nothing takes effect yet, and only its own range is checked.
    Stage(Parameter, f32),
    /// Puts all that was noted in force at once until the next reset, or nothing of it. Not while running.
    Apply,
    /// Writes all parameters to flash. Not while running.
    Save,
    /// Back to the defaults, until the next reset unless saved. Not while running.
    Defaults,
    /// Bench mode: the on-board model replaces sensors and valve, and the valve output stays at mid. Not while running.
    Bench {
        /// On or off.
        on: bool,
    },
    /// The message of the last panic or fault, if there was one.
    LastFault,
    /// The oldest records that have not been asked for yet, one in `telemetry_every` ticks; the board keeps some.
    Samples,
    /// What the positioning law has learned.
    Learned,
    /// Writes what was learned to flash, with all parameters: the law begins with it at every start. Only while idle, and not in
    /// bench mode.
    Keep,
    /// Forgets what was kept, and writes all parameters to flash. Not while running.
    Forget,
    /// Restarts the board. Not while running.
    Restart,
    /// Restarts into the bootloader in the chip's ROM, which takes new firmware over the same serial line and goes on waiting for
    /// it until the next reset. Not while running.
    Bootloader,
}

/// The board's answer to one request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Response {
    /// [`PROTOCOL_VERSION`] of the board.
    pub version: u8,
    /// Session of the request, or the new one for `Hello`.
    pub session: u32,
    /// Number of the request answered.
    pub sequence: u32,
    /// What came of it.
    pub result: Result<Reply, Refusal>,
}

/// `boot`, `idle`, `run`, `safe:supply-low` … as in the telemetry and `plant-sim controller`.
pub type StateWord = String<40>;
/// A panic message, as much of it as was kept.
pub type TextWord = String<160>;

/// A request granted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Reply {
    /// Done, nothing to tell.
    Done,
    /// To `Version`.
    Version(Version),
    /// To `Status`.
    Status(Status),
    /// To `Get`.
    Value(f32),
    /// To `LastFault`: empty if there was none.
    Text(TextWord),
    /// To `Samples`: empty if there is none yet.
    Samples(Samples),
    /// To `Learned`.
    Learned(LearnedValues),
}

/// What the positioning law has learned; each in its own unit, in the order of [`control::Quantity::ALL`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LearnedValues {
    /// Now: before the first run, what it will begin with.
    pub now: Quantities,
    /// As the parameters say. The limits are parts of it: [`control::Quantity::limits`].
    pub nominal: Quantities,
    /// What flash holds, if anything was kept.
    pub kept: Option<Quantities>,
    /// Why that is not begun with.
    pub refused: Option<KeptError>,
}

/// Why kept values are not begun with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum KeptError {
    /// They were learned with other parameters of the rig.
    OtherParameters,
    /// The quantity of this number is beyond the limits of learning.
    Limits(u8),
}

impl KeptError {
    /// The reason as a sentence's end, and the remedy.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::OtherParameters => {
                "they were learned with other parameters of the rig; `board keep` replaces them, `board forget` drops them"
            }
            Self::Limits(_) => {
                "one is beyond the limits of learning; `board keep` replaces them, `board forget` drops them"
            }
        }
    }
}

/// Most records of one answer: what fits a frame.
pub const SAMPLES: usize = 10;
/// Records, the oldest first.
pub type Samples = heapless::Vec<Sample, SAMPLES>;

/// What one tick read and what the valve then had.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sample {
    /// Number of the tick since start; wraps.
    pub tick: u32,
    /// Position, p_a, p_b, p_sup as the control law received them, 0..=65 535.
    pub codes: [u16; 4],
    /// What the valve holds from this sample to the next, 0..=4095.
    pub held: u16,
    /// The mode as telemetry numbers it.
    pub mode: u16,
}

/// Who is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Version {
    /// Package version, `major.minor.patch`.
    pub firmware: String<16>,
    /// Board, as in `nucleo-g474re`.
    pub board: String<24>,
    /// Ticks per second.
    pub tick_hz: u32,
    /// Layout of the parameters in its flash.
    pub parameters: u8,
}

/// How the loop is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// State, with the reason after a colon.
    pub state: StateWord,
    /// Ticks since start.
    pub ticks: u32,
    /// Position, p_a, p_b, p_sup as the control law received them, 0..=65 535.
    pub codes: [u16; 4],
    /// Valve code, 0..=4095.
    pub dac_code: u16,
    /// Setpoint in force, micrometres from mid-stroke.
    pub setpoint_um: i32,
    /// Telemetry records lost because the queue was full.
    pub telemetry_lost: u32,
    /// Ticks whose samples may be mixed with those of the next, as `safe:overrun` means it.
    pub overruns: u32,
    /// Ticks whose valve code came too late, as `safe:late-tick` means it.
    pub late_ticks: u32,
    /// Ticks that did not happen, as `safe:missed-tick` means it.
    pub missed_ticks: u32,
    /// Ticks in which the model monitor saw a contradiction, since start.
    pub disagreements: u32,
    /// Frames thrown away.
    pub bad_frames: u32,
    /// Most core clock cycles from the end of sampling to the valve code, since start.
    pub worst_cycles: u32,
    /// The simulated plant stands in for the real one.
    pub bench: bool,
}

/// A request turned down; it changed nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The board speaks another protocol version; it is in [`Response::version`].
    Version,
    /// No such session: the board has restarted, or another program has said hello.
    Session,
    /// Sequence number older than the last.
    Replayed,
    /// Not in this state.
    State,
    /// A parameter out of range.
    Parameter(ParameterError),
    /// A generator out of range.
    Generator(GeneratorError),
    /// The parameters do not fit together; none was changed. The one that stands in the way, if the board has it.
    Configuration(Option<Parameter>),
    /// Nothing was begun, or the board has restarted or taken another parameter since.
    NotBegun,
    /// Nothing is learned: the paper's law learns nothing, and the positioning law has not run since the start.
    NothingLearned,
    /// Flash could not be written; what was stored before is still there.
    Storage,
    /// The control loop did not take the command within a tick or two.
    Busy,
}
