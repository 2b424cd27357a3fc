//! The command line of the positioner project.
#![forbid(unsafe_code)]

mod commands;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Simulate pneumatic servo positioners under the firmware's own control law, and compare them with measured data.
#[derive(Parser, Debug)]
#[command(name = "plant-sim", version, max_term_width = 110)]
struct CommandLine {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand, Debug)]
enum Command {
    Run(commands::run::Arguments),
    Rig(commands::rig::Arguments),
    Simulate(commands::simulate::Arguments),
    Paper(commands::paper::Arguments),
    Sweep(commands::sweep::Arguments),
    Tune(commands::tune::Arguments),
    Diagnose(commands::diagnose::Arguments),
    Friction(commands::friction::Arguments),
    Import(commands::import::Arguments),
    Plot(commands::plot::Arguments),
    Controller(commands::controller::Arguments),
    Synthesize(commands::synthesize::Arguments),
    Check(commands::check::Arguments),
    Experiment(commands::experiment::Arguments),
    Blind(commands::blind::Arguments),
    Record(commands::record::Arguments),
    Board(commands::board::Arguments),
}

fn main() -> ExitCode {
    let result = match CommandLine::parse().command {
        None => commands::run::run(&commands::run::defaults()),
        Some(Command::Run(arguments)) => commands::run::run(&arguments),
        Some(Command::Rig(arguments)) => commands::rig::run(&arguments),
        Some(Command::Simulate(arguments)) => commands::simulate::run(&arguments),
        Some(Command::Paper(arguments)) => commands::paper::run(&arguments),
        Some(Command::Sweep(arguments)) => commands::sweep::run(&arguments),
        Some(Command::Tune(arguments)) => commands::tune::run(&arguments),
        Some(Command::Diagnose(arguments)) => commands::diagnose::run(&arguments),
        Some(Command::Friction(arguments)) => commands::friction::run(&arguments),
        Some(Command::Import(arguments)) => commands::import::run(&arguments),
        Some(Command::Plot(arguments)) => commands::plot::run(&arguments),
        Some(Command::Controller(arguments)) => commands::controller::run(&arguments),
        Some(Command::Synthesize(arguments)) => commands::synthesize::run(&arguments),
        Some(Command::Check(arguments)) => commands::check::run(&arguments),
        Some(Command::Experiment(arguments)) => commands::experiment::run(&arguments),
        Some(Command::Blind(arguments)) => commands::blind::run(&arguments),
        Some(Command::Record(arguments)) => commands::record::run(&arguments),
        Some(Command::Board(arguments)) => commands::board::run(&arguments),
    };
    match result.and_then(|()| commands::all_printed()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.status())
        }
    }
}
