//! Ranges, and what is said about a value outside.

use crate::value::{Short, Value};
use core::fmt;

/// One line of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// The name in files and messages.
    pub key: &'static str,
    /// What values it may take.
    pub limits: Limits,
}

/// Two decimal numbers a given distance apart may be this part of it apart once they are rounded to single precision.
const ROUNDED: f32 = 0.999;

/// The values that a parameter may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// SI unit, empty for a ratio or a count.
    pub unit: &'static str,
    /// Smallest value.
    pub low: f64,
    /// Largest value.
    pub high: f64,
    /// Of a pair: how far the second value must at least be above the first.
    pub apart: f32,
    /// Whether the parameter is two values.
    pub pair: bool,
    /// Whether the parameter may be absent.
    pub optional: bool,
}

impl Limits {
    /// One value from `low` to `high`.
    #[must_use]
    pub const fn new(unit: &'static str, low: f64, high: f64) -> Self {
        Self { unit, low, high, apart: 0.0, pair: false, optional: false }
    }

    /// Whether a single-precision value lies inside. The ends are rounded to single precision, too: 3.9 as f32 is a hair
    /// above 3.9 as f64, and whoever types the limit means the limit.
    #[must_use]
    pub fn contains(&self, value: f32) -> bool {
        value >= self.low as f32 && value <= self.high as f32
    }
}

impl Row {
    /// Checks a value.
    ///
    /// # Errors
    /// If it is outside, not a number, a pair in the wrong order, or absent where it must not be.
    pub fn check(&'static self, value: Value) -> Result<(), ParameterError> {
        let limits = &self.limits;
        let refused = match value {
            Value::Absent if limits.optional => None,
            Value::Absent => Some(f64::NAN),
            Value::Flag(_) | Value::Choice(..) => None,
            Value::Number(number) => Some(number).filter(|x| !limits.contains(*x)).map(f64::from),
            Value::Pair([first, second]) => {
                let distance = f64::from(second) - f64::from(first);
                if let Some(outside) = [first, second].into_iter().find(|x| !limits.contains(*x)) {
                    Some(f64::from(outside))
                } else if distance >= f64::from(ROUNDED * limits.apart) {
                    None
                } else {
                    Some(f64::from(second))
                }
            }
        };
        match refused {
            None => Ok(()),
            Some(value) => Err(ParameterError { key: self.key, value, must: Must::Fit(&self.limits) }),
        }
    }
}

/// What would be accepted; displayed as the end of the sentence "must …".
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Must {
    /// Values inside the limits.
    Fit(&'static Limits),
    /// Values inside limits that other parameters narrow.
    FitNow(Limits),
    /// Something that involves other parameters.
    Be(&'static str),
}

impl From<&'static str> for Must {
    fn from(text: &'static str) -> Self {
        Self::Be(text)
    }
}

impl fmt::Display for Limits {
    /// `0 to 10000 V/m`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Single precision has the digits that were typed, without those of a subtraction.
        write!(f, "{} to {}", Short(self.low as f32), Short(self.high as f32))?;
        if self.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.unit) }
    }
}

impl fmt::Display for Must {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let limits = match self {
            Self::Be(text) => return f.write_str(text),
            Self::Fit(limits) => limits,
            Self::FitNow(limits) => limits,
        };
        if !limits.pair {
            write!(f, "be from {limits}")?;
        } else if limits.apart > 0.0 {
            let distance = Short(limits.apart);
            write!(f, "be two values from {limits}, the first at least {distance} {} below the second", limits.unit)?;
        } else {
            write!(f, "be two values from {limits}, the first not above the second")?;
        }
        f.write_str(if limits.optional { ", or absent" } else { "" })
    }
}

/// What is wrong with a set of parameters: which key, and what it must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterError {
    /// The offending key, as files write it; a rig's with its table, e.g. `load.mass_kg`.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// What would be accepted.
    pub must: Must,
}

impl fmt::Display for ParameterError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {} must {}", self.key, Short(self.value), self.must)
    }
}

impl core::error::Error for ParameterError {}
