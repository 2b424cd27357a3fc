//! `plant-sim diagnose`: from rig file and log to causes, an extended rig, and a report.

use super::{CliError, RigArgument};
use diagnosis::{Diagnosis, DiagnosisError, diagnose};
use indicatif::{ProgressBar, ProgressStyle};
use plant_sim::gap;
use rig_files::{InputError, Log, RigFile, write_file};
use std::path::PathBuf;
use std::time::Duration;

/// Say where the simulation differs from a measured log, and name the causes.
///
/// Every effect of the catalogue is a hypothesis, fitted to the log together with the nominal values, which are known
/// within the rig file's [tolerance]. A cause is named if the fit needs it, if the balance it acts on is closed with
/// it, and if the part of the log that was held back confirms it. Writes DIR/diagnosis.json, DIR/extended-rig.toml
/// (loadable by every command) and DIR/report.html. Exit status 0 for any verdict, 2 for bad input.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim synthesize --rig rigs/paper-a.toml --hidden --out out/hidden.csv\n  \
    plant-sim diagnose --rig rigs/paper-a.toml --log out/hidden.csv --out out/hidden\n  \
    plant-sim run --rig out/hidden/extended-rig.toml\n  \
    plant-sim diagnose --rig examples/rigs/cylinder-vertical.toml \\\n    \
    --map examples/mappings/cylinder-vertical.toml --log examples/data/cylinder-vertical/strokes.csv --out out/vertical")]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// The measured log (CSV): t_s, y_m and at least one of u_v, p_a_pa, p_b_pa, p_sup_pa, f_ext_n
    #[arg(long, value_name = "FILE")]
    log: PathBuf,
    /// Mapping file (TOML) if the log is a foreign table, as for `plant-sim import`
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Also configure the controller from the extended rig, show the closed loop before and after, and write
    /// DIR/controller.toml
    #[arg(long)]
    apply: bool,
}

/// What a diagnosis writes into its folder.
const EXTENDED_RIG: &str = "extended-rig.toml";
const REPORT: &str = "report.html";
const CONTROLLER: &str = "controller.toml";
const DIAGNOSIS: &str = "diagnosis.json";

impl Arguments {
    /// Of a rig file and a log of this project's own, into a folder.
    pub(crate) fn plain(rig: PathBuf, log: PathBuf, out: PathBuf) -> Self {
        Self { rig: RigArgument { rig }, log, map: None, out, apply: false }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = super::read_rig(&arguments.rig.rig)?;
    // Before the work, whose result could not be kept.
    let inputs = [&arguments.rig.rig, &arguments.log].into_iter().chain(&arguments.map);
    for result in [EXTENDED_RIG, REPORT, CONTROLLER, DIAGNOSIS] {
        super::can_be_written(&arguments.out.join(result), inputs.clone().map(PathBuf::as_path))?;
    }
    let log = super::read_log(&arguments.log, arguments.map.as_deref())?.log;
    let suspicions = log.suspicions(&rig);
    for suspicion in &suspicions {
        eprintln!("warning: {suspicion}");
    }
    let result = judge(&rig, &log, arguments)?;
    let applied = if arguments.apply {
        let refused = |error: plant_sim::LoopError| {
            let remedy = "leave out --apply, or correct the rig file";
            InputError::new(arguments.rig.rig.display().to_string(), error.to_string(), remedy)
        };
        Some(gap::apply(&rig, &result.extended_rig).map_err(refused)?)
    } else {
        None
    };
    let source = gap::Source {
        rig: &rig,
        rig_file: arguments.rig.rig.display().to_string(),
        log_file: arguments.log.display().to_string(),
        warnings: suspicions,
        applied,
    };
    let page = gap::page(&result, &source);
    let failed = |error: serde_json::Error| CliError::Failed(format!("the result cannot be written as JSON: {error}"));
    let json = gap::to_json(&result).map_err(failed)?;
    super::make_folder(&arguments.out)?;
    write(arguments, EXTENDED_RIG, &result.extended_rig.to_toml())?;
    write(arguments, REPORT, &page.to_html())?;
    if let Some(applied) = &source.applied {
        write(arguments, CONTROLLER, &applied.controller_toml())?;
    }
    // Last: who waits for it finds the other two beside it.
    write(arguments, DIAGNOSIS, &json)?;
    say!("{}", gap::summary(&result).trim_end());
    if let Some(applied) = &source.applied {
        say!("\nThe controller on the extended rig:\n{}", super::text_table(&applied.table()));
    }
    say!("\nReport:       {}", arguments.out.join(REPORT).display());
    say!("Extended rig: {}", arguments.out.join(EXTENDED_RIG).display());
    Ok(())
}

fn write(arguments: &Arguments, name: &str, text: &str) -> Result<(), CliError> {
    Ok(write_file(&arguments.out.join(name), |out| out.write_all(text.as_bytes()))?)
}

fn judge(rig: &RigFile, log: &Log, arguments: &Arguments) -> Result<Diagnosis, CliError> {
    let bar = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {elapsed}  {msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(100));
    let done = diagnose(rig, log, &|message| bar.set_message(message.to_string()));
    bar.finish_and_clear();
    done.map_err(|error| {
        let file = match error {
            DiagnosisError::Rig(_) => &arguments.rig.rig,
            _ => &arguments.log,
        };
        let text = error.to_string();
        let (problem, remedy) = text.split_once(": ").unwrap_or((&text, "see docs/diagnosis.md"));
        CliError::Input(InputError::new(file.display().to_string(), problem, remedy))
    })
}
