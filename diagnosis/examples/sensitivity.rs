//! What each constant of the diagnosis decides: it is halved and doubled, and a fixed set of logs is diagnosed each time.
//!
//! ```text
//! cargo run --release -p diagnosis --features sensitivity --example sensitivity -- all tidy docs/diagnosis-constants.csv
//! cargo run --release -p diagnosis --features sensitivity --example sensitivity -- all disturbed docs/diagnosis-constants-disturbed.csv
//! cargo run --release -p diagnosis --features sensitivity --example sensitivity -- some tidy tie=2 open=0.1
//! ```
//!
//! Two sets: `tidy` logs with causes of every class, and `disturbed` ones, in which a sensor is at its limit, the recording is
//! interrupted, rests or leans on an end stop, has no noise, or lacks a channel.
//!
//! `all` goes on where it was interrupted: rows that the file holds already are not made again. Remove the file to begin anew.

use diagnosis::{Diagnosis, constants, diagnose};
use rayon::prelude::*;
use rig_files::{Log, RigFile};
use std::io::Write as _;
use std::process::{Command, ExitCode};
use synthesis::blind::{Answer, Class, Estimate, Named, Nominal, Outcome, Plan, plans, score};

/// Seed of the set; it was drawn once and is no seed of another suite.
const SEED: u64 = 2_611_220_931;
/// Rows of a log that are diagnosed: its first 12 s, so that the whole takes an hour on two cores.
const ROWS: usize = 12_000;
/// The tidy set: kinds of logs and how many of each.
const TIDY: [(Class, Nominal, usize); 9] = [
    (Class::Single, Nominal::Exact, 1),
    (Class::Single, Nominal::TwoPercent, 2),
    (Class::Weak, Nominal::Exact, 1),
    (Class::Weak, Nominal::TwoPercent, 1),
    (Class::Pairs, Nominal::TwoPercent, 1),
    (Class::Triples, Nominal::Exact, 1),
    (Class::Null, Nominal::TwoPercent, 1),
    (Class::Unknown, Nominal::Exact, 1),
    (Class::Poor, Nominal::TwoPercent, 1),
];

/// What is done to a log of the disturbed set.
#[derive(Clone, Copy)]
enum Disturbance {
    /// Half a second is missing twice, and single rows are.
    Interrupted,
    /// Chamber A's readings end at their 90th percentile.
    PressureAtLimit,
    /// The position's readings end at their 80th percentile.
    PositionAtLimit,
    /// Its sensors have no noise.
    NoNoise,
    /// Only chamber A was measured.
    OnePressure,
    /// The first 5 s only.
    Short,
    /// As it is recorded.
    None,
}

/// The disturbed set: what is drawn and what is then done to it.
const DISTURBED: [(Class, Nominal, Disturbance); 10] = [
    (Class::Single, Nominal::Exact, Disturbance::Interrupted),
    (Class::Null, Nominal::Exact, Disturbance::Interrupted),
    (Class::Single, Nominal::Exact, Disturbance::PressureAtLimit),
    (Class::Null, Nominal::Exact, Disturbance::PressureAtLimit),
    (Class::Null, Nominal::Exact, Disturbance::PositionAtLimit),
    (Class::Null, Nominal::Exact, Disturbance::NoNoise),
    (Class::Single, Nominal::TwoPercent, Disturbance::OnePressure),
    (Class::Null, Nominal::TwoPercent, Disturbance::Short),
    (Class::Partial, Nominal::Exact, Disturbance::None),
    (Class::Poor, Nominal::Exact, Disturbance::None),
];

fn columns(log: &mut Log) -> impl Iterator<Item = &mut Vec<f64>> {
    [&mut log.u_v, &mut log.p_a_pa, &mut log.p_b_pa, &mut log.p_sup_pa, &mut log.f_ext_n, &mut log.y_ref_m]
        .into_iter()
        .flatten()
        .chain([&mut log.t_s, &mut log.y_m])
}

fn keep(log: &mut Log, kept: impl Fn(usize) -> bool) {
    for column in columns(log) {
        let mut row = 0;
        column.retain(|_| {
            row += 1;
            kept(row - 1)
        });
    }
}

/// Limits the readings to the value below which this part of them lies.
fn limit(readings: &mut [f64], part: f64) {
    let mut sorted: Vec<f64> = readings.iter().copied().filter(|value| value.is_finite()).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    if let Some(limit) = sorted.get((part * sorted.len() as f64) as usize) {
        readings.iter_mut().for_each(|value| *value = value.min(*limit));
    }
}

impl Disturbance {
    fn apply(self, log: &mut Log) {
        match self {
            Self::Interrupted => keep(log, |row| row % 3_000 > 3 && !matches!(row, 3_500..4_000 | 8_000..8_500)),
            Self::PressureAtLimit => limit(log.p_a_pa.as_deref_mut().unwrap_or_default(), 0.9),
            Self::PositionAtLimit => limit(&mut log.y_m, 0.8),
            Self::OnePressure => log.p_b_pa = None,
            Self::Short => keep(log, |row| row < 5_000),
            Self::NoNoise | Self::None => {}
        }
    }
}

fn answer(d: &Diagnosis) -> Answer {
    let named = |cause: &diagnosis::Cause| Named {
        id: cause.id.clone(),
        parameters: (cause.parameters.iter())
            .map(|p| Estimate { name: p.name.clone(), value: p.value, std_error: p.std_error })
            .collect(),
        ties: cause.ties.clone(),
    };
    Answer { causes: d.causes.iter().map(named).collect(), ..Answer::silent(d.verdict) }
}

/// The outcome of one log, and what was said of it.
fn outcome((plan, disturbance): &(Plan, Disturbance)) -> (Outcome, String) {
    let mut case = plan.draw_on(&[RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()]);
    if let Disturbance::NoNoise = disturbance {
        case.chain.position_noise_m = 0.0;
        case.chain.pressure_noise_pa = 0.0;
    }
    let (mut log, _) = case.record();
    keep(&mut log, |row| row < ROWS);
    disturbance.apply(&mut log);
    let answer = match diagnose(&case.rig_file, &log, &|_| {}) {
        Ok(diagnosis) => answer(&diagnosis),
        Err(_) => Answer::silent(rig_files::Verdict::NoGap),
    };
    let mut ids: Vec<&str> = answer.causes.iter().map(|cause| cause.id.as_str()).collect();
    ids.sort_unstable();
    (score(&case.causes, &answer).outcome, format!("{} {}", answer.verdict.word(), ids.join("+")))
}

/// `NAME=FACTOR`.
fn change(word: &str) -> Result<(String, f64), String> {
    word.split_once('=')
        .and_then(|(name, factor)| Some((name.to_string(), factor.parse().ok()?)))
        .ok_or_else(|| format!("`{word}` is not NAME=FACTOR, for example tie=2"))
}

/// Diagnoses the set with constants changed: right, misleading, and what was said of each log.
fn some(set: &str, changes: Vec<(String, f64)>) -> Result<(usize, usize, Vec<String>), String> {
    constants::change(changes).map_err(|name| format!("there is no constant `{name}`"))?;
    let set: Vec<(Plan, Disturbance)> = match set {
        "tidy" => TIDY
            .iter()
            .flat_map(|(class, nominal, n)| plans(*class, *nominal, *n, SEED))
            .map(|plan| (plan, Disturbance::None))
            .collect(),
        // One plan for each line; lines of the same class take its plans in turn.
        "disturbed" => (DISTURBED.iter().enumerate())
            .flat_map(|(n, (class, nominal, done))| {
                plans(*class, *nominal, n + 1, SEED).into_iter().skip(n).map(|plan| (plan, *done))
            })
            .collect(),
        other => return Err(format!("there is no set `{other}`: tidy, disturbed")),
    };
    let outcomes: Vec<(Outcome, String)> = set.par_iter().map(outcome).collect();
    let right = |o: &Outcome| matches!(o, Outcome::Exact | Outcome::Tied | Outcome::Quiet | Outcome::Rejected);
    Ok((
        outcomes.iter().filter(|(o, _)| right(o)).count(),
        outcomes.iter().filter(|(o, _)| o.is_wrong()).count(),
        outcomes.into_iter().map(|(_, said)| said).collect(),
    ))
}

/// Runs this program for one constant; its line of output.
fn run(set: &str, name: &str, factor: f64) -> Result<String, String> {
    let me = std::env::current_exe().map_err(|error| error.to_string())?;
    let out = Command::new(me)
        .args(["some", set].into_iter().map(String::from).chain((factor != 1.0).then(|| format!("{name}={factor}"))))
        .output()
        .map_err(|error| error.to_string())?;
    if !out.status.success() {
        // A constant may not bear to be halved; that is a result, too.
        return Ok("failed".into());
    }
    Ok(String::from_utf8_lossy(&out.stdout).trim().to_string())
}

fn all(set: &str, path: &str) -> Result<(), String> {
    let known = std::fs::read_to_string(path).unwrap_or_default();
    let mut file =
        std::fs::OpenOptions::new().create(true).append(true).open(path).map_err(|e| format!("{path}: {e}"))?;
    if known.is_empty() {
        writeln!(file, "constant,factor,right,misleading,said").map_err(|e| format!("{path}: {e}"))?;
    }
    let wanted: Vec<(String, f64)> = std::iter::once(("none".to_string(), 1.0))
        .chain(constants::table().iter().flat_map(|c| [0.5, 2.0].map(|factor| (c.name.to_string(), factor))))
        .collect();
    let bar = indicatif::ProgressBar::new(wanted.len() as u64);
    for (name, factor) in wanted {
        bar.inc(1);
        let start = format!("{name},{factor},");
        if known.lines().any(|line| line.starts_with(&start)) {
            continue;
        }
        let row = run(set, &name, factor)?;
        writeln!(file, "{start}{row}").map_err(|e| format!("{path}: {e}"))?;
    }
    bar.finish();
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["all", set, path] => all(set, path),
        ["some", set, ref changes @ ..] => {
            (changes.iter().map(|word| change(word)).collect::<Result<Vec<_>, String>>())
                .and_then(|changes| some(set, changes))
                .map(|(right, wrong, said)| println!("{right},{wrong},{}", said.join(";")))
        }
        _ => Err(
            "usage: sensitivity all SET FILE.csv | sensitivity some SET [CONSTANT=FACTOR]...; SET is tidy or disturbed"
                .into(),
        ),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("error: {problem}");
            ExitCode::from(2)
        }
    }
}
