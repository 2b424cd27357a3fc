//! The two file formats of the project, the rig file (TOML) and the log (CSV), and the words of a third, `diagnosis.json`.
//!
//! Parsing is strict: an unknown key, a missing column, text where a number belongs, a NaN or time that goes backwards
//! gives one [`InputError`] naming the file, the line or key, and the remedy. Files are written to a temporary name and
//! renamed, so that a reader never sees half a file.
//!
//! ```
//! use rig_files::RigFile;
//! let rig = RigFile::paper_a();
//! let text = rig.to_toml();
//! assert_eq!(RigFile::parse(&text, "paper-a.toml")?, rig);
//! # Ok::<(), rig_files::InputError>(())
//! ```
#![forbid(unsafe_code)]

pub mod controller;
mod document;
mod error;
mod io;
mod log;
mod rig_file;
mod rig_toml;
mod suspicions;
mod table;
mod tolerance;
pub mod tuning;
mod verdict;
mod write;

pub use document::{Document, Entry, shorten};
pub use error::{InputError, closest};
pub use io::{Converter, Io};
pub use log::{Column, Gap, Log};
pub use plant_model::{BOTH_SIDES, RIG_KEYS, RigKey, Short, all_keys, rig_key};
pub use rig_file::RigFile;
pub use table::{Expected, Table, quotes_close};
pub use tolerance::Tolerance;
pub use verdict::Verdict;
pub use write::{read_text, write_file};
