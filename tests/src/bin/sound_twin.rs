//! The sound twin of every run in which a slow, late or frozen position sensor itself moves the piston far: prints what is left of
//! the pressures and writes it as Markdown.

use clap::Parser;
use rayon::prelude::*;
use scenarios::reliability::{FarRun, Row, closed_at, far_runs, rows};
use scenarios::sound_twin::{Fit, Freedom, LIMIT, Log, Twin};
use scenarios::{Deviation, Scenario, run};
use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

/// For the faults of the position sensor that move the piston far before the model monitor trips: could a sound rig with a load
/// have given the same readings, and when could a test have told?
#[derive(Parser)]
struct Arguments {
    /// Where to write the page.
    #[arg(long, default_value = "docs/reliability-sound-twin.md")]
    out: PathBuf,
    /// Seed of situations and noise, as of the reliability study.
    #[arg(long, default_value_t = 4711)]
    seed: u64,
    /// Runs per rig and situation, as of the reliability study.
    #[arg(long, default_value_t = 5)]
    runs: u64,
    /// Only the faults whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
}

const FAULTS: [&str; 3] =
    ["position: slow (lag 100 ms)", "position: delayed (50 ms)", "position: stuck, sensors without noise"];

const FREEDOMS: [(Freedom, &str); 3] =
    [(Freedom::Constants, "constants"), (Freedom::Functions, "functions"), (Freedom::Anything, "anything")];

/// How much of the log before the fault is fitted, too, ticks; 0 stands for all of it.
const BEFORE: [(usize, &str); 2] = [(300, "0.3 s"), (0, "whole log")];

/// A control is tested in every so many ticks: most of the time goes into it, and an alarm that lasts is not missed.
const STRIDE: usize = 20;

const INTRODUCTION: &str = include_str!("../sound_twin_introduction.md");

type Failure = Box<dyn std::error::Error + Send + Sync>;

/// A line of a table: for a case, what is free, and how much of the log is fitted.
type Line = fn(&Case, (Freedom, &str), (usize, &str)) -> Result<String, Failure>;

fn main() -> ExitCode {
    match report(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("sound-twin: {error}");
            ExitCode::from(2)
        }
    }
}

/// A run with its readings: as they were, without fault, and without fault on a rig that the rig file describes wrongly.
struct Case {
    name: String,
    far: FarRun,
    quiet: bool,
    /// The ticks of the fault and of the safe state.
    struck: usize,
    tripped: usize,
    faulty: Log,
    sound: Log,
    wrong: Log,
}

impl Case {
    fn new(row: &Row, far: FarRun) -> Result<Self, Failure> {
        let faulty = Log::of(&far.spoilt)?;
        let tick_s = far.spoilt.rig_file()?.io.tick_s();
        Ok(Self {
            name: format!("{}; {}", row.label, far.label),
            quiet: row.quiet(),
            struck: (far.spoilt.fault[0].at_s / tick_s).round() as usize,
            tripped: faulty.tripped.ok_or("a run that no monitor ends has no log until the trip")?,
            sound: Log::of(&far.healthy)?,
            wrong: Log::of(&Scenario { deviation: Deviation::A_TENTH, ..far.healthy.clone() })?,
            faulty,
            far,
        })
    }

    fn twin(&self, freedom: Freedom, log: &Log) -> Result<Twin, Failure> {
        Ok(Twin::new(&self.far.spoilt.rig_file()?, freedom, log, self.tripped + 1, self.quiet)?)
    }

    /// The first tick that is fitted.
    fn start(&self, before: usize) -> usize {
        if before == 0 { 0 } else { self.struck - before }
    }

    /// Ticks from the fault until the monitor trips.
    fn since(&self) -> usize {
        self.tripped + 1 - self.struck
    }

    /// What a fit from `start` on leaves, as columns of a table: RMS over four windows and the largest running mean.
    fn residuals(&self, fit: &Fit, start: usize) -> String {
        let mut columns = String::new();
        for ticks in [20, 50, self.since(), self.tripped + 1 - start] {
            let _ = write!(columns, " {:.2} |", fit.rms(ticks));
        }
        let _ = write!(columns, " {:.1} |", fit.largest_mean(self.since()));
        columns
    }

    /// The readings of the fault, as a line of the table.
    fn faulty_line(
        &self,
        (freedom, name): (Freedom, &str),
        (before, window): (usize, &str),
    ) -> Result<String, Failure> {
        let (start, since) = (self.start(before), self.since());
        let twin = self.twin(freedom, &self.faulty)?;
        let fit = twin.fit(&(start..self.tripped + 1));
        let residuals = self.residuals(&fit, start);
        let mut line = format!("| {} | {name} | {window} |{residuals} {since} |", self.name);
        match twin.first_alarm(start, self.struck + 1..self.tripped + 1) {
            None => line.push_str(" never | – |"),
            Some(alarm) => {
                let at_s = (alarm + 1) as f64 * self.far.spoilt.rig_file()?.io.tick_s();
                let beyond_m = run(&closed_at(&self.far.spoilt, at_s))?.excursion_m - self.far.coasting_m;
                let _ = write!(line, " {} | {:.0} |", alarm + 1 - self.struck, 1e3 * beyond_m);
            }
        }
        let _ = write!(line, " {:.0} |", 1e3 * self.far.beyond_m);
        Ok(line)
    }

    /// The readings without fault, as a line of the table.
    fn control_line(
        &self,
        (freedom, name): (Freedom, &str),
        (before, window): (usize, &str),
    ) -> Result<String, Failure> {
        let start = self.start(before);
        let mut line = format!("| {} | {name} | {window} |", self.name);
        for log in [&self.sound, &self.wrong] {
            let twin = self.twin(freedom, log)?;
            let fit = twin.fit(&(start..self.tripped + 1));
            let ticks = (self.struck + 1..self.tripped + 1).step_by(STRIDE);
            let alarm = if twin.first_alarm(start, ticks).is_some() { "alarm" } else { "none" };
            let _ = write!(line, "{} {alarm} |", self.residuals(&fit, start));
        }
        Ok(line)
    }

    fn force_line(&self) -> Result<String, Failure> {
        let twin = self.twin(Freedom::Anything, &self.faulty)?;
        let range = self.struck..self.tripped + 1;
        let [[largest, last], [knock, _]] = [20, 5].map(|length| twin.outer_force_n(range.clone(), length));
        let [full, coulomb] = twin.forces_n();
        Ok(format!("| {} | {largest:.0} | {last:.0} | {knock:.0} | {full:.0} | {coulomb:.0} |", self.name))
    }
}

fn report(arguments: &Arguments) -> Result<(), Failure> {
    let mut cases = Vec::new();
    for row in rows() {
        if FAULTS.contains(&row.label.as_str()) && row.label.contains(&arguments.only) {
            for far in far_runs(&row, arguments.seed, arguments.runs)? {
                cases.push(Case::new(&row, far)?);
            }
        }
    }
    let jobs: Vec<_> = cases
        .iter()
        .flat_map(|case| FREEDOMS.into_iter().flat_map(move |freedom| BEFORE.map(|before| (case, freedom, before))))
        .collect();
    let lines = |line: Line| {
        jobs.par_iter().map(|&(case, freedom, before)| line(case, freedom, before)).collect::<Result<Vec<_>, _>>()
    };
    let command = format!(
        "cargo run --release -p scenarios --bin sound-twin -- --seed {} --runs {}",
        arguments.seed, arguments.runs
    );
    let mut text = INTRODUCTION.replace("LIMIT", &LIMIT.to_string()).replace("COMMAND", &command);
    let forces = cases.iter().map(Case::force_line).collect::<Result<Vec<_>, _>>()?;
    let mut section = |title: &str, head: &str, columns: usize, lines: &[String]| {
        let rule = vec!["---"; columns].join(" | ");
        let _ = write!(text, "\n## {title}\n\n{head}\n| {rule} |\n{}\n", lines.join("\n"));
    };
    section(
        "Readings of the fault, up to the trip",
        "| fault; run | free in the twin | fitted from | RMS: last 20 ms | last 50 ms | since the fault | whole window | largest running mean | monitor trips after, ms | test would after, ms | beyond coasting then, mm | beyond coasting as it is, mm |",
        12,
        &lines(Case::faulty_line)?,
    );
    section(
        "The same runs without fault",
        "| fault that is left out; run | free in the twin | fitted from | RMS: last 20 ms | last 50 ms | since the fault | whole window | largest running mean | alarm | rig file 10 % wrong: last 20 ms | last 50 ms | since the fault | whole window | largest running mean | alarm |",
        15,
        &lines(Case::control_line)?,
    );
    section(
        "The force that pushes the twin",
        "| fault; run | largest mean over 20 ms, N | at the trip, N | largest mean over 5 ms, N | piston at supply pressure, N | Coulomb friction, N |",
        6,
        &forces,
    );
    println!("{text}");
    rig_files::write_file(&arguments.out, |file| file.write_all(text.as_bytes()))?;
    println!("written to {}", arguments.out.display());
    Ok(())
}
