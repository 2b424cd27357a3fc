//! `plant-sim check`: what a log can and cannot tell, before anything is fitted.

use super::{CliError, RigArgument};
use diagnosis::{Check, Knowledge, Weight, Window, check, most_telling};
use report_html::Table;
use rig_files::{InputError, RigFile};
use serde::Serialize;
use std::path::PathBuf;
use synthesis::{Case, Chain, Law, identification, identification_parts};

/// Windows of a planned experiment are compared at this length, s.
const WINDOW_S: f64 = 10.0;
/// Length of the planned experiment, s.
const PLANNED_S: f64 = 40.0;

/// Say what a measured log can and cannot tell about a rig, in about a second, without fitting anything.
///
/// Looks for columns in another unit, of another sign, about another zero or exchanged; for values that stand still or end at a
/// limit; for rows too far apart. Then tells for each nominal value and each effect of the catalogue how well the log would
/// determine it (Fisher information), and which part of the experiment of `plant-sim experiment` would add most.
/// Exit status 0; 2 if the log contradicts the rig file or itself. docs/formats.md has the keys of --json.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim synthesize --rig rigs/paper-a.toml --hidden --out out/hidden.csv\n  \
    plant-sim check out/hidden.csv --rig rigs/paper-a.toml\n  \
    plant-sim check --rig rigs/paper-a.toml --log out/hidden.csv --json")]
pub(crate) struct Arguments {
    #[command(flatten)]
    log: LogArgument,
    #[command(flatten)]
    rig: RigArgument,
    /// Mapping file (TOML) if the log is a foreign table, as for `plant-sim import`
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Print what was found as JSON
    #[arg(long)]
    json: bool,
}

/// The log, named in either way.
#[derive(clap::Args, Debug)]
#[group(required = true, multiple = false)]
struct LogArgument {
    /// The measured log (CSV), as for `plant-sim diagnose`
    #[arg(value_name = "LOG")]
    log: Option<PathBuf>,
    /// The same, written as for `plant-sim diagnose`
    #[arg(long = "log", value_name = "FILE")]
    named: Option<PathBuf>,
}

/// All that `--json` prints.
#[derive(Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    found: &'a Check,
    next_experiment: Option<Next>,
}

/// The part of the recommended experiment that would add most to what is not told.
#[derive(Serialize)]
struct Next {
    #[serde(flatten)]
    window: Window,
    parts: Vec<Part>,
}

/// A part of an experiment.
#[derive(Serialize)]
struct Part {
    from_s: f64,
    to_s: f64,
    purpose: &'static str,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = super::read_rig(&arguments.rig.rig)?;
    let LogArgument { log, named } = &arguments.log;
    let path = log.as_ref().or(named.as_ref()).ok_or_else(|| CliError::Usage("--log is needed".into()))?;
    let log = super::read_log(path, arguments.map.as_deref())?.log;
    let file = path.display().to_string();
    let refused = |error: diagnosis::DiagnosisError| {
        let text = error.to_string();
        let (problem, remedy) = text.split_once(": ").unwrap_or((&text, "see docs/diagnosis.md"));
        CliError::Input(InputError::new(file.clone(), problem, remedy))
    };
    let found = check(&rig, &log).map_err(refused)?;
    if arguments.json {
        let next_experiment = next(&rig, &found.knowledge);
        let json = serde_json::to_string_pretty(&Report { found: &found, next_experiment });
        say!("{}", json.map_err(|error| CliError::Failed(format!("the result cannot be written as JSON: {error}")))?);
    }
    if let Some(first) = found.findings.iter().find(|finding| finding.weight == Weight::Contradiction) {
        return Err(CliError::Input(InputError::new(file.clone(), first.problem.clone(), first.remedy.clone())));
    }
    if arguments.json {
        return Ok(());
    }
    for finding in &found.findings {
        say!("Lost: {}.\n      {}.", finding.problem, finding.remedy);
    }
    if found.findings.is_empty() {
        say!("Nothing is wrong with the log.");
    }
    tell(&found);
    if let Some(Next { window, parts }) = next(&rig, &found.knowledge) {
        say!(
            "\nMost would be added by seconds {:.0} to {:.0} of `plant-sim experiment`, above all to {}:",
            window.from_s,
            window.to_s,
            window.mostly.join(", ")
        );
        for Part { from_s, to_s, purpose } in parts {
            say!("  {from_s:5.1} to {to_s:5.1} s  {purpose}");
        }
    }
    Ok(())
}

fn tell(found: &Check) {
    if found.knowledge.is_empty() {
        say!("\nNo balance can be formed: see docs/diagnosis.md, partial logs.");
        return;
    }
    let mut table = Table::new(["parameter", "standard error", "compared with", "told"]);
    for k in &found.knowledge {
        let error = if k.std_error.is_finite() { format!("{:.2e}", k.std_error) } else { "–".into() };
        let told = if k.told { "yes" } else { "no" };
        table.row([k.name.clone(), error, format!("{:.2e}", k.compared_with), told.into()]);
    }
    say!(
        "\nStandard errors that this log would give: of a rig key compared with its tolerance, of an effect with a plainly visible \
         change.\n\n{}",
        super::text_table(&table).trim_end()
    );
}

/// Which part of the recommended experiment would add most to what is not told.
fn next(rig: &RigFile, known: &[Knowledge]) -> Option<Next> {
    if known.is_empty() || known.iter().all(|k| k.told) {
        return None;
    }
    let case = Case {
        truth: rig.rig,
        causes: vec![],
        experiment: identification(&rig.rig, PLANNED_S),
        law: Law::for_rig(&rig.rig, 1.0),
        chain: Chain::standard(rig.io.position_range_m),
        seed: 1,
        rig_file: rig.clone(),
    };
    let windows = most_telling(rig, known, &case.record().0, WINDOW_S);
    let window = windows.into_iter().next().filter(|window| !window.mostly.is_empty())?;
    let mut to_s = 0.0;
    let parts = identification_parts(&rig.rig, PLANNED_S).into_iter().map(|part| {
        let from_s = to_s;
        to_s += part.segments.iter().map(|segment| segment.duration_s).sum::<f64>();
        Part { from_s, to_s, purpose: part.purpose }
    });
    let parts = parts.filter(|part| part.to_s > window.from_s && part.from_s < window.to_s).collect();
    Some(Next { window, parts })
}
