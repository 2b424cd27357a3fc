//! What a parameter's value can be, and the types that hold one.

use core::fmt;

/// A number as messages show it: powers of ten where zeros would have to be counted, and for what is
/// very large.
///
/// A precision (`{:.2}`) is the number of decimals; a power of ten has three of them then.
///
/// ```
/// use parameter_table::Short;
/// assert_eq!(Short(10.125).to_string(), "10.125");
/// assert_eq!(Short(361_755.1).to_string(), "361755.1");
/// assert_eq!(Short(1.2e6).to_string(), "1.2e6");
/// assert_eq!(Short(1.0e300).to_string(), "1e300");
/// assert_eq!(format!("{:.2}", Short(-1.0e300 / 7.0)), "-1.429e299");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Short<T>(pub T);

/// Smaller numbers begin with zeros that have to be counted.
const SMALL: f64 = 1.0e-3;
/// From here on, a number that ends with zeros ends with too many.
const MANY_PLACES: f64 = 1.0e5;
/// Multiples of it end with zeros.
const ROUND: f64 = 1.0e3;
/// Of larger numbers the size is read, not the digits.
const LARGE: f64 = 1.0e10;

impl<T: Copy + Into<f64> + fmt::Display + fmt::LowerExp> fmt::Display for Short<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = self.0;
        let size = number.into().abs();
        let round = size >= MANY_PLACES && size % ROUND == 0.0;
        let plain = size == 0.0 || (SMALL..LARGE).contains(&size) && !round;
        match (f.precision(), plain) {
            (None, true) => write!(f, "{number}"),
            (None, false) => write!(f, "{number:e}"),
            (Some(decimals), true) => write!(f, "{number:.decimals$}"),
            (Some(_), false) if size.is_finite() => write!(f, "{number:.3e}"),
            (Some(_), false) => write!(f, "{number}"),
        }
    }
}

/// A value, whatever the type of the field that holds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// None is given.
    Absent,
    /// Yes or no.
    Flag(bool),
    /// One number.
    Number(f32),
    /// Two numbers, the lower first.
    Pair([f32; 2]),
    /// One of several words, by its place.
    Choice(u8, &'static [&'static str]),
}

impl fmt::Display for Value {
    /// As a TOML file writes it; `absent` if there is none.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Absent => f.write_str("absent"),
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Number(number) => write!(f, "{}", Short(*number)),
            Self::Choice(place, words) => {
                write!(f, "\"{}\"", words.get(usize::from(*place)).copied().unwrap_or_default())
            }
            Self::Pair([first, second]) => write!(f, "[{}, {}]", Short(*first), Short(*second)),
        }
    }
}

impl Value {
    /// One number of it: flags are 0 or 1, a word counts from 0, and an absent number is 0.
    #[must_use]
    pub fn number(self, end: End) -> f32 {
        match (self, end) {
            (Self::Absent, _) => 0.0,
            (Self::Flag(flag), _) => f32::from(u8::from(flag)),
            (Self::Choice(place, _), _) => f32::from(place),
            (Self::Number(number), _)
            | (Self::Pair([number, _]), End::First)
            | (Self::Pair([_, number]), End::Second) => number,
        }
    }
}

/// Which of a pair's numbers; single numbers have only a first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The first, or the only one.
    First,
    /// The second.
    Second,
}

/// A type that can hold a parameter.
pub trait Field {
    /// Whether it is two numbers.
    const PAIR: bool = false;
    /// Whether it may hold none.
    const OPTIONAL: bool = false;
    /// Its value.
    fn value(&self) -> Value;
    /// Stores a number, as exactly as the type can; zero makes an optional number absent.
    fn put(&mut self, end: End, number: f32);
}

impl Field for f32 {
    fn value(&self) -> Value {
        Value::Number(*self)
    }
    fn put(&mut self, _: End, number: f32) {
        *self = number;
    }
}

impl Field for u8 {
    fn value(&self) -> Value {
        Value::Number(f32::from(*self))
    }
    fn put(&mut self, _: End, number: f32) {
        *self = number as u8;
    }
}

impl Field for u32 {
    fn value(&self) -> Value {
        Value::Number(*self as f32)
    }
    fn put(&mut self, _: End, number: f32) {
        *self = number as u32;
    }
}

impl Field for bool {
    fn value(&self) -> Value {
        Value::Flag(*self)
    }
    fn put(&mut self, _: End, number: f32) {
        *self = number >= 0.5;
    }
}

impl Field for [f32; 2] {
    const PAIR: bool = true;
    fn value(&self) -> Value {
        Value::Pair(*self)
    }
    fn put(&mut self, end: End, number: f32) {
        let [first, second] = self;
        *(if end == End::First { first } else { second }) = number;
    }
}

impl Field for Option<f32> {
    const OPTIONAL: bool = true;
    fn value(&self) -> Value {
        self.map_or(Value::Absent, Value::Number)
    }
    fn put(&mut self, _: End, number: f32) {
        *self = Some(number).filter(|number| *number != 0.0);
    }
}

impl Field for Option<[f32; 2]> {
    const PAIR: bool = true;
    const OPTIONAL: bool = true;
    fn value(&self) -> Value {
        self.map_or(Value::Absent, Value::Pair)
    }
    fn put(&mut self, end: End, number: f32) {
        self.get_or_insert([number; 2]).put(end, number);
    }
}
