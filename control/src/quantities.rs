//! Physical quantities in fixed point.
//!
//! | quantity | type | unit | range | resolution |
//! | --- | --- | --- | --- | --- |
//! | position, reference | [`Position`] = I4F28 | m | −8 … 8 | 3.7 nm |
//! | pressure | [`Pressure`] = I24F8 | Pa, absolute | −8.4 … 8.4 MPa | 0.004 Pa |
//! | valve voltage `u`, `w` | [`Voltage`] = I8F24 | V about mid position | −128 … 128 | 60 nV |
//! | velocity of the reference | [`Velocity`] = I8F24 | m/s | −128 … 128 | 60 nm/s |
//!
//! A 16-bit code of a 1 m sensor is 15 µm, of a 10 bar sensor 15 Pa, and a 12-bit code of a ±5 V output 2.4 mV: the
//! formats resolve the finest code by a factor of 1,000 or more and leave headroom for every rig that the parameter
//! checks let through.

/// A position in metres, from mid-stroke, positive towards chamber B.
pub type Position = fixed::types::I4F28;
/// An absolute pressure in pascals.
pub type Pressure = fixed::types::I24F8;
/// A valve command in volts about the mid position.
pub type Voltage = fixed::types::I8F24;
/// A velocity in metres per second.
pub type Velocity = fixed::types::I8F24;
