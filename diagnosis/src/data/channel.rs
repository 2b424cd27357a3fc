//! The channels of a log that a balance predicts.

use serde::{Serialize, Serializer};

/// The predicted channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Pressure of A: the air balance of that chamber.
    PressureA,
    /// Pressure of B: the air balance of that chamber.
    PressureB,
    /// Position: the force balance of the piston.
    Position,
    /// Supply pressure: the balance of the air source.
    Supply,
}

impl Channel {
    /// All of them, in the order of arrays by channel.
    pub const ALL: [Self; 4] = [Self::PressureA, Self::PressureB, Self::Position, Self::Supply];

    pub(crate) const fn bit(self) -> u8 {
        1 << self as u8
    }

    /// The column of the log it predicts.
    #[must_use]
    pub const fn column(self) -> &'static str {
        match self {
            Self::PressureA => "p_a_pa",
            Self::PressureB => "p_b_pa",
            Self::Position => "y_m",
            Self::Supply => "p_sup_pa",
        }
    }
}

/// As the column it predicts.
impl Serialize for Channel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.column())
    }
}

/// A set of channels, one bit each.
pub(crate) type Channels = u8;
