//! The world at the analog pins.

use crate::peripherals::adc::Conversion;
use crate::time::Time;

/// What a test puts around the chip.
pub trait Analog {
    /// The 12-bit code, 0..=4095, that a conversion gives; the valve's own pin, input 17 of ADC2, is answered by the chip while
    /// its output is on. Called in order of time, once for each conversion, also for each of
    /// those that oversampling adds up.
    fn convert(&mut self, conversion: &Conversion) -> u16;

    /// The valve output changed: a 12-bit code, or `None` for high impedance.
    fn output(&mut self, at: Time, code: Option<u16>);
}

/// The share of a sum that one of its conversions has, so that all of them add up to `sum` exactly.
#[must_use]
pub fn share_of(sum: u32, conversion: &Conversion) -> u16 {
    let samples = u32::from(conversion.samples.max(1));
    ((sum + u32::from(conversion.sample)) / samples).min(4095) as u16
}
