//! Physical quantities in fixed point, and the way from converter codes to them.
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

use crate::arithmetic::saturate;
use crate::codes::AdcCode;

/// A position in metres, from mid-stroke, positive towards chamber B.
pub type Position = fixed::types::I4F28;
/// An absolute pressure in pascals.
pub type Pressure = fixed::types::I24F8;
/// A valve command in volts about the mid position.
pub type Voltage = fixed::types::I8F24;
/// A velocity in metres per second.
pub type Velocity = fixed::types::I8F24;

/// Fractional bits that the width of a code has beyond those of the quantity, so that 65,535 codes add up to the range.
pub(crate) const EXTRA_BITS: u32 = 20;

/// ADC code → quantity: `x = lo + code · width`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdcScale {
    /// The quantity at code 0, in its own format.
    pub(crate) lowest: i32,
    /// The width of one code, with [`EXTRA_BITS`] more fractional bits than the quantity.
    pub(crate) width: i64,
    /// The highest code, 2^bits − 1.
    pub(crate) max_code: u16,
}

impl AdcScale {
    /// The quantity's bits for a code; a code above the highest reads as the highest.
    #[inline]
    pub(crate) fn bits(&self, code: AdcCode) -> i32 {
        let code = i64::from(code.0.min(self.max_code));
        // code · width is at most the span, below 2^33 in the quantity's format: 2^53 here.
        saturate(i64::from(self.lowest) + ((code * self.width + (1 << (EXTRA_BITS - 1))) >> EXTRA_BITS))
    }

    /// Whether the code sits at (or impossibly beyond) an end of the converter.
    #[inline]
    pub(crate) fn at_rail(&self, code: AdcCode) -> bool {
        code.0 == 0 || code.0 >= self.max_code
    }

    /// A position from a scale made for positions.
    #[inline]
    #[must_use]
    pub fn position(&self, code: AdcCode) -> Position {
        Position::from_bits(self.bits(code))
    }

    /// A pressure from a scale made for pressures.
    #[inline]
    #[must_use]
    pub fn pressure(&self, code: AdcCode) -> Pressure {
        Pressure::from_bits(self.bits(code))
    }
}
