//! Converter codes: what the hardware hands in and takes out.
//!
//! Codes are linear over their range, both ends included:
//! `code = round((x − lo) / (hi − lo) · (2^bits − 1))`, clamped.

/// A code of an analogue-to-digital converter, right-aligned, 0 … 2^bits − 1 (hardware oversampling included).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct AdcCode(pub u16);

/// A code of the digital-to-analogue converter that drives the valve, right-aligned, 0 … 2^bits − 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct DacCode(pub u16);
