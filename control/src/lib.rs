//! The position controller that runs in the firmware: fixed point, no floating point in the tick, no allocation.
//!
//! One call of [`step`] per tick, and one of [`learn`] once the valve code is written. Data flows one way, and the files can be read in that order:
//!
//! ```text
//! AdcCode ─ codes ─► quantities ─► plausibility ─► setpoint ─► law ─► dead_zone_inverse ─► codes ─ DacCode
//!                                       │              │
//!                                       └──► modes ◄───┘   boot → self-test → idle ⇄ run → safe (latched)
//! ```
//!
//! [`Parameters`] are physical numbers with units. [`Config`] holds what the tick needs, precomputed from them, so that the
//! tick neither divides nor touches a float. [`ControllerState`] is everything that one tick hands to the next.
//!
//! ```
//! use control::{AdcCode, Config, Inputs, Parameters, Position, ControllerState, learn, step};
//!
//! let config = Config::from_parameters(&Parameters::default())?;
//! let mut state = ControllerState::armed();
//! let inputs = Inputs {
//!     reference: Position::from_num(0.045),
//!     position: AdcCode(32768),
//!     pressure_a: AdcCode(23710),
//!     pressure_b: AdcCode(23710),
//!     supply: Some(AdcCode(45875)),
//!     ..Inputs::default()
//! };
//! let outputs = step(&config, &mut state, inputs);
//! learn(&config, &mut state);
//! assert_eq!(outputs.dac.0, 2121); // 4 V/m · 0.045 m = 0.18 V above mid position
//! # Ok::<(), control::ConfigError>(())
//! ```
//!
//! # Arithmetic
//! Every quantity has one Q-format (see [`quantities`]). Products are formed in 64 bits, rounded to nearest, and
//! saturated into the format of the result; sums saturate. Nothing wraps: a wrapped valve command would be a full-scale
//! reversal.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

mod arithmetic;
mod calibration;
pub mod codes;
pub mod config;
mod config_error;
pub mod dead_zone_inverse;
mod frozen;
pub mod law;
pub mod modes;
pub mod parameters;
pub mod plausibility;
pub mod program;
pub mod quantities;
pub mod scales;
pub mod servo;
pub mod setpoint;
mod stop;
mod tick;
#[cfg(any(test, feature = "twin"))]
pub mod twin;

pub use codes::{AdcCode, DacCode};
pub use config::Config;
pub use config_error::ConfigError;
pub use modes::{Channel, Mode, OperatorCommand, Reason};
pub use parameter_table::{End, Limits, Must, Row, Value};
pub use parameters::{Key, LawChoice, Parameters, acceleration_range};
pub use quantities::{Position, Pressure, Velocity, Voltage};
pub use servo::learned::{Learned, MEASURED_AGAINST, QUANTITIES, Quantities, Quantity};
pub use servo::{OPENING_KNOTS, OPENING_STEP_V};
pub use tick::{Contradicts, ControllerState, ExternalFaults, Inputs, Outputs, Telemetry, learn, step};
