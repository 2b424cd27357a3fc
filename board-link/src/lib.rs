//! What board and desktop say to each other over the virtual COM port.
//!
//! The desktop asks, the board answers; nothing is ever sent unasked. One request travels as one frame:
//!
//! ```text
//!   0x00 │ COBS( postcard(Request) │ CRC-32, little-endian ) │ 0x00
//! ```
//!
//! The leading zero ends whatever half a frame a broken connection left behind, so it costs one frame at most, never
//! two. A frame that is malformed, too long, corrupt, of another protocol version, out of session or not newer than
//! the last one **changes nothing**: [`Accumulator`] and [`Session`] settle that before any command is looked at.
//!
//! | idea | file |
//! | --- | --- |
//! | bytes to frames and back | `frame.rs` |
//! | requests, commands, answers | `message.rs` |
//! | sessions, sequence numbers, repeated requests | `session.rs` |
//! | what a firmware image says of itself | `identity.rs` |
//! | setpoint generators and their limits | `generator.rs` |
//! | named parameters with unit, range and default | `parameter.rs` |
#![no_std]
#![forbid(unsafe_code)]

mod frame;
mod generator;
pub mod identity;
mod message;
mod parameter;
mod session;

pub use frame::{Accumulator, EncodeError, FRAME_BYTES, FrameError, encode};
pub use generator::{Generator, GeneratorError, LONGEST_MS, POSITION_LIMIT_UM, SHORTEST_MS, Shape};
pub use message::{
    Command, KeptError, LearnedValues, PROTOCOL_VERSION, Refusal, Reply, Request, Response, SAMPLES, Sample, Samples,
    StateWord, Status, TextWord, Version,
};
pub use parameter::{Parameter, ParameterError, ParameterInfo, Source, own};
pub use session::{Admission, Session};
