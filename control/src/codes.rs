//! Converter codes: what the hardware hands in and takes out.
//!
//! Codes are linear over their range, both ends included:
//! `code = round((x − lo) / (hi − lo) · (2^bits − 1))`, clamped.

use crate::arithmetic::{limit, saturate};
use crate::quantities::Voltage;

/// A code of an analogue-to-digital converter, right-aligned, 0 … 2^bits − 1 (hardware oversampling included).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct AdcCode(pub u16);

/// A code of the digital-to-analogue converter that drives the valve, right-aligned, 0 … 2^bits − 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct DacCode(pub u16);

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
