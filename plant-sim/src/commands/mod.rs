//! One file per subcommand: its arguments, and what it does.

pub(crate) mod controller;
pub(crate) mod simulate;

use rig_files::InputError;
use std::fmt;
use std::path::PathBuf;

/// Why a command failed, and with which exit status.
#[derive(Debug)]
pub(crate) enum CliError {
    /// The user's files or arguments; exit status 2.
    Input(InputError),
    /// A combination of arguments that makes no sense; exit status 2.
    #[allow(dead_code)]
    Usage(String),
    /// Anything else; exit status 1.
    Failed(String),
}

impl CliError {
    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Input(_) | Self::Usage(_) => 2,
            Self::Failed(_) => 1,
        }
    }
}

impl fmt::Display for CliError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Input(error) => error.fmt(f),
            Self::Usage(text) | Self::Failed(text) => f.write_str(text),
        }
    }
}

impl From<InputError> for CliError {
    fn from(error: InputError) -> Self {
        Self::Input(error)
    }
}

/// The rig of `--rig`, or the paper's case (a).
#[derive(clap::Args, Debug)]
pub(crate) struct RigArgument {
    /// Rig file (TOML), e.g. rigs/paper-a.toml
    #[arg(long, value_name = "FILE")]
    pub(crate) rig: PathBuf,
}
