//! `plant-sim sweep`: many positioning steps, on a grid or at random.

use super::{CliError, RigArgument};
use indicatif::{ProgressBar, ProgressStyle};
use plant_sim::bound::bound_s;
use plant_sim::charts::{MM, scaled};
use plant_sim::metrics::StepMetrics;
use plant_sim::sweep::{Base, Job, Key, Outcome, Variation, check, grid, random, response, run_all, within_tolerance};
use plant_sim::{LoopSettings, MonitorAction, controller};
use rayon::prelude::*;
use report_html::{Page, Plot, Series, Table};
use rig_files::{InputError, Short, write_file};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Repeat the positioning step over a grid of parameters or at random, on all cores.
///
/// Without --samples every combination of the --vary grids is run. With --samples each run draws the --vary keys uniformly
/// over their ranges; with --tolerance (or no --vary at all) also every nominal value of the plant, as uncertain as the rig
/// file's [tolerance] says. The controller and its model monitor keep their nominal parameters. Results are the same for the same seed on any
/// number of threads. Ctrl-C stops after the runs under way; what is done is written.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim sweep --rig rigs/paper-a.toml --vary gain_v_per_m=1:10:19\n  \
    plant-sim sweep --rig rigs/paper-a.toml --vary gain_v_per_m=2:6:9 --vary load.mass_kg=2:20:10\n  \
    plant-sim sweep --rig rigs/real-mpye.toml --samples 2000 --seed 42\n  \
    plant-sim sweep --rig rigs/paper-a.toml --samples 500 --vary effects.leak-cross-piston.conductance_kg_per_s_pa=0:1e-9")]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Controller file (TOML) that replaces the values derived from the rig
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// KEY=LOW:HIGH[:COUNT]; a key of the rig file, effects.ID.PARAMETER, gain_v_per_m or target_m; may be repeated
    #[arg(long, value_name = "RANGE", allow_hyphen_values = true)]
    vary: Vec<String>,
    /// Monte Carlo with this many runs instead of a grid
    #[arg(long, value_name = "RUNS", allow_negative_numbers = true)]
    samples: Option<usize>,
    /// Also draw all nominal values within their tolerance (Monte Carlo only)
    #[arg(long, requires = "samples")]
    tolerance: bool,
    /// Seed of everything random
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// Target position, m from mid-stroke
    #[arg(long, value_name = "METRES", default_value_t = 0.045, allow_negative_numbers = true, value_parser = super::plain_number)]
    target: f64,
    /// Length of each run, s
    #[arg(long, value_name = "SECONDS", default_value_t = 6.0, allow_negative_numbers = true, value_parser = super::plain_number)]
    duration: f64,
    /// What the controller's model monitor does when the plant contradicts its nominal values. On the board it trips
    #[arg(long, value_name = "ACTION", value_enum, default_value_t)]
    monitor: MonitorAction,
    /// Threads; by default one per core
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Folder for sweep.csv and sweep.html
    #[arg(long, value_name = "FOLDER", default_value = "out")]
    out: PathBuf,
}

/// More runs than this are refused: the results are kept in memory.
const MOST_RUNS: usize = 5_000_000;

/// Responses drawn over each other: more than a palette's colours cannot be told apart.
const MOST_RESPONSES: usize = 7;

/// A figure of a run.
struct Figure {
    /// Column of the CSV.
    column: &'static str,
    /// What a reader is told.
    label: &'static str,
    /// In the unit that column and label name.
    value: fn(&StepMetrics) -> Option<f64>,
}

const FIGURES: [Figure; 7] = [
    Figure { column: "rise_s", label: "rise 10–90 %, s", value: |m| m.rise_s },
    Figure { column: "overshoot_percent", label: "overshoot, %", value: |m| Some(100.0 * m.overshoot) },
    Figure { column: "settling_2_percent_s", label: "settled to 2 %, s", value: |m| m.settling_2_percent_s },
    Figure { column: "settling_0_1_mm_s", label: "settled to 0.1 mm, s", value: |m| m.settling_0_1_mm_s },
    Figure { column: "steady_error_mm", label: "steady error, mm", value: |m| Some(1e3 * m.steady_error_m) },
    Figure { column: "hunting_mm", label: "hunting, ± mm", value: |m| Some(1e3 * m.hunting_m) },
    Figure { column: "crossings", label: "crossings of the target", value: |m| Some(f64::from(m.crossings)) },
];

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let base = base(arguments)?;
    let (keys, jobs) = jobs(arguments, &base)?;
    if jobs.len() > MOST_RUNS {
        let text = format!("{} runs are more than {MOST_RUNS}; use coarser grids or fewer samples", jobs.len());
        return Err(CliError::Usage(text));
    }
    // Before the work: one combination that is refused would lose all others.
    let wrong = jobs.par_iter().find_map_first(|job| check(&base, &keys, job).err().map(|error| (job, error)));
    if let Some((job, error)) = wrong {
        return Err(refused(&keys, job, &error.to_string()));
    }
    super::make_folder(&arguments.out)?;
    say!("{} runs of {} s, seed {}", jobs.len(), arguments.duration, arguments.seed);

    let stop = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&stop);
    // Without a handler Ctrl-C simply ends the program.
    let _ = ctrlc::set_handler(move || asked.store(true, Ordering::Relaxed));
    let bar = ProgressBar::new(jobs.len() as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} runs, {per_sec}, {eta} left") {
        bar.set_style(style);
    }
    // Zero is rayon's way of saying one per core.
    let threads = usize::from(arguments.threads.unwrap_or(0));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| CliError::Failed(format!("cannot start {threads} threads: {error}")))?;
    let begin = Instant::now();
    let outcomes = pool.install(|| run_all(&base, &keys, &jobs, &stop, || bar.inc(1)));
    let elapsed_s = begin.elapsed().as_secs_f64();
    bar.finish_and_clear();

    let mut done: Vec<(&Job, &Outcome)> = Vec::new();
    for (job, outcome) in jobs.iter().zip(&outcomes) {
        match outcome {
            Some(Ok(outcome)) => done.push((job, outcome)),
            Some(Err(error)) => return Err(refused(&keys, job, &error.to_string())),
            None => {}
        }
    }
    let table = summary(&done);
    say!("{}", super::text_table(&table));
    if let Ok(fastest_s) = bound_s(&base.rig.rig, &base.rig.effects, base.target_m) {
        say!("the valve of the rig as it stands could make the move in {fastest_s:.3} s (full flow, there and back)");
    }
    let factor = done.len() as f64 * arguments.duration / elapsed_s;
    say!(
        "{} runs in {elapsed_s:.2} s on {} threads: {factor:.0} times real time",
        done.len(),
        pool.current_num_threads()
    );

    let csv = arguments.out.join("sweep.csv");
    write_file(&csv, |out| out.write_all(to_csv(&keys, &done).as_bytes()))?;
    let html = arguments.out.join("sweep.html");
    let responses = responses(&base, &keys, &done).map_err(|(job, error)| refused(&keys, job, &error.to_string()))?;
    let page = page(arguments, &keys, &done, table, responses);
    write_file(&html, |out| out.write_all(page.to_html().as_bytes()))?;
    say!("Results: {}\nReport:  {}", csv.display(), html.display());
    if done.len() < jobs.len() {
        let text = format!("interrupted: {} of {} runs are in the results", done.len(), jobs.len());
        return Err(CliError::Failed(text));
    }
    Ok(())
}

fn base(arguments: &Arguments) -> Result<Base, CliError> {
    super::in_range("--duration", arguments.duration, 0.1, 600.0, "seconds")?;
    let rig = super::read_rig(&arguments.rig.rig)?;
    super::can_be_target("--target", arguments.target, &rig)?;
    let parameters = match &arguments.config {
        Some(path) => controller::read_simulated_parameters(path, &rig)?,
        None => controller::parameters(&rig),
    };
    let settings = LoopSettings { monitor: arguments.monitor, ..LoopSettings::default() };
    Ok(Base { rig, parameters, settings, target_m: arguments.target, duration_s: arguments.duration })
}

fn jobs(arguments: &Arguments, base: &Base) -> Result<(Vec<Key>, Vec<Job>), CliError> {
    let variations = arguments
        .vary
        .iter()
        .map(|text| variation(text).map_err(|problem| CliError::Usage(format!("--vary {text}: {problem}"))))
        .collect::<Result<Vec<_>, _>>()?;
    for (at, variation) in variations.iter().enumerate() {
        if variations[..at].iter().any(|other| other.key.name() == variation.key.name()) {
            return Err(CliError::Usage(format!("--vary names {} twice", variation.key.name())));
        }
    }
    for target in variations.iter().filter(|variation| variation.key.name() == Key::Target.name()) {
        for end in [target.low, target.high] {
            super::between_stops("--vary target_m", end, &base.rig)?;
        }
        if arguments.samples.is_none() && grid(&[*target], 0).iter().any(|job| job.values == [0.0]) {
            super::can_be_target("--vary target_m: the point", 0.0, &base.rig)?;
        }
    }
    let keys = || variations.iter().map(|variation| variation.key).collect::<Vec<_>>();
    match arguments.samples {
        None if variations.is_empty() => {
            Err(CliError::Usage("nothing to vary; give --vary KEY=LOW:HIGH:COUNT, or --samples RUNS".into()))
        }
        None => {
            let total = variations.iter().try_fold(1_usize, |total, v| total.checked_mul(v.count));
            match total {
                Some(total) if total <= MOST_RUNS => Ok((keys(), grid(&variations, arguments.seed))),
                _ => Err(CliError::Usage(format!("the grid has more than {MOST_RUNS} points; use coarser ones"))),
            }
        }
        Some(0) => Err(CliError::Usage("--samples 0 makes no runs; give at least 1".into())),
        Some(samples) if samples > MOST_RUNS => {
            Err(CliError::Usage(format!("--samples {samples} is more than {MOST_RUNS}")))
        }
        Some(samples) if arguments.tolerance || variations.is_empty() => {
            Ok(within_tolerance(base, &variations, samples, arguments.seed))
        }
        Some(samples) => Ok((keys(), random(&variations, samples, arguments.seed))),
    }
}

fn variation(text: &str) -> Result<Variation, String> {
    let shape = "write KEY=LOW:HIGH or KEY=LOW:HIGH:COUNT, e.g. load.mass_kg=2:20:10";
    let (name, range) = text.split_once('=').ok_or(shape)?;
    let key = Key::parse(name.trim())?;
    let parts: Vec<&str> = range.split(':').map(str::trim).collect();
    let number = |text: &str| text.parse::<f64>().ok().filter(|value| value.is_finite()).ok_or(shape);
    let (low, high, count) = match parts[..] {
        [low, high] => (number(low)?, number(high)?, 11),
        [low, high, count] => {
            (number(low)?, number(high)?, count.parse::<usize>().ok().filter(|count| *count > 0).ok_or(shape)?)
        }
        _ => return Err(shape.into()),
    };
    if low > high {
        return Err("the lower end comes first".into());
    }
    Ok(Variation { key, low, high, count })
}

fn refused(keys: &[Key], job: &Job, error: &str) -> CliError {
    let values: Vec<String> =
        keys.iter().zip(&job.values).map(|(key, value)| format!("{} = {}", key.name(), Short(*value))).collect();
    CliError::Input(InputError::new("--vary", format!("{} is refused: {error}", values.join(", ")), "narrow the range"))
}

fn column(done: &[(&Job, &Outcome)], figure: &Figure) -> Vec<f64> {
    done.iter().map(|(_, outcome)| (figure.value)(&outcome.metrics).unwrap_or(f64::NAN)).collect()
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut finite: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    finite.sort_by(f64::total_cmp);
    finite
}

fn summary(done: &[(&Job, &Outcome)]) -> Table {
    let mut table = Table::new(["figure", "happened", "lowest", "5 %", "median", "95 %", "highest"]);
    for figure in &FIGURES {
        let values = sorted(&column(done, figure));
        let at = |part: f64| match values.len() {
            0 => "–".to_string(),
            count => format!("{:.3}", values[((count - 1) as f64 * part).round() as usize]),
        };
        let share = format!("{:.1} %", 100.0 * values.len() as f64 / done.len().max(1) as f64);
        table.row([figure.label.to_string(), share, at(0.0), at(0.05), at(0.5), at(0.95), at(1.0)]);
    }
    let mut ends: BTreeMap<&str, usize> = BTreeMap::new();
    for (_, outcome) in done.iter().filter(|(_, outcome)| outcome.state != "run") {
        *ends.entry(&outcome.state).or_default() += 1;
    }
    for (state, count) in ends {
        let mut row = vec![format!("ended in {state}"), format!("{count} runs")];
        row.resize(7, String::new());
        table.row(row);
    }
    table
}

fn to_csv(keys: &[Key], done: &[(&Job, &Outcome)]) -> String {
    let mut text = String::from("seed");
    for name in keys.iter().map(Key::name).chain(FIGURES.iter().map(|figure| figure.column)).chain(["state"]) {
        text.push(',');
        text.push_str(name);
    }
    text.push('\n');
    for (job, outcome) in done {
        // Writing to a String cannot fail.
        let _ = write!(text, "{}", job.seed);
        for value in &job.values {
            let _ = write!(text, ",{value}");
        }
        for figure in &FIGURES {
            text.push(',');
            if let Some(value) = (figure.value)(&outcome.metrics) {
                let _ = write!(text, "{value}");
            }
        }
        let _ = writeln!(text, ",{}", outcome.state);
    }
    text
}

/// The responses of a grid over one key, at most [`MOST_RESPONSES`] of them, evenly spread; empty for anything else.
fn responses<'a>(
    base: &Base,
    keys: &[Key],
    done: &[(&'a Job, &Outcome)],
) -> Result<Vec<Series>, (&'a Job, plant_sim::LoopError)> {
    let [key] = keys else { return Ok(Vec::new()) };
    let count = done.len().min(MOST_RESPONSES);
    let spread = |k: usize| k * (done.len() - 1) / (count - 1).max(1);
    let chosen = (0..count).filter_map(|k| done.get(spread(k)));
    chosen
        .map(|(job, _)| {
            let (t_s, y_m) = response(base, keys, job).map_err(|error| (*job, error))?;
            let name = format!("{} = {}", key.name(), (job.values[0] * 1e9).round() / 1e9);
            Ok(Series::line(name, t_s, scaled(&y_m, MM)))
        })
        .collect()
}

/// The distribution of each figure over all runs.
fn distributions(page: &mut Page, done: &[(&Job, &Outcome)]) {
    page.section("Distributions");
    let mut plots = Vec::new();
    for figure in &FIGURES {
        let values = sorted(&column(done, figure));
        let count = done.len().max(1) as f64;
        let shares = (1..=values.len()).map(|rank| 100.0 * rank as f64 / count).collect();
        if !values.is_empty() {
            let plot = Plot::new(figure.label, figure.label, "runs at or below, %");
            plots.push(plot.with(Series::curve("runs", values, shares)).y_range(0.0, 100.0).height_px(240));
        }
    }
    page.plots(plots);
}

/// Each figure against each key that was asked to vary; the twenty tolerances of a Monte Carlo would bury it. On a grid over
/// two keys one colour stands for one value of the other key, as far as there are few enough.
fn against(page: &mut Page, arguments: &Arguments, keys: &[Key], done: &[(&Job, &Outcome)]) {
    let happened = |figure: &Figure| column(done, figure).iter().any(|y| y.is_finite());
    for (at, key) in keys.iter().enumerate().take(arguments.vary.len()) {
        page.section(format!("Against {}", key.name()));
        let other = (arguments.samples.is_none() && keys.len() == 2).then_some(1 - at);
        let mut values: Vec<f64> = other.map_or(Vec::new(), |k| sorted(&by_key(done, k)));
        values.dedup();
        let shown = FIGURES.iter().filter(|figure| figure.column != "crossings" && happened(figure));
        let plots = shown.map(|figure| {
            let (x, y) = (by_key(done, at), column(done, figure));
            let mut plot = Plot::new(figure.label, key.name(), figure.label).height_px(240);
            match other {
                Some(k) if values.len() <= MOST_RESPONSES => {
                    for value in &values {
                        let part = |all: &[f64]| -> Vec<f64> {
                            all.iter().zip(done).filter(|(_, d)| d.0.values[k] == *value).map(|(v, _)| *v).collect()
                        };
                        let name = format!("{} = {}", keys[k].name(), (value * 1e9).round() / 1e9);
                        plot = plot.with(Series::curve(name, part(&x), part(&y)));
                    }
                    plot
                }
                _ if arguments.samples.is_none() && keys.len() == 1 => plot.with(Series::curve("run", x, y)),
                _ => plot.with(Series::dots("run", x, y)),
            }
        });
        page.plots(plots.collect());
    }
}

fn by_key(done: &[(&Job, &Outcome)], at: usize) -> Vec<f64> {
    done.iter().map(|(job, _)| job.values[at]).collect()
}

fn page(arguments: &Arguments, keys: &[Key], done: &[(&Job, &Outcome)], table: Table, responses: Vec<Series>) -> Page {
    let mut page = Page::new(format!("Sweep over {}", arguments.rig.rig.display()));
    page.text(format!(
        "{} positioning steps to {} mm, {} s each, seed {}.",
        done.len(),
        arguments.target * 1e3,
        arguments.duration,
        arguments.seed
    ));
    if !arguments.vary.is_empty() {
        page.text(format!("Varied: {}.", arguments.vary.join("; ")));
    }
    if keys.len() > arguments.vary.len() {
        page.text(format!(
            "Drawn within the rig file's tolerance: {} nominal values of the plant.",
            keys.len() - arguments.vary.len()
        ));
    }
    page.table(table.caption("A figure that did not happen in a run (not settled, not risen) is left out of its row."));
    if !responses.is_empty() {
        page.section("Responses");
        let plot = Plot::new("Position", "time, s", "y, mm").height_px(380);
        page.plot(responses.into_iter().fold(plot, Plot::with));
    }
    // On a grid the figures depend on where in it; their distribution says little more than which grid was asked for.
    if arguments.samples.is_none() {
        against(&mut page, arguments, keys, done);
        distributions(&mut page, done);
    } else {
        distributions(&mut page, done);
        against(&mut page, arguments, keys, done);
    }
    page
}
