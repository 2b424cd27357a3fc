//! The program, the board's commands and the libraries behind them: one program, because linking and checking each file alone costs
//! more than running most of them. The long ones, which have a run of their own, are the files beside this folder.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

mod bad_inputs;
#[cfg(unix)]
mod blind;
mod board;
mod board_commands;
#[cfg(unix)]
mod board_port;
mod catalogue_rigs;
mod commands;
mod commission;
mod diagnose;
mod import;
mod learned;
mod rig;
mod simulated_board;
mod synthesize;
mod tune_board;
mod verdicts;

/// The folder of the whole project.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// `plant-sim`, to be run in `folder`.
fn program(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_plant-sim"));
    command.current_dir(folder);
    command
}

/// What `plant-sim` answers in `folder`.
fn plant_sim(arguments: &[&str], folder: &Path) -> Output {
    program(folder).args(arguments).output().expect("runs")
}
