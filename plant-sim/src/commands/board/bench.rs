//! `plant-sim board --emulated`: a board on the emulated chip, told what to do line by line.

use super::{Action, Task, carry_out, measure, task};
use crate::commands::{CliError, in_range};
use clap::Parser as _;
use plant_sim::emulated::EmulatedError;
use plant_sim::emulated::cylinder::Surroundings;
use plant_sim::emulated::session::Session;
use plant_sim::telemetry::Remark;
use plant_sim::{CodeNoise, ConversionNoise, LoopSettings};
use rig_files::{InputError, RigFile};
use std::cell::Cell;
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
    while let Some(line) = next_line()? {
        let line = line.trim_end();
        let words = words(line);
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
    match deed {
        Deed::Wait { seconds } => {
            in_range("wait", *seconds, 0.0, 3600.0, "seconds")?;
            session.wait(*seconds).map_err(|error| broken(&error))?;
        }
        Deed::Push { .. } | Deed::Supply { .. } | Deed::Sensors { .. } => {
            surround(&session.cylinder().surroundings(), deed)?;
        }
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

/// What a hand does to the rig; anything else is passed over.
fn surround(rig: &Cell<Surroundings>, deed: &Deed) -> Result<(), CliError> {
    let mut now = rig.get();
    match deed {
        Deed::Push { newton } => {
            in_range("push", *newton, -1.0e5, 1.0e5, "newton")?;
            now.force_n = *newton;
        }
        Deed::Supply { pascal } => {
            in_range("supply", *pascal, 0.0, 5.0e6, "pascals, absolute")?;
            now.supply_pa = *pascal;
        }
        Deed::Sensors { switch } => now.plugged = switch == "on",
        _ => {}
    }
    rig.set(now);
    Ok(())
}

/// Asks the person at the keyboard, who may change the rig before Enter.
fn ask_person(rig: &Cell<Surroundings>, what: &str) -> Result<(), CliError> {
    say!("{what} (push, supply, sensors); then press Enter");
    loop {
        let Some(line) = next_line()? else {
            return Err(CliError::Usage("the input has ended in the midst of a calibration".into()));
        };
        let words = words(&line);
        if words.is_empty() {
            return Ok(());
        }
        match Line::try_parse_from(words) {
            Ok(Line { deed: deed @ (Deed::Push { .. } | Deed::Supply { .. } | Deed::Sensors { .. }) }) => {
                surround(rig, &deed)?;
            }
            _ => say!("only push, supply and sensors now, or Enter"),
        }
    }
}

/// A line of standard input; `None` at its end. Not locked in between.
fn next_line() -> Result<Option<String>, CliError> {
    let mut line = String::new();
    let count = std::io::stdin().lock().read_line(&mut line);
    let count = count.map_err(|error| InputError::unreadable("standard input", &error))?;
    Ok((count > 0).then_some(line))
}

/// The words of a line, without comment, and without what lines copied from the documents begin with.
fn words(line: &str) -> Vec<&str> {
    let words = line.split('#').next().unwrap_or_default().trim();
    let words = words.strip_prefix("$ ").unwrap_or(words);
    let words: Vec<&str> = words.strip_prefix("plant-sim board").unwrap_or(words).split_whitespace().collect();
    match &words[..] {
        ["--port", _, rest @ ..] | ["…", rest @ ..] => rest.to_vec(),
        _ => words,
    }
}

fn on_board(session: &mut Session, action: &Action) -> Result<(), CliError> {
    let rig = session.cylinder().surroundings();
    match task(action)? {
        None => Ok(()),
        Some(Task::Calibrate(channel, values, save)) => {
            let mut client = session.client().map_err(|error| broken(&error))?;
            measure::calibrate(&mut client, channel, values, save, |what| ask_person(&rig, what))
        }
        Some(task) => carry_out(task, &mut session.client().map_err(|error| broken(&error))?),
    }
}
