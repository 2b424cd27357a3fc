//! `plant-sim run`: a positioning step on several rigs, under the positioning law and under the paper's, beside the fastest move
//! that the valve allows; as a table, a report and a picture.

use super::CliError;
use control::{Key, LawChoice, Mode, Parameters, Reason};
use plant_sim::bound::bound_s;
use plant_sim::charts;
use plant_sim::controller;
use plant_sim::emulated::positioning;
use plant_sim::learned;
use plant_sim::metrics::StepMetrics;
use plant_sim::recording::Recording;
use plant_sim::{ConversionNoise, LoopSettings, MonitorAction};
use report_html::{Page, Plot, Table, Tone, svg};
use rig_files::{InputError, Log, RigFile, write_file};
use std::path::{Path, PathBuf};

/// Position one or several rigs under the firmware's own control laws; this is what plant-sim does without a command.
///
/// Plant, sensors with noise, converters with quantisation and oversampling, the firmware's fixed-point control tick, DAC
/// and valve form one loop. By default the three cylinders of the paper move to its target of 45 mm, under the positioning law and
/// under the paper's proportional law, and a table compares both with the fastest move the valve allows (full flow,
/// there and back). The report is one HTML file with plots to zoom and hover that works offline.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLES\n  \
    plant-sim run\n  \
    plant-sim run --rig rigs/real-mpye.toml --gain 8 --target 0.1 --duration 4\n  \
    plant-sim run --noise-position 0 --noise-pressure 0 --seed 7 --logs\n  \
    plant-sim run --rig rigs/paper-a.toml --elf target/thumbv7em-none-eabihf/firmware/firmware")]
pub(crate) struct Arguments {
    /// Rig file (TOML); repeat it to compare rigs. By default the paper's three cylinders
    #[arg(long, value_name = "FILE")]
    rig: Vec<PathBuf>,
    /// Controller file (TOML) that replaces the values derived from the rig
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Proportional gain of the paper's law, V/m (default: that of the controller file, else 4)
    #[arg(long, value_name = "V_PER_M", allow_negative_numbers = true)]
    gain: Option<f32>,
    /// Target position, m from mid-stroke
    #[arg(long, value_name = "METRES", default_value_t = 0.045, allow_negative_numbers = true, value_parser = super::plain_number)]
    target: f64,
    /// Length of the run, s
    #[arg(long, value_name = "SECONDS", default_value_t = 6.0, allow_negative_numbers = true, value_parser = super::plain_number)]
    duration: f64,
    /// Standard deviation of the position sensor's noise, m
    #[arg(long, value_name = "METRES", default_value_t = ConversionNoise::default().position_m, allow_negative_numbers = true, value_parser = super::plain_number)]
    noise_position: f64,
    /// Standard deviation of the pressure sensors' noise, Pa
    #[arg(long, value_name = "PASCAL", default_value_t = ConversionNoise::default().pressure_pa, allow_negative_numbers = true, value_parser = super::plain_number)]
    noise_pressure: f64,
    /// Seed of the noise
    #[arg(long, default_value_t = 1, allow_negative_numbers = true)]
    seed: u64,
    /// What the controller's model monitor does when the readings contradict the rig's nominal values. On the board it trips
    #[arg(long, value_name = "ACTION", value_enum, default_value_t)]
    monitor: MonitorAction,
    /// The firmware's ELF file: it runs the loop, on the emulated chip (docs/emulator.md), instead of the loop on this computer. With
    /// --logs, the log is made of its telemetry
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Folder for the report, the picture and the logs
    #[arg(long, value_name = "FOLDER", default_value = "out")]
    out: PathBuf,
    /// Also write, per rig, what the controller's sensors showed and the true states, as logs (CSV)
    #[arg(long)]
    logs: bool,
}

/// The picture shows this much of a run, s.
const PICTURE_S: f64 = 2.0;

struct Run {
    /// Of the rig.
    rig: String,
    law: LawChoice,
    /// What no law on this valve beats, s.
    bound_s: f64,
    recording: Recording,
    /// What the firmware has sent, if the firmware ran the loop.
    telemetry: Option<Log>,
    metrics: StepMetrics,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    check(arguments)?;
    let rigs = if arguments.rig.is_empty() {
        vec![RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()]
    } else {
        arguments.rig.iter().map(|path| super::read_rig(path)).collect::<Result<_, _>>()?
    };
    let settings = LoopSettings {
        noise: ConversionNoise { position_m: arguments.noise_position, pressure_pa: arguments.noise_pressure },
        seed: arguments.seed,
        monitor: arguments.monitor,
        ..LoopSettings::default()
    };
    let elf = arguments.elf.as_deref().map(read_elf).transpose()?;
    super::make_folder(&arguments.out)?;
    let mut runs = Vec::new();
    for rig in &rigs {
        runs.extend(position(rig, arguments, &settings, elf.as_deref())?);
    }

    let table = table(&runs);
    say!("{}", super::text_table(&table));
    let learned = learned(&runs);
    if let Some(learned) = &learned {
        say!("{}", super::text_table(learned));
    }
    for warning in warnings(&runs) {
        eprintln!("warning: {warning}");
    }

    let report = arguments.out.join("run.html");
    let page = page(&runs, table, learned, arguments);
    write_file(&report, |out| out.write_all(page.to_html().as_bytes()))?;
    let picture = arguments.out.join("run.svg");
    write_file(&picture, |out| out.write_all(picture_of(&runs, arguments)?.as_bytes()))?;
    say!("Report:  {}", report.display());
    say!("Picture: {}", picture.display());
    if arguments.logs {
        for run in &runs {
            let path = arguments.out.join(format!("{}.csv", super::file_name(&run.name())));
            run.telemetry.clone().unwrap_or_else(|| run.recording.to_log()).write(&path)?;
            say!("Log:     {}", path.display());
            let path = arguments.out.join(format!("{}-true.csv", super::file_name(&run.name())));
            run.recording.to_true_log().write(&path)?;
            say!("States:  {}", path.display());
        }
    }
    Ok(())
}

fn check(arguments: &Arguments) -> Result<(), CliError> {
    super::in_range("--duration", arguments.duration, 0.1, 600.0, "seconds")?;
    if let Some(gain) = arguments.gain {
        let gains = &Key::gain_v_per_m.row().limits;
        super::in_range("--gain", gain.into(), gains.low, gains.high, gains.unit)?;
    }
    let positions = &Key::position_range_m.row().limits;
    super::in_range("--target", arguments.target, positions.low, positions.high, "metres from mid-stroke")?;
    super::in_range("--noise-position", arguments.noise_position, 0.0, 0.1, "metres")?;
    super::in_range("--noise-pressure", arguments.noise_pressure, 0.0, 1.0e6, "pascals")?;
    Ok(())
}

fn read_elf(path: &Path) -> Result<Vec<u8>, CliError> {
    std::fs::read(path).map_err(|error| InputError::unreadable(&path.display().to_string(), &error).into())
}

/// The runs of one rig: under the positioning law, unless the controller file chooses the paper's, and under the paper's.
fn position(
    rig: &RigFile,
    arguments: &Arguments,
    settings: &LoopSettings,
    elf: Option<&[u8]>,
) -> Result<Vec<Run>, CliError> {
    super::can_be_target("--target", arguments.target, rig)?;
    let chosen = match &arguments.config {
        Some(path) => controller::read_simulated_parameters(path, rig)?,
        None => controller::parameters(rig),
    };
    let gain_v_per_m = arguments.gain.unwrap_or(chosen.gain_v_per_m);
    let papers = Parameters { law: LawChoice::Paper, gain_v_per_m, ..chosen.clone() };
    let laws = if chosen.law == LawChoice::Paper { vec![papers] } else { vec![chosen, papers] };
    let wrong = |problem: String| InputError::new(&rig.name, problem, "correct the value");
    let bound_s = bound_s(&rig.rig, &rig.effects, arguments.target).map_err(|error| wrong(error.to_string()))?;
    let ticks = (arguments.duration * f64::from(rig.io.tick_hz)).round() as usize + 1;
    let run = |parameters: &Parameters| {
        let (recording, telemetry) = match (elf, &arguments.elf) {
            (Some(elf), Some(path)) => {
                let file = path.display().to_string();
                let done = positioning::position((elf, &file), rig, parameters, settings, ticks, arguments.target);
                let done = done.map_err(|error| CliError::Usage(format!("{file}, {}: {error}", rig.name)))?;
                let (instructions, cycles) = done.most;
                say!(
                    "{}, {}: at most {instructions} instructions, {cycles} estimated cycles to the valve code",
                    rig.name,
                    law(parameters.law)
                );
                (done.recording, Some(done.telemetry))
            }
            _ => {
                let run = Recording::run(rig, parameters, settings, ticks, |_| arguments.target);
                (run.map_err(|error| wrong(error.to_string()))?, None)
            }
        };
        let metrics = recording.step_metrics(arguments.target);
        Ok(Run { rig: rig.name.clone(), law: parameters.law, bound_s, recording, telemetry, metrics })
    };
    laws.iter().map(run).collect()
}

impl Run {
    /// Rig and law, as file names and sentences name a run.
    fn name(&self) -> String {
        match self.law {
            LawChoice::Servo => self.rig.clone(),
            LawChoice::Paper => format!("{}, {}", self.rig, law(self.law)),
        }
    }
}

fn law(law: LawChoice) -> &'static str {
    match law {
        LawChoice::Servo => "positioning law",
        LawChoice::Paper => "paper's law",
    }
}

/// What a reader of the table must know: a controller that did not run to the end, or whose monitor disagreed.
fn warnings(runs: &[Run]) -> Vec<String> {
    let mut warnings = Vec::new();
    for run in runs {
        let (name, recording) = (run.name(), &run.recording);
        if recording.mode != Mode::Run {
            warnings.push(format!("{name}: the controller ended in `{}`", recording.mode));
        }
        if let Some(t_s) = recording.contradicted_s {
            let then = if recording.mode == Mode::Safe(Reason::ModelDisagreement) {
                "with `--monitor warn` the controller runs on"
            } else {
                "on the board this leads to the safe state by default"
            };
            warnings.push(format!(
                "{name}: at {t_s:.3} s the model monitor finds that the readings contradict the rig's nominal values; {then}"
            ));
        }
    }
    warnings
}

fn table(runs: &[Run]) -> Table {
    let seconds = |time: Option<f64>| time.map_or("–".to_string(), |time| format!("{time:.3}"));
    let mut table = Table::new([
        "rig",
        "law",
        "fastest possible, s",
        "settled to 0.1 mm, s",
        "rise 10–90 %, s",
        "overshoot, %",
        "settled to 2 %, s",
        "steady error, mm",
        "hunting, ± mm",
    ]);
    for Run { rig, law: choice, bound_s, metrics, .. } in runs {
        table.row([
            rig.clone(),
            law(*choice).to_owned(),
            seconds(Some(*bound_s).filter(|time| time.is_finite())),
            seconds(metrics.settling_0_1_mm_s),
            seconds(metrics.rise_s),
            format!("{:.1}", 100.0 * metrics.overshoot),
            seconds(metrics.settling_2_percent_s),
            format!("{:.3}", 1e3 * metrics.steady_error_m),
            format!("{:.3}", 1e3 * metrics.hunting_m),
        ]);
    }
    table
}

/// What the positioning law had learned by the end of each of its runs.
fn learned(runs: &[Run]) -> Option<Table> {
    let learned: Vec<_> = runs.iter().filter_map(|run| Some((&*run.rig, run.recording.learned.as_ref()?))).collect();
    (!learned.is_empty()).then(|| learned::comparison(learned))
}

/// A plot for each rig, its runs up to `to_s`.
fn comparisons(runs: &[Run], arguments: &Arguments, to_s: f64) -> Vec<Plot> {
    runs.chunk_by(|a, b| a.rig == b.rig)
        .map(|of_rig| {
            let named: Vec<_> = of_rig.iter().map(|run| (law(run.law), &run.recording)).collect();
            charts::comparison(&of_rig[0].rig, &named, arguments.target, of_rig[0].bound_s, to_s)
        })
        .collect()
}

fn page(runs: &[Run], table: Table, learned: Option<Table>, arguments: &Arguments) -> Page {
    let target_mm = arguments.target * 1e3;
    let mut page = Page::new(format!("Positioning step to {target_mm} mm"));
    page.text(
        if arguments.elf.is_some() {
            "The flashed firmware on the emulated chip positions simulated pneumatic cylinders: its converter reads the sensors with \
             their noise, its output drives the valve."
        } else {
            "The firmware's fixed-point control law positions simulated pneumatic cylinders: sensors with noise, converters \
             with quantisation and oversampling, one tick of output delay, valve, chambers, friction."
        },
    );
    for warning in warnings(runs) {
        page.callout(Tone::Bad, format!("{warning}."));
    }
    page.table(table.caption(
        "Fastest possible: full flow of the valve there and back, with the rig's dead zone, lag and friction; the vertical line in \
         the plots. Settling: the time after which the error stays within the band; – means that it does not within the run. \
         Steady error and hunting are taken from the last third.",
    ));
    if let Some(learned) = learned {
        page.table(learned.caption(
            "What the positioning law had learned by the end, over the rig file's nominal values: it lies between the limits of the first \
             line, and changes only while the motion shows it.",
        ));
    }
    page.plots(comparisons(runs, arguments, arguments.duration));
    let names: Vec<String> = runs.iter().map(Run::name).collect();
    let named: Vec<_> = names.iter().map(String::as_str).zip(runs.iter().map(|run| &run.recording)).collect();
    page.plot(charts::errors(&named, arguments.target, arguments.duration * 2.0 / 3.0));
    for (name, recording) in named {
        page.section(name);
        page.plots(charts::details(name, recording));
    }
    page.section("How to repeat it");
    page.block(report_html::Block::Code(command_line(arguments)));
    page
}

fn command_line(arguments: &Arguments) -> String {
    let mut text = String::from("plant-sim run");
    for rig in &arguments.rig {
        text += &format!(" --rig {}", rig.display());
    }
    if let Some(config) = &arguments.config {
        text += &format!(" --config {}", config.display());
    }
    if let Some(gain) = arguments.gain {
        text += &format!(" --gain {gain}");
    }
    text += &format!(" --target {} --duration {}", arguments.target, arguments.duration);
    text += &format!(" --noise-position {} --noise-pressure {}", arguments.noise_position, arguments.noise_pressure);
    text += &format!(" --seed {}", arguments.seed);
    if let Some(elf) = &arguments.elf {
        text += &format!(" --elf {}", elf.display());
    }
    match arguments.monitor {
        MonitorAction::Trip => text,
        MonitorAction::Warn => text + " --monitor warn",
        MonitorAction::Off => text + " --monitor off",
    }
}

fn picture_of(runs: &[Run], arguments: &Arguments) -> std::io::Result<String> {
    svg(&comparisons(runs, arguments, arguments.duration.min(PICTURE_S)), 3.min(rigs(runs)), 440)
        .map_err(std::io::Error::other)
}

fn rigs(runs: &[Run]) -> usize {
    runs.chunk_by(|a, b| a.rig == b.rig).count()
}

/// The arguments of `plant-sim` without a command.
pub(crate) fn defaults() -> Arguments {
    #[derive(clap::Parser)]
    struct Alone {
        #[command(flatten)]
        arguments: Arguments,
    }
    <Alone as clap::Parser>::parse_from(["plant-sim"]).arguments
}
