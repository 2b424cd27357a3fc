//! The control law: `w = K_p (y_ref − y)`, the paper's proportional controller (section 4).

use crate::arithmetic::multiply;
use crate::quantities::{Position, Voltage};

/// The gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// `K_p`, V/m, I16F16.
    pub(crate) gain_q16: i32,
}

impl Law {
    /// The voltage `w` that the valve should act on, behind its dead zone. Saturates at ±128 V.
    #[inline]
    #[must_use]
    pub fn effective_voltage(&self, reference: Position, position: Position) -> Voltage {
        let error = reference.saturating_sub(position);
        // I4F28 · I16F16 = F44; voltage has 24 fractional bits.
        Voltage::from_bits(multiply(error.to_bits(), self.gain_q16, 28 + 16 - 24))
    }
}
