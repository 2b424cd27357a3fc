//! `plant-sim blind`: the blind suite.

use super::CliError;
use indicatif::{ProgressBar, ProgressStyle};
use plant_sim::gap::to_json;
use rand::RngExt;
use rig_files::{Log, RigFile, write_file};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use synthesis::blind::{
    Answer, Class, Entry, Nominal, Outcome, Plan, case_lines, markdown, plans, plans_hiding, run as run_suite,
};

/// Hide effects in synthetic logs, diagnose the logs, and score the diagnosis.
///
/// Effect, strength, rig, experiment, noise, jitter and losses are drawn from a printed seed and kept from the
/// diagnosis, which sees the rig file and the log alone. Any other diagnosis can be scored by the same suite:
/// --diagnosis PROGRAM is started as `PROGRAM diagnose --rig R.toml --log L.csv --out DIR` and must write
/// DIR/diagnosis.json.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim blind                                  # 52 logs per class, fresh seed\n  \
    plant-sim blind --class null --logs 200 --nominal 2%\n  \
    plant-sim blind --case single/exact/00c0ffee00c0ffee --keep out/case   # one case again, its files kept")]
pub(crate) struct Arguments {
    /// Logs per class and kind of nominal values
    #[arg(long, value_name = "COUNT", default_value_t = 52, value_parser = clap::value_parser!(u16).range(1..))]
    logs: u16,
    /// Seed of the suite; printed, and drawn if not given
    #[arg(long)]
    seed: Option<u64>,
    /// single, weak, pairs, triples, null, unknown, partial, poor, decimated, slow, weather, clipped, slight, valve,
    /// sensors, or all
    #[arg(long, value_delimiter = ',', default_value = "all", value_parser = class)]
    class: Vec<Classes>,
    /// exact, 2%, or both
    #[arg(long, default_value = "both", value_parser = nominal)]
    nominal: Nominals,
    /// Only cases that hide this effect, alone or with others, by its identifier
    #[arg(long, value_name = "ID", conflicts_with = "case")]
    effect: Option<String>,
    /// Cases at the same time; the diagnosis itself may use more threads
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    jobs: u16,
    /// Rig files to draw from instead of the paper's three
    #[arg(long = "rig", value_name = "FILE")]
    rigs: Vec<PathBuf>,
    /// Draw a rig of its own for every case instead: bore, stroke, load, valve, dead zone and friction at random
    #[arg(long, conflicts_with = "rigs")]
    varied: bool,
    /// Run one case again, by its name in the table; with the same --rig or --varied
    #[arg(long, value_name = "CASE")]
    case: Option<Plan>,
    /// Where to keep rig file, log, truth and diagnosis of that case
    #[arg(long, value_name = "DIR", requires = "case")]
    keep: Option<PathBuf>,
    /// A program to score instead of this project's diagnosis
    #[arg(long, value_name = "PROGRAM")]
    diagnosis: Option<PathBuf>,
    /// Where to write the tables; the same name with .csv gets one line per case
    #[arg(long, value_name = "FILE", default_value = "out/blind-results.md", value_parser = tables)]
    out: PathBuf,
}

#[derive(Clone, Debug)]
struct Classes(Vec<Class>);

#[derive(Clone, Debug)]
struct Nominals(Vec<Nominal>);

fn class(text: &str) -> Result<Classes, String> {
    if text == "all" {
        return Ok(Classes(Class::ALL.to_vec()));
    }
    let known = Class::ALL.map(Class::word).join(", ");
    let found = Class::ALL.into_iter().find(|class| class.word() == text);
    found.map(|class| Classes(vec![class])).ok_or_else(|| format!("must be one of {known}, or all"))
}

fn nominal(text: &str) -> Result<Nominals, String> {
    if text == "both" {
        return Ok(Nominals(Nominal::ALL.to_vec()));
    }
    let found = Nominal::ALL.into_iter().find(|nominal| nominal.word() == text);
    found.map(|nominal| Nominals(vec![nominal])).ok_or_else(|| "must be exact, 2%, or both".to_string())
}

/// The file of the tables; the lines stand beside it.
fn tables(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if path.extension().is_some_and(|extension| extension == "csv") {
        return Err("must not end in .csv: that is where the lines of the cases go; write .md".into());
    }
    Ok(path)
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rigs = if arguments.varied {
        vec![]
    } else if arguments.rigs.is_empty() {
        vec![RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()]
    } else {
        arguments.rigs.iter().map(|path| RigFile::read(path)).collect::<Result<_, _>>()?
    };
    if let Some(plan) = arguments.case {
        return one_case(arguments, plan, &rigs);
    }

    let seed = arguments.seed.unwrap_or_else(|| rand::rng().random());
    let logs = usize::from(arguments.logs);
    let mut kinds = Vec::new();
    for class in arguments.class.iter().flat_map(|classes| &classes.0) {
        for nominal in &arguments.nominal.0 {
            kinds.push(match &arguments.effect {
                None => plans(*class, *nominal, logs, seed),
                Some(id) => plans_hiding(id, *class, *nominal, logs, seed),
            });
        }
    }
    kinds.retain(|kind| !kind.is_empty());
    if let Some(id) = arguments.effect.as_ref().filter(|_| kinds.is_empty()) {
        return Err(CliError::Usage(format!(
            "--effect: no class asked for hides `{id}`; docs/effects.md lists identifiers"
        )));
    }
    // In turn, so that a suite cut short has seen as much of every kind.
    let all: Vec<Plan> = (0..logs).flat_map(|at| kinds.iter().map(move |kind| kind[at])).collect();
    say!("suite seed {seed}, {} cases", all.len());
    let bar = ProgressBar::new(all.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len}  {eta} left  {msg}") {
        bar.set_style(style);
    }
    let tables = Tables { path: &arguments.out, command: reproduce(arguments, seed), planned: all.len() };
    tables.write(&[])?;
    let diagnose = |rig: &RigFile, log: &Log| judge(arguments, rig, log);
    let finished: Mutex<Vec<Entry>> = Mutex::new(Vec::new());
    let done = |entry: &Entry| {
        match bad_news(entry) {
            // Without a terminal there is no bar, and lines printed above it would be lost.
            Some(line) if bar.is_hidden() => eprintln!("{line}"),
            Some(line) => bar.println(line),
            None => {}
        }
        bar.inc(1);
        let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
        finished.push(entry.clone());
        // A disk that is full for a moment must not cost the suite: the end writes once more, and reports.
        let _ = tables.write(&finished);
    };
    let entries = run_suite(&all, &rigs, usize::from(arguments.jobs), &diagnose, &done).map_err(CliError::Failed)?;
    bar.finish_and_clear();

    let (table, lines) = tables.write(&entries)?;
    // The tables up to the list of failures, which were printed as they happened.
    say!("{}", table.split("## Cases that went wrong").next().unwrap_or_default().trim_end());
    say!("\n{} and {}", arguments.out.display(), lines.display());
    Ok(())
}

/// The files of the result, whole after every case: a suite that is interrupted keeps what it has.
struct Tables<'a> {
    path: &'a Path,
    command: String,
    planned: usize,
}

impl Tables<'_> {
    /// Writes them; the text of the tables and the path of the lines.
    fn write(&self, entries: &[Entry]) -> Result<(String, PathBuf), CliError> {
        let table = markdown(entries, self.planned, &self.command);
        write_file(self.path, |file| file.write_all(table.as_bytes()))?;
        let lines = self.path.with_extension("csv");
        write_file(&lines, |file| file.write_all(case_lines(entries).as_bytes()))?;
        Ok((table, lines))
    }
}

/// The command that gives the same suite again.
fn reproduce(arguments: &Arguments, seed: u64) -> String {
    let mut command = format!("plant-sim blind --logs {} --seed {seed}", arguments.logs);
    let classes: Vec<&str> = arguments.class.iter().flat_map(|classes| &classes.0).map(|class| class.word()).collect();
    if classes.len() < Class::ALL.len() {
        command += &format!(" --class {}", classes.join(","));
    }
    if let Some(id) = &arguments.effect {
        command += &format!(" --effect {id}");
    }
    if let [one] = arguments.nominal.0[..] {
        command += &format!(" --nominal {}", one.word());
    }
    if arguments.varied {
        command += " --varied";
    }
    for rig in &arguments.rigs {
        command += &format!(" --rig {}", rig.display());
    }
    command
}

fn bad_news(entry: &Entry) -> Option<String> {
    let outcome = entry.score.as_ref().map(|score| score.outcome);
    let fine = [Outcome::Exact, Outcome::Tied, Outcome::Quiet, Outcome::Rejected];
    if outcome.is_some_and(|outcome| fine.contains(&outcome)) {
        return None;
    }
    let hidden: Vec<&str> = entry.hidden.iter().map(|cause| cause.id()).collect();
    let said = match &entry.answer {
        Err(error) => error.clone(),
        Ok(answer) => {
            let causes: Vec<&str> = answer.causes.iter().map(|cause| cause.id.as_str()).collect();
            format!("{} {}", answer.verdict.word(), causes.join(" + "))
        }
    };
    let hidden = if hidden.is_empty() { "nothing".to_string() } else { hidden.join(" + ") };
    let word = outcome.map_or("failed", Outcome::word);
    Some(format!("{}  {word}: {hidden} → {said}", entry.plan))
}

fn one_case(arguments: &Arguments, plan: Plan, rigs: &[RigFile]) -> Result<(), CliError> {
    if let Some(folder) = &arguments.keep {
        std::fs::create_dir_all(folder).map_err(|error| CliError::Failed(format!("{}: {error}", folder.display())))?;
        let truth = plan.draw_on(rigs).truth_toml();
        write_file(&folder.join("truth.toml"), |file| file.write_all(truth.as_bytes()))?;
    }
    let diagnose = |rig: &RigFile, log: &Log| judge(arguments, rig, log);
    let entry = synthesis::blind::run_one(plan, rigs, &diagnose);
    say!("{}", case_lines(std::slice::from_ref(&entry)).trim_end());
    if let Some(score) = &entry.score {
        for p in &score.parameters {
            let (percent, errors) = (100.0 * p.relative_error, p.in_std_errors);
            say!(
                "{} {}: true {:.5e}, found {:.5e}, off by {percent:.2} %, {errors:.1} standard errors",
                p.effect,
                p.name,
                p.truth,
                p.value
            );
        }
    }
    say!("{}", bad_news(&entry).unwrap_or_else(|| format!("{}  right", entry.plan)));
    Ok(())
}

/// The diagnosis that is being scored.
fn judge(arguments: &Arguments, rig: &RigFile, log: &Log) -> Result<Answer, String> {
    let temporary = tempfile::tempdir().map_err(|error| format!("no temporary folder: {error}"))?;
    let folder = arguments.keep.as_deref().unwrap_or(temporary.path());
    if arguments.keep.is_some() || arguments.diagnosis.is_some() {
        rig.write(&folder.join("rig.toml")).map_err(|error| error.to_string())?;
        log.write(&folder.join("log.csv")).map_err(|error| error.to_string())?;
    }
    let json = match &arguments.diagnosis {
        Some(program) => ask(program, folder)?,
        None => {
            let result = diagnosis::diagnose(rig, log, &|_| {}).map_err(|error| error.to_string())?;
            to_json(&result).map_err(|error| error.to_string())?
        }
    };
    if arguments.keep.is_some() {
        write_file(&folder.join("diagnosis.json"), |file| file.write_all(json.as_bytes()))
            .map_err(|error| error.to_string())?;
    }
    Answer::from_json(&json).map_err(|error| error.to_string())
}

/// Lets a program diagnose the log in a folder; what it wrote.
fn ask(program: &Path, folder: &Path) -> Result<String, String> {
    let out = folder.join("diagnosis");
    let done = Command::new(program)
        .arg("diagnose")
        .arg("--rig")
        .arg(folder.join("rig.toml"))
        .arg("--log")
        .arg(folder.join("log.csv"))
        .arg("--out")
        .arg(&out)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .output()
        .map_err(|error| format!("{} does not start: {error}", program.display()))?;
    if !done.status.success() {
        let says = String::from_utf8_lossy(&done.stderr);
        return Err(format!("{}: {}", done.status, says.lines().next().unwrap_or("no message")));
    }
    std::fs::read_to_string(out.join("diagnosis.json")).map_err(|error| format!("diagnosis.json: {error}"))
}
