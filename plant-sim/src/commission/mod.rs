//! From a rig file to a board that is set up: parameters as a set.
//!
//! | file | contents |
//! | --- | --- |
//! | `from_rig.rs` | what a rig file, extended by a diagnosis or not, says about the board's parameters |
//! | `parameter_file.rs` | the board's parameters as a file, and back |
//! | `transfer.rs` | all parameters of a board, and several changed at once or not at all |
//! | `observe.rs` | what a board measures over a while |
//! | `calibrate.rs` | two-point calibration of a channel |
//! | `dead_zone.rs` | the search for the valve's dead zone |
//! | `tune.rs` | a board finds out about its rig |

pub mod calibrate;
pub mod dead_zone;
pub mod from_rig;
pub mod observe;
pub mod parameter_file;
pub mod transfer;
pub mod tune;

use board_link::Parameter;
use rig_files::Short;

/// A parameter and its new value.
pub type Change = (Parameter, f32);

/// Says that a value is outside the board's range.
#[must_use]
pub fn out_of_range(parameter: Parameter, value: f32) -> String {
    let info = parameter.info();
    format!("the board does not take `{}` = {}; its range is {}", parameter.name(), Short(value), info.range())
}
