//! What a table of parameters is. Controller and monitor declare theirs with [`parameter_table!`], the rig has a macro of
//! its own for its sub-tables; range checks, messages, the board's commands and the pages in `docs/` all read the table.
//!
//! ```
//! use parameter_table::parameter_table;
//!
//! parameter_table! {
//!     /// A tank.
//!     #[derive(Clone, Debug, PartialEq)]
//!     pub struct Tank, keys "tank.";
//!
//!     /// Volume.
//!     volume_m3: f32 = 0.5, "m3", 0.001 => 10.0;
//!     /// Pressure at which the safety valve opens; absent: there is none.
//!     relief_pa: Option<f32> = None, "Pa", 1.0e5 => 1.0e7;
//! }
//!
//! let tank = Tank { volume_m3: 20.0, ..Tank::default() };
//! let refused = tank.check_ranges().unwrap_err();
//! assert_eq!(refused.to_string(), "tank.volume_m3 = 20 must be from 0.001 to 10 m3");
//! assert_eq!(Key::relief_pa.meaning(), "Pressure at which the safety valve opens; absent: there is none.");
//! ```
//!
//! Meanings are apart from [`Row`], so that a program that never shows them does not contain them.
#![no_std]
#![forbid(unsafe_code)]

mod limits;
mod value;

pub use limits::{Limits, Must, ParameterError, Row};
pub use value::{End, Field, Short, Value};

/// Declares a struct of parameters and its table.
///
/// A line reads `name: type = default, "unit", low => high;`, for a pair also `apart least distance` before the semicolon.
/// Its doc comment is the meaning. The type is one that implements [`Field`]; an `Option` is absent by default. The string
/// after `keys` goes before every name to make the key that messages show.
///
/// Besides the struct and its `Default` there are an enum `Key` with one name per parameter ([`Row`] and meaning of each),
/// and on the struct `get`, `put` and `check_ranges`.
#[macro_export]
macro_rules! parameter_table {
    (
        $(#[$attribute:meta])*
        pub struct $Struct:ident, keys $prefix:literal;
        $($(#[doc = $meaning:literal])+ $name:ident: $type:ty = $default:expr, $unit:literal, $low:expr => $high:expr $(, apart $apart:expr)?;)+
    ) => {
        $(#[$attribute])*
        pub struct $Struct {
            $($(#[doc = $meaning])+
            #[doc = concat!("\n\nFrom `", stringify!($low), "` to `", stringify!($high), "` ", $unit, "; by default `", stringify!($default), "`.")]
            pub $name: $type,)+
        }

        impl Default for $Struct {
            fn default() -> Self {
                Self { $($name: $default,)+ }
            }
        }

        #[doc = concat!("One parameter of [`", stringify!($Struct), "`].")]
        #[allow(non_camel_case_types, reason = "written as in files")]
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Key {
            $($(#[doc = $meaning])+ $name,)+
        }

        impl Key {
            /// Every parameter, in the order of the table.
            pub const ALL: [Self; [$(stringify!($name)),+].len()] = [$(Self::$name),+];

            const ROWS: &[$crate::Row; Self::ALL.len()] = &[$($crate::Row {
                key: concat!($prefix, stringify!($name)),
                limits: $crate::Limits {
                    unit: $unit,
                    low: $low as f64,
                    high: $high as f64,
                    apart: 0.0 $(+ $apart)?,
                    pair: <$type as $crate::Field>::PAIR,
                    optional: <$type as $crate::Field>::OPTIONAL,
                },
            }),+];

            /// Key, unit and range.
            #[must_use]
            pub const fn row(self) -> &'static $crate::Row {
                &Self::ROWS[self as usize]
            }

            /// What the parameter does.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    // A doc comment's text begins with a blank.
                    $(Self::$name => const { concat!($($meaning),+).trim_ascii_start() },)+
                }
            }

            /// What the parameter is when nothing else is said.
            #[must_use]
            pub fn default_value(self) -> $crate::Value {
                $Struct::default().get(self)
            }
        }

        impl $Struct {
            /// The value of one parameter.
            #[must_use]
            pub fn get(&self, key: Key) -> $crate::Value {
                match key {
                    $(Key::$name => $crate::Field::value(&self.$name),)+
                }
            }

            /// Stores one number: an end of a pair, or the whole parameter. Zero makes an optional number absent. The
            /// result wants a check.
            pub fn put(&mut self, key: Key, end: $crate::End, number: f32) {
                match key {
                    $(Key::$name => $crate::Field::put(&mut self.$name, end, number),)+
                }
            }

            /// Checks every parameter against its row of the table.
            ///
            /// # Errors
            /// The first parameter that is outside its range, or not a number.
            pub fn check_ranges(&self) -> Result<(), $crate::ParameterError> {
                Key::ALL.into_iter().try_for_each(|key| key.row().check(self.get(key)))
            }
        }
    };
}
