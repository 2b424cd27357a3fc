//! The control law: `w = K_p (y_ref − y)`, the paper's proportional controller (section 4).

use crate::arithmetic::product;
use crate::quantities::{Position, Voltage};
use fixed::types::I16F16;

/// The gain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// `K_p`, V/m.
    pub(crate) gain: I16F16,
}

impl Law {
    /// The voltage `w` that the valve should act on, behind its dead zone. Saturates at ±128 V.
    #[inline]
    #[must_use]
    pub fn effective_voltage(&self, reference: Position, position: Position) -> Voltage {
        product(reference.saturating_sub(position), self.gain)
    }
}
