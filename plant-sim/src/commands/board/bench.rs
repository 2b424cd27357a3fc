//! `plant-sim board --emulated`: a board on the emulated chip, told what to do line by line.

use super::{Action, carry_out, task};
use crate::commands::CliError;
use clap::Parser as _;
use plant_sim::emulated::EmulatedError;
use plant_sim::emulated::session::Session;
use plant_sim::telemetry::Remark;
use plant_sim::{CodeNoise, ConversionNoise, LoopSettings};
use rig_files::{InputError, RigFile};
use std::io::{BufRead as _, IsTerminal as _};
use std::path::Path;

/// One line of standard input.
#[derive(clap::Parser, Debug)]
#[command(multicall = true, disable_help_flag = true)]
struct Line {
    #[command(subcommand)]
    deed: Deed,
}

#[derive(clap::Subcommand, Debug)]
enum Deed {
    /// Let time pass
    Wait {
        /// s
        seconds: f64,
    },
    /// Push the piston towards chamber B, until told otherwise
    Push {
        /// N
        #[arg(allow_negative_numbers = true)]
        newton: f64,
    },
    /// Another supply pressure
    Supply {
        /// Pa absolute
        pascal: f64,
    },
    /// Plug the sensors in or off
    Sensors {
        /// on or off
        #[arg(value_parser = ["on", "off"])]
        switch: String,
    },
    /// Measure the valve's voltage, the air output and the position
    Meter,
    /// Take the board's supply away, and give it back
    PowerCycle,
    /// The end
    Quit,
    #[command(flatten)]
    Board(Action),
}

fn broken(error: &EmulatedError) -> CliError {
    CliError::Failed(error.to_string())
}

pub(super) fn run(elf: &Path, rig: Option<&Path>, log: Option<&Path>, action: Option<&Action>) -> Result<(), CliError> {
    let file = elf.display().to_string();
    let bytes = std::fs::read(elf).map_err(|error| InputError::unreadable(&file, &error))?;
    let rig = rig.map_or_else(|| Ok(RigFile::paper_a()), RigFile::read)?;
    let (noise, settings) = (ConversionNoise::default(), LoopSettings::default());
    let noise: CodeNoise = noise.of_code(&rig.io, settings.oversampling, settings.raw_bits);
    let session = Session::start(&bytes, &file, &rig, &noise, settings.seed);
    let mut session = session.map_err(|error| CliError::Usage(format!("{file}, {}: {error}", rig.name)))?;
    let refused = match action {
        Some(action) => {
            on_board(&mut session, action)?;
            0
        }
        None => lines(&mut session)?,
    };
    let (telemetry, remarks) = session.telemetry();
    for remark in &remarks {
        if let Remark::Mode(..) | Remark::Restart(_) | Remark::Disagreement(_) | Remark::Lost(..) = remark {
            eprintln!("{}", crate::commands::record::sentence(remark));
        }
    }
    if let Some(path) = log {
        telemetry.write(path)?;
    }
    match refused {
        0 => Ok(()),
        refused => Err(CliError::Failed(format!("{refused} lines were refused"))),
    }
}

/// Standard input to its end; how many lines were refused. At a terminal refusals are shown, and that is all.
fn lines(session: &mut Session) -> Result<u32, CliError> {
    let typed = std::io::stdin().is_terminal();
    let mut refused = 0;
    for line in std::io::stdin().lock().lines() {
        let line = line.map_err(|error| InputError::unreadable("standard input", &error))?;
        let words = line.split('#').next().unwrap_or_default().trim();
        // Lines copied from the documents begin so.
        let words: Vec<&str> = words.strip_prefix("plant-sim board").unwrap_or(words).split_whitespace().collect();
        let words = if let ["--port", _, rest @ ..] | ["…", rest @ ..] = &words[..] { rest } else { &words[..] };
        if words.is_empty() {
            continue;
        }
        if !typed {
            let comment = line.find('#').map_or("", |at| &line[at..]);
            say!("{}", format!("> {} {comment}", words.join(" ")).trim_end());
        }
        let done = match Line::try_parse_from(words) {
            Ok(Line { deed: Deed::Quit }) => break,
            Ok(Line { deed }) => carry_out_deed(session, &deed),
            Err(error) => Err(CliError::Usage(error.render().to_string().trim_end().to_owned())),
        };
        if let Err(error) = done {
            say!("{error}");
            refused += u32::from(!typed);
        }
    }
    Ok(refused)
}

fn carry_out_deed(session: &mut Session, deed: &Deed) -> Result<(), CliError> {
    use crate::commands::in_range;
    match deed {
        Deed::Wait { seconds } => {
            in_range("wait", *seconds, 0.0, 3600.0, "seconds")?;
            session.wait(*seconds).map_err(|error| broken(&error))?;
        }
        Deed::Push { newton } => {
            in_range("push", *newton, -1.0e5, 1.0e5, "newton")?;
            session.cylinder().push(*newton);
        }
        Deed::Supply { pascal } => {
            in_range("supply", *pascal, 0.0, 5.0e6, "pascals, absolute")?;
            session.cylinder().set_supply(*pascal);
        }
        Deed::Sensors { switch } => session.cylinder().plug(switch == "on"),
        Deed::Meter => {
            let seen = session.measured();
            let air = if seen.air { "on" } else { "off" };
            say!("{:.3} s: valve {:+.3} V, air {air}, piston {:+.3} mm", seen.t_s, seen.valve_v, 1e3 * seen.y_m);
        }
        Deed::PowerCycle => session.power_cycle().map_err(|error| broken(&error))?,
        Deed::Quit => {}
        Deed::Board(action) => on_board(session, action)?,
    }
    Ok(())
}

fn on_board(session: &mut Session, action: &Action) -> Result<(), CliError> {
    match task(action)? {
        None => Ok(()),
        Some(task) => carry_out(task, &mut session.client().map_err(|error| broken(&error))?),
    }
}
