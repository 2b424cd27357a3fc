//! The reliability study as a command: prints its tables and writes them as Markdown.

use clap::{Parser, ValueEnum};
use control::LawChoice;
use rayon::prelude::*;
use scenarios::Deviation;
use scenarios::reliability::{
    COMPARISON_HEAD, CONDITIONS, Condition, GOAL_S, RIGS, TABLE_HEAD, THREAT_M, comparison_line, jam_known_at_once,
    normal_running, rows, study, table_line,
};
use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// Injects every fault on three rigs at rest, moving and turning back, with and without protection, then runs for hours
/// without fault; prints the tables and writes them as Markdown.
#[derive(Parser)]
struct Arguments {
    /// Where to write the report.
    #[arg(long, default_value = "docs/reliability.md")]
    out: PathBuf,
    /// Seed of situations and noise; the same seed gives the same tables.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Runs per rig and situation.
    #[arg(long, default_value_t = 5)]
    runs: u64,
    /// Hours of normal running per rig.
    #[arg(long, default_value_t = 1.0)]
    hours: f64,
    /// The law that drives the valve.
    #[arg(long, value_enum, default_value_t)]
    law: Law,
    /// Name every run that was not caught in time.
    #[arg(long)]
    late: bool,
    /// Only the faults whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, ValueEnum)]
enum Law {
    /// The positioning law.
    #[default]
    Servo,
    /// The paper's, proportional to the error.
    Paper,
}

const INTRODUCTION: &str = include_str!("../reliability_introduction.md");
const NORMAL: &str = include_str!("../reliability_normal_running.md");
const COMPARISON: &str = include_str!("../reliability_comparison.md");

fn main() -> ExitCode {
    match report(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("reliability: {error}");
            ExitCode::from(2)
        }
    }
}

fn report(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let law = if arguments.law == Law::Paper { LawChoice::Paper } else { LawChoice::Servo };
    let mut text = INTRODUCTION.replace("GOAL_MS", &format!("{:.0}", 1e3 * GOAL_S));
    text = text.replace("THREAT_MM", &format!("{:.0}", 1e3 * THREAT_M));
    let _ = writeln!(
        text,
        "## Faults\n\n`cargo run --release -p scenarios --bin reliability -- --seed {} --runs {} --hours {}{}`\n\n{TABLE_HEAD}",
        arguments.seed,
        arguments.runs,
        arguments.hours,
        if law == LawChoice::Paper { " --law paper" } else { "" },
    );
    println!("{TABLE_HEAD}");
    let mut compared = Vec::new();
    let (mut runs, mut threatening, mut in_time, mut harmless, mut missed) = (0, 0, 0, 0, 0);
    for row in rows().into_iter().filter(|row| row.label.contains(&arguments.only)) {
        let result = study(&row, law, arguments.seed, arguments.runs)?;
        let line = table_line(&row, &result);
        println!("{line}");
        let _ = writeln!(text, "{line}");
        if arguments.late {
            for run in &result.late {
                println!("    {run}");
            }
        }
        runs += result.runs;
        threatening += result.threatening;
        in_time += result.in_time;
        harmless += result.harmless;
        missed += result.missed;
        if law == LawChoice::Servo {
            let paper = study(&row, LawChoice::Paper, arguments.seed, arguments.runs)?;
            compared.push(comparison_line(&row, &paper, &result));
            let bound = jam_known_at_once();
            if bound.bounds(&row) {
                let [paper, servo] =
                    [LawChoice::Paper, LawChoice::Servo].map(|law| study(&bound, law, arguments.seed, arguments.runs));
                compared.push(comparison_line(&bound, &paper?, &servo?));
            }
        }
    }
    let summary = format!(
        "Of {runs} runs, the fault threatened the piston in {threatening}. In {in_time} of these it was caught within {:.0} ms, \
         in {harmless} the piston was kept within {:.0} mm, and in {missed} the fault was missed.",
        1e3 * GOAL_S,
        1e3 * THREAT_M
    );
    println!("\n{summary}\n");
    let _ = writeln!(text, "\n{summary}\n");
    if !compared.is_empty() {
        let table = format!("{COMPARISON_HEAD}\n{}\n", compared.join("\n"));
        println!("{table}");
        let _ = writeln!(text, "{COMPARISON}\n{table}");
    }
    let _ = writeln!(text, "{NORMAL}");
    let cases: Vec<_> = RIGS.iter().flat_map(|(rig, _)| CONDITIONS.iter().map(|condition| (*rig, condition))).collect();
    // Where the plant differs it runs for a sixth of the time.
    let hours = |condition: &Condition| {
        if condition.deviation == Deviation::NONE { arguments.hours } else { arguments.hours / 6.0 }
    };
    let outcomes: Vec<_> = cases
        .par_iter()
        .map(|(rig, condition)| normal_running(rig, law, condition, 3600.0 * hours(condition), arguments.seed))
        .collect();
    for ((rig, condition), outcome) in cases.iter().zip(outcomes) {
        let (outcome, closest) = outcome?;
        let trips = match outcome.tripped {
            None => "none".to_owned(),
            Some((reason, at_s)) => format!("{reason} after {at_s:.3} s"),
        };
        let noise = if condition.quiet { "none" } else { "600 Pa, 0.05 mm" };
        let (label, minutes) = (condition.label, 60.0 * hours(condition));
        let line = format!("| {rig} | {label} | {noise} | {minutes:.0} min | {trips} | {closest:.2} |");
        println!("{line}");
        let _ = writeln!(text, "{line}");
    }
    rig_files::write_file(&arguments.out, |file| file.write_all(text.as_bytes()))?;
    println!("written to {}", arguments.out.display());
    Ok(())
}
