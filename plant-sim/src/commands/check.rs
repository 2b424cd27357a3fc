//! `plant-sim check`: what a log can and cannot tell, before anything is fitted.

use super::{CliError, RigArgument};
use diagnosis::{Check, Knowledge, Weight, check, most_telling};
use plant_sim::import::Mapping;
use report_html::Table;
use rig_files::{InputError, Log, RigFile};
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
/// Exit status 0; 2 if the log contradicts the rig file or itself.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim synthesize --rig rigs/paper-a.toml --hidden --out out/hidden.csv\n  \
    plant-sim check out/hidden.csv --rig rigs/paper-a.toml")]
pub(crate) struct Arguments {
    /// The measured log (CSV), as for `plant-sim diagnose`
    #[arg(value_name = "LOG")]
    log: PathBuf,
    #[command(flatten)]
    rig: RigArgument,
    /// Mapping file (TOML) if the log is a foreign table, as for `plant-sim import`
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = super::read_rig(&arguments.rig.rig)?;
    let log = match &arguments.map {
        Some(map) => Mapping::read(map)?.convert_file(&arguments.log)?,
        None => Log::read(&arguments.log)?,
    };
    let file = arguments.log.display().to_string();
    let refused = |error: diagnosis::DiagnosisError| {
        let text = error.to_string();
        let (problem, remedy) = text.split_once(": ").unwrap_or((&text, "see docs/diagnosis.md"));
        CliError::Input(InputError::new(file.clone(), problem, remedy))
    };
    let found = check(&rig, &log).map_err(refused)?;
    if let Some(first) = found.findings.iter().find(|finding| finding.weight == Weight::Contradiction) {
        return Err(CliError::Input(InputError::new(file.clone(), first.problem.clone(), first.remedy.clone())));
    }
    for finding in &found.findings {
        say!("Lost: {}.\n      {}.", finding.problem, finding.remedy);
    }
    if found.findings.is_empty() {
        say!("Nothing is wrong with the log.");
    }
    tell(&found);
    next(&rig, &found.knowledge);
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
        let told = if k.is_told() { "yes" } else { "no" };
        table.row([k.name.clone(), error, format!("{:.2e}", k.compared_with), told.into()]);
    }
    say!(
        "\nStandard errors that this log would give: of a rig key compared with its tolerance, of an effect with a plainly visible \
         change.\n\n{}",
        super::text_table(&table).trim_end()
    );
}

/// Which part of the recommended experiment would add most to what is not told.
fn next(rig: &RigFile, known: &[Knowledge]) {
    if known.is_empty() || known.iter().all(Knowledge::is_told) {
        return;
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
    let Some(best) = windows.first().filter(|window| !window.mostly.is_empty()) else { return };
    say!(
        "\nMost would be added by seconds {:.0} to {:.0} of `plant-sim experiment`, above all to {}:",
        best.from_s,
        best.to_s,
        best.mostly.join(", ")
    );
    let mut from = 0.0;
    for part in identification_parts(&rig.rig, PLANNED_S) {
        let to = from + part.segments.iter().map(|segment| segment.duration_s).sum::<f64>();
        if to > best.from_s && from < best.to_s {
            say!("  {from:5.1} to {to:5.1} s  {}", part.purpose);
        }
        from = to;
    }
}
