//! Simulated time.

/// Simulated time since power-up in units of 1/1.36 GHz: 8 units are a cycle at 170 MHz, 85 one at 16 MHz, 42 500 one of the
/// 32 kHz oscillator, all exactly. 64 bits last 430 years.
pub type Time = u64;

/// Units per second.
pub const UNITS_PER_SECOND: u64 = 1_360_000_000;

/// No event is due.
pub const NEVER: Time = u64::MAX;

/// Seconds to units, rounded.
#[must_use]
pub fn from_seconds(seconds: f64) -> Time {
    (seconds * UNITS_PER_SECOND as f64).round() as Time
}

/// Units to seconds.
#[must_use]
pub fn to_seconds(time: Time) -> f64 {
    time as f64 / UNITS_PER_SECOND as f64
}
