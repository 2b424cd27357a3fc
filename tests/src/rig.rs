//! The rigs of the scenarios, by name.

use rig_files::{InputError, RigFile};
use std::path::Path;

pub use rig_files::controller::parameters;

/// The rig called `name`: `paper-a`, `paper-b`, `paper-c`, or a rig file relative to `folder`.
///
/// # Errors
/// The rig file cannot be read.
pub fn find(name: &str, folder: &Path) -> Result<RigFile, InputError> {
    match name {
        "paper-a" => Ok(RigFile::paper_a()),
        "paper-b" => Ok(RigFile::paper_b()),
        "paper-c" => Ok(RigFile::paper_c()),
        path => RigFile::read(&folder.join(path)),
    }
}
