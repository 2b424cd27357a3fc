//! `plant-sim run`: the positioning step of the paper on several rigs, as a table, a report and a picture.

use super::CliError;
use control::{Key, LawChoice, Mode, Reason};
use plant_sim::charts;
use plant_sim::controller;
use plant_sim::emulated::positioning;
use plant_sim::metrics::StepMetrics;
use plant_sim::recording::Recording;
use plant_sim::{ConversionNoise, LoopSettings, MonitorAction};
use report_html::{Page, Table, Tone, svg};
use rig_files::{InputError, Log, RigFile, write_file};
use std::path::{Path, PathBuf};

/// Position one or several rigs under the firmware's own control law; this is what plant-sim does without a command.
///
/// Plant, sensors with noise, converters with quantisation and oversampling, the firmware's fixed-point control tick, DAC
/// and valve form one loop. By default the three cylinders of the paper move to its target of 45 mm at 4 V/m. A table is
/// printed; the report is one HTML file with plots to zoom and hover that works offline.
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
    /// The paper's law with this proportional gain, V/m; by default the law of the controller file, else the positioning law
    #[arg(long, value_name = "V_PER_M", allow_negative_numbers = true)]
    gain: Option<f32>,
    /// Target position, m from mid-stroke
    #[arg(long, value_name = "METRES", default_value_t = 0.045, allow_negative_numbers = true)]
    target: f64,
    /// Length of the run, s
    #[arg(long, value_name = "SECONDS", default_value_t = 6.0, allow_negative_numbers = true)]
    duration: f64,
    /// Standard deviation of the position sensor's noise, m
    #[arg(long, value_name = "METRES", default_value_t = ConversionNoise::default().position_m, allow_negative_numbers = true)]
    noise_position: f64,
    /// Standard deviation of the pressure sensors' noise, Pa
    #[arg(long, value_name = "PASCAL", default_value_t = ConversionNoise::default().pressure_pa, allow_negative_numbers = true)]
    noise_pressure: f64,
    /// Seed of the noise
    #[arg(long, default_value_t = 1)]
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

struct Run {
    name: String,
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
        arguments.rig.iter().map(|path| RigFile::read(path)).collect::<Result<_, _>>()?
    };
    let settings = LoopSettings {
        noise: ConversionNoise { position_m: arguments.noise_position, pressure_pa: arguments.noise_pressure },
        seed: arguments.seed,
        monitor: arguments.monitor,
        ..LoopSettings::default()
    };
    super::make_folder(&arguments.out)?;
    let mut runs = Vec::new();
    let elf = arguments.elf.as_deref().map(read_elf).transpose()?;
    for rig in &rigs {
        runs.push(position(rig, arguments, &settings, elf.as_deref())?);
    }

    let table = table(&runs);
    say!("{}", super::text_table(&table));
    for warning in warnings(&runs) {
        eprintln!("warning: {warning}");
    }

    let report = arguments.out.join("run.html");
    let page = page(&runs, table, arguments);
    write_file(&report, |out| out.write_all(page.to_html().as_bytes()))?;
    let picture = arguments.out.join("run.svg");
    write_file(&picture, |out| out.write_all(picture_of(&runs, arguments)?.as_bytes()))?;
    say!("Report:  {}", report.display());
    say!("Picture: {}", picture.display());
    if arguments.logs {
        for run in &runs {
            let path = arguments.out.join(format!("{}.csv", super::file_name(&run.name)));
            run.telemetry.clone().unwrap_or_else(|| run.recording.to_log()).write(&path)?;
            say!("Log:     {}", path.display());
            let path = arguments.out.join(format!("{}-true.csv", super::file_name(&run.name)));
            run.recording.to_true_log().write(&path)?;
            say!("States:  {}", path.display());
        }
    }
    Ok(())
}

fn check(arguments: &Arguments) -> Result<(), CliError> {
    super::in_range("--duration", arguments.duration, 0.1, 600.0, "seconds")?;
    let positions = &Key::position_range_m.row().limits;
    super::in_range("--target", arguments.target, positions.low, positions.high, "metres from mid-stroke")?;
    super::in_range("--noise-position", arguments.noise_position, 0.0, 0.1, "metres")?;
    super::in_range("--noise-pressure", arguments.noise_pressure, 0.0, 1.0e6, "pascals")?;
    if arguments.target == 0.0 {
        return Err(CliError::Usage("--target 0 is where the piston starts; choose another position".into()));
    }
    Ok(())
}

fn read_elf(path: &Path) -> Result<Vec<u8>, CliError> {
    std::fs::read(path).map_err(|error| InputError::unreadable(&path.display().to_string(), &error).into())
}

fn position(
    rig: &RigFile,
    arguments: &Arguments,
    settings: &LoopSettings,
    elf: Option<&[u8]>,
) -> Result<Run, CliError> {
    let half_m = rig.rig.cylinder.stroke_m / 2.0;
    if arguments.target.abs() > half_m {
        let text = format!("--target {} is beyond the end stops of {} (±{half_m} m)", arguments.target, rig.name);
        return Err(CliError::Usage(text));
    }
    let mut parameters = match &arguments.config {
        Some(path) => controller::read_parameters(path, rig)?,
        None => controller::parameters(rig),
    };
    if let Some(gain) = arguments.gain {
        (parameters.law, parameters.gain_v_per_m) = (LawChoice::Paper, gain);
    }
    let ticks = (arguments.duration * f64::from(rig.io.tick_hz)).round() as usize + 1;
    let (recording, telemetry) = match (elf, &arguments.elf) {
        (Some(elf), Some(path)) => {
            let file = path.display().to_string();
            let done = positioning::position((elf, &file), rig, &parameters, settings, ticks, arguments.target);
            let done = done.map_err(|error| CliError::Usage(format!("{file}, {}: {error}", rig.name)))?;
            let (instructions, cycles) = done.most;
            say!("{}: at most {instructions} instructions, {cycles} estimated cycles to the valve code", rig.name);
            (done.recording, Some(done.telemetry))
        }
        _ => {
            let run = Recording::run(rig, &parameters, settings, ticks, |_| arguments.target);
            (run.map_err(|error| InputError::new(&rig.name, error.to_string(), "correct the value"))?, None)
        }
    };
    let metrics = recording.step_metrics(arguments.target);
    Ok(Run { name: rig.name.clone(), recording, telemetry, metrics })
}

/// What a reader of the table must know: a controller that did not run to the end, or whose monitor disagreed.
fn warnings(runs: &[Run]) -> Vec<String> {
    let mut warnings = Vec::new();
    for Run { name, recording, .. } in runs {
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
        "rise 10–90 %, s",
        "overshoot, %",
        "settled to 2 %, s",
        "settled to 0.1 mm, s",
        "steady error, mm",
        "hunting, ± mm",
    ]);
    for Run { name, metrics, .. } in runs {
        table.row([
            name.clone(),
            seconds(metrics.rise_s),
            format!("{:.1}", 100.0 * metrics.overshoot),
            seconds(metrics.settling_2_percent_s),
            seconds(metrics.settling_0_1_mm_s),
            format!("{:.3}", 1e3 * metrics.steady_error_m),
            format!("{:.3}", 1e3 * metrics.hunting_m),
        ]);
    }
    table
}

fn named(runs: &[Run]) -> Vec<(&str, &Recording)> {
    runs.iter().map(|run| (run.name.as_str(), &run.recording)).collect()
}

fn page(runs: &[Run], table: Table, arguments: &Arguments) -> Page {
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
        "Settling: the time after which the error stays within the band; – means that it does not within the run. \
         Steady error and hunting are taken from the last third.",
    ));
    page.plot(charts::positions(&named(runs), arguments.target));
    page.plot(charts::errors(&named(runs), arguments.target, arguments.duration * 2.0 / 3.0));
    for run in runs {
        page.section(run.name.clone());
        page.plots(charts::details(&run.name, &run.recording));
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
    let named = named(runs);
    let mut plots = vec![charts::positions(&named, arguments.target).height_px(340)];
    if let Some((name, run)) = named.first() {
        plots.push(charts::pressures(&format!("Chamber pressures, {name}"), run).height_px(340));
    }
    svg(&plots, 2, 560).map_err(std::io::Error::other)
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
