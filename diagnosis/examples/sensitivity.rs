//! What each constant of the diagnosis decides: it is halved and doubled, and a fixed set of logs is diagnosed each time.
//!
//! ```text
//! cargo run --release -p diagnosis --features sensitivity --example sensitivity -- all docs/diagnosis-constants.csv
//! cargo run --release -p diagnosis --features sensitivity --example sensitivity -- one tie 2
//! ```
//!
//! `all` goes on where it was interrupted: rows that the file holds already are not made again. Remove the file to begin anew.

use diagnosis::{Diagnosis, constants, diagnose};
use rayon::prelude::*;
use rig_files::RigFile;
use std::io::Write as _;
use std::process::{Command, ExitCode};
use synthesis::blind::{Answer, Class, Estimate, Named, Nominal, Outcome, Plan, plans, score};

/// Seed of the set; it was drawn once and is no seed of another suite.
const SEED: u64 = 2_611_220_931;
/// Rows of a log that are diagnosed: its first 12 s, so that the whole takes an hour on two cores.
const ROWS: usize = 12_000;
/// Kinds of logs and how many of each.
const SET: [(Class, Nominal, usize); 9] = [
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
fn outcome(plan: &Plan) -> (Outcome, String) {
    let case = plan.draw_on(&[RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()]);
    let (mut log, _) = case.record();
    log.t_s.truncate(ROWS);
    log.y_m.truncate(ROWS);
    for column in
        [&mut log.u_v, &mut log.p_a_pa, &mut log.p_b_pa, &mut log.p_sup_pa, &mut log.f_ext_n, &mut log.y_ref_m]
    {
        if let Some(values) = column {
            values.truncate(ROWS);
        }
    }
    let answer = match diagnose(&case.rig_file, &log, &|_| {}) {
        Ok(diagnosis) => answer(&diagnosis),
        Err(_) => Answer::silent(rig_files::Verdict::NoGap),
    };
    let mut ids: Vec<&str> = answer.causes.iter().map(|cause| cause.id.as_str()).collect();
    ids.sort_unstable();
    (score(&case.causes, &answer).outcome, format!("{} {}", answer.verdict.word(), ids.join("+")))
}

/// Diagnoses the set with one constant changed: right, misleading, and what was said of each log.
fn one(name: &str, factor: f64) -> Result<(usize, usize, Vec<String>), String> {
    if factor != 1.0 {
        constants::change(name, factor).map_err(|name| format!("there is no constant `{name}`"))?;
    }
    let set: Vec<Plan> = SET.iter().flat_map(|(class, nominal, n)| plans(*class, *nominal, *n, SEED)).collect();
    let outcomes: Vec<(Outcome, String)> = set.par_iter().map(outcome).collect();
    let right = |o: &Outcome| matches!(o, Outcome::Exact | Outcome::Tied | Outcome::Quiet | Outcome::Rejected);
    Ok((
        outcomes.iter().filter(|(o, _)| right(o)).count(),
        outcomes.iter().filter(|(o, _)| o.is_wrong()).count(),
        outcomes.into_iter().map(|(_, said)| said).collect(),
    ))
}

/// Runs this program for one constant; its line of output.
fn run(name: &str, factor: f64) -> Result<String, String> {
    let me = std::env::current_exe().map_err(|error| error.to_string())?;
    let out = Command::new(me).args(["one", name, &factor.to_string()]).output().map_err(|error| error.to_string())?;
    if !out.status.success() {
        // A constant may not bear to be halved; that is a result, too.
        return Ok("failed".into());
    }
    Ok(String::from_utf8_lossy(&out.stdout).trim().to_string())
}

fn all(path: &str) -> Result<(), String> {
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
        let row = run(&name, factor)?;
        writeln!(file, "{start}{row}").map_err(|e| format!("{path}: {e}"))?;
    }
    bar.finish();
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match words[..] {
        ["all", path] => all(path),
        ["one", name, factor] => match factor.parse::<f64>() {
            Ok(factor) => one(name, factor).map(|(right, wrong, said)| println!("{right},{wrong},{}", said.join(";"))),
            Err(_) => Err(format!("`{factor}` is not a number")),
        },
        _ => Err("usage: sensitivity all FILE.csv | sensitivity one CONSTANT FACTOR".into()),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("error: {problem}");
            ExitCode::from(2)
        }
    }
}
