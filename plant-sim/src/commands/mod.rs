//! One file per subcommand: its arguments, and what it does.

/// Prints a line; unlike `println!` it does not panic when it cannot be written.
macro_rules! say {
    ($($text:tt)*) => { $crate::commands::print_line(format_args!($($text)*)) };
}

pub(crate) mod blind;
pub(crate) mod board;
pub(crate) mod check;
pub(crate) mod controller;
pub(crate) mod diagnose;
pub(crate) mod experiment;
pub(crate) mod friction;
pub(crate) mod import;
pub(crate) mod paper;
pub(crate) mod plot;
pub(crate) mod record;
pub(crate) mod rig;
pub(crate) mod run;
pub(crate) mod simulate;
pub(crate) mod sweep;
pub(crate) mod synthesize;
pub(crate) mod tune;

use plant_sim::import::{Imported, Mapping};
use report_html::Table;
use rig_files::{InputError, Log, RigFile, Short};
use std::fmt;
use std::io::{ErrorKind, Write as _};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Why a command failed, and with which exit status.
#[derive(Debug)]
pub(crate) enum CliError {
    /// The user's files or arguments; exit status 2.
    Input(InputError),
    /// A combination of arguments that makes no sense; exit status 2.
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

/// Why the first line that could not be printed was not.
static UNPRINTED: OnceLock<String> = OnceLock::new();

pub(crate) fn print_line(line: fmt::Arguments<'_>) {
    note(writeln!(std::io::stdout(), "{line}"));
}

/// Remembers a failure, unless the reader (`head`, a pager) has merely seen enough.
fn note(done: std::io::Result<()>) {
    if let Err(error) = done
        && error.kind() != ErrorKind::BrokenPipe
    {
        let _ = UNPRINTED.set(error.to_string());
    }
}

/// Whether everything a command said has been printed.
pub(crate) fn all_printed() -> Result<(), CliError> {
    note(std::io::stdout().flush());
    match UNPRINTED.get() {
        None => Ok(()),
        Some(error) => Err(CliError::Failed(format!("the result could not be printed: {error}"))),
    }
}

/// The rig of `--rig`.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct RigArgument {
    /// Rig file (TOML), e.g. rigs/paper-a.toml
    #[arg(long, value_name = "FILE")]
    pub(crate) rig: PathBuf,
}

/// Reads a rig file, and warns of what hardly any rig is.
pub(crate) fn read_rig(path: &Path) -> Result<RigFile, InputError> {
    let rig = RigFile::read(path)?;
    for suspicion in rig.suspicions() {
        eprintln!("warning: {}: {suspicion}", path.display());
    }
    Ok(rig)
}

/// Reads a log, or a foreign table by a mapping; with what was done to get it.
pub(crate) fn read_log(path: &Path, map: Option<&Path>) -> Result<Imported, InputError> {
    match map {
        Some(map) => Mapping::read(map)?.import(path),
        None => Ok(Imported { log: Log::read(path)?, notes: Vec::new() }),
    }
}

/// Creates an output folder with its parents.
pub(crate) fn make_folder(path: &Path) -> Result<(), CliError> {
    std::fs::create_dir_all(path).map_err(|error| InputError::unwritable(&path.display().to_string(), &error).into())
}

/// Refuses an output file that cannot be one, or that the command reads: it could not be made again from the result.
pub(crate) fn can_be_written<'a>(out: &Path, inputs: impl IntoIterator<Item = &'a Path>) -> Result<(), CliError> {
    let refused = |why: ErrorKind| Err(InputError::unwritable(&out.display().to_string(), &why.into()).into());
    let made = out.ancestors().skip(1).find(|folder| folder.exists());
    if made.is_some_and(|folder| !folder.is_dir()) {
        return refused(ErrorKind::NotADirectory);
    }
    let Ok(present) = out.canonicalize() else { return Ok(()) };
    if present.is_dir() {
        return refused(ErrorKind::IsADirectory);
    }
    if !present.is_file() || inputs.into_iter().all(|input| input.canonicalize().ok().as_ref() != Some(&present)) {
        return Ok(());
    }
    let remedy = "choose another name with --out";
    Err(InputError::new(out.display().to_string(), "is read, and the result would take its place", remedy).into())
}

/// A number of the command line.
pub(crate) fn plain_number(text: &str) -> Result<f64, String> {
    text.parse().map_err(|_| "write a plain number, without its unit".to_string())
}

/// Refuses a number outside its range (NaN included).
pub(crate) fn in_range(option: &str, value: f64, low: f64, high: f64, unit: &str) -> Result<(), CliError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        let [value, low, high] = [value, low, high].map(Short);
        Err(CliError::Usage(format!("{option} {value} must lie from {low} to {high} ({unit})")))
    }
}

/// Refuses a file that is there: what is written is meant to be edited, and would take the place of edited text.
pub(crate) fn must_be_new(out: &Path) -> Result<(), CliError> {
    if out.is_file() {
        let remedy = "choose another name with --out, or remove it";
        return Err(InputError::new(out.display().to_string(), "is there already", remedy).into());
    }
    Ok(())
}

/// Refuses a position, m, beyond a rig's end stops.
pub(crate) fn between_stops(option: &str, target_m: f64, rig: &RigFile) -> Result<(), CliError> {
    let half_m = rig.rig.cylinder.stroke_m / 2.0;
    if target_m.abs() <= half_m {
        return Ok(());
    }
    let text = format!("{option} {} is beyond the end stops of {} (±{} m)", Short(target_m), rig.name, Short(half_m));
    Err(CliError::Usage(text))
}

/// Refuses a target of a step, m: beyond the end stops, or where the piston starts.
pub(crate) fn can_be_target(option: &str, target_m: f64, rig: &RigFile) -> Result<(), CliError> {
    if target_m == 0.0 {
        return Err(CliError::Usage(format!("{option} 0 is where the piston starts; choose another position")));
    }
    between_stops(option, target_m, rig)
}

/// A name as a file name: letters, digits and dashes.
pub(crate) fn file_name(name: &str) -> String {
    let plain: String = name.chars().map(|c| if c.is_alphanumeric() { c.to_ascii_lowercase() } else { '-' }).collect();
    plain.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
}

/// A table for the terminal: first column to the left, the others to the right.
pub(crate) fn text_table(table: &Table) -> String {
    let columns = table.head.len();
    let width = |column: usize| {
        let cells = table.rows.iter().filter_map(|row| row.get(column)).chain(table.head.get(column));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let line = |cells: &[String]| {
        let mut text = String::new();
        for (column, (cell, width)) in cells.iter().zip(&widths).enumerate() {
            let padding = " ".repeat(width - cell.chars().count());
            text += &if column == 0 { format!("{cell}{padding}") } else { format!("  {padding}{cell}") };
        }
        text.trim_end().to_string() + "\n"
    };
    let rule: Vec<String> = widths.iter().map(|width| "─".repeat(*width)).collect();
    let mut text = line(&table.head) + &line(&rule);
    for row in &table.rows {
        text += &line(row);
    }
    text
}
