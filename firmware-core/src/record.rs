//! What one tick leaves for telemetry: codes, not quantities, so that nothing is lost and little is sent.

use control::{Mode, Position, Reason};

/// One tick, as it goes through the queue from the interrupt to the telemetry task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// Number of the tick since start; wraps. Time is this over the tick rate.
    pub tick: u32,
    /// Number of the record; wraps. A gap means that records were lost.
    pub sequence: u32,
    /// Position, p_a, p_b, p_sup, 0..=65 535.
    pub codes: [u16; 4],
    /// What the control law wants of the valve, 0..=4095; takes effect one tick later.
    pub dac: u16,
    /// What the valve holds from this sample to the next: the code of the tick before.
    pub held: u16,
    /// Setpoint after the limiter, m · 2^28.
    pub reference_bits: i32,
    /// See [`mode_number`]; with [`STOPPING`] added in a controlled stop.
    pub mode: u16,
    /// The model monitor saw a contradiction in the tick before. While it only warns, this is all that comes of it.
    pub disagreement: bool,
    /// The mode differs from the record before, or a contradiction has begun: sent whatever the decimation.
    pub event: bool,
    /// Core clock cycles from interrupt entry to: samples read, control done, valve written.
    pub stamps: [u16; 3],
}

/// Added to the number of the safe state while a controlled stop is under way: the reason is latched, the valve still moves.
pub const STOPPING: u16 = 512;

/// A mode as a number: 0 boot, 1 self-test, 2 idle, 3 run, 256 + reason for safe.
#[must_use]
pub fn mode_number(mode: Mode) -> u16 {
    match mode {
        Mode::Boot => 0,
        Mode::SelfTest { .. } => 1,
        Mode::Idle => 2,
        Mode::Run => 3,
        Mode::Safe(reason) => 256 + u16::from(reason.code()),
    }
}

/// The mode of a number, [`STOPPING`] or not; `None` if there is none. How long a self-test still takes is not told.
#[must_use]
pub fn mode_from_number(number: u16) -> Option<Mode> {
    match number {
        0 => Some(Mode::Boot),
        1 => Some(Mode::SelfTest { ticks_left: 0 }),
        2 => Some(Mode::Idle),
        3 => Some(Mode::Run),
        _ => Reason::from_code(u8::try_from((number & !STOPPING).checked_sub(256)?).ok()?).map(Mode::Safe),
    }
}

/// Micrometres of a position in 2^-28 m, to the nearest, without a 64-bit division.
#[must_use]
pub(crate) fn micrometres(position: Position) -> i32 {
    // 10^6 / 2^28 = 15625 / 2^22
    ((i64::from(position.to_bits()) * 15_625 + (1 << 21)) >> 22) as i32
}
