//! Between converter codes and quantities: the two scales, with every division done beforehand.

use crate::arithmetic::{limit, saturate};
use crate::codes::{AdcCode, DacCode};
use crate::quantities::{Position, Pressure, Voltage};

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

/// Valve voltage → DAC code.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DacScale {
    /// Voltage of code 0.
    pub(crate) lowest: Voltage,
    /// Voltage of the highest code.
    pub(crate) highest: Voltage,
    /// Codes per volt, U16F16: the precomputed reciprocal of the code's width.
    pub(crate) codes_per_volt_q16: u32,
    /// The highest code, 2^bits − 1.
    pub(crate) max_code: u16,
}

impl DacScale {
    /// The code nearest to `voltage`; beyond the range, the code at its end.
    #[inline]
    #[must_use]
    pub fn code(&self, voltage: Voltage) -> DacCode {
        let inside = limit(voltage, self.lowest, self.highest);
        let above_lowest = i64::from(inside.to_bits()) - i64::from(self.lowest.to_bits());
        // At most (2^16 − 1) codes · 2^40: the product of span and codes per volt is the number of codes.
        let code = (above_lowest * i64::from(self.codes_per_volt_q16) + (1 << 39)) >> 40;
        DacCode(limit(saturate(code), 0, i32::from(self.max_code)) as u16)
    }

    /// The highest code that [`DacScale::code`] can return.
    #[must_use]
    pub fn max_code(&self) -> DacCode {
        DacCode(self.max_code)
    }
}
