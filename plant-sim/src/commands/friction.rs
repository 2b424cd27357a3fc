//! `plant-sim friction`: what friction depends on, from logs with a measured force.

use super::CliError;
use diagnosis::{Finding, FrictionMap, FrictionMapError, friction_map};
use plant_sim::charts::{BAR, MM};
use plant_sim::import::Mapping;
use report_html::{Marker, Page, Plot, Series, Table, Tone};
use rig_files::{InputError, Log, RigFile, write_file};
use std::path::PathBuf;

/// Map friction from slow strokes with a measured force: its growth with pressure, direction, ripple along the stroke.
///
/// Area times pressure plus measured force is friction, which has the sign of the motion, plus any force that keeps its
/// sign when the motion reverses. Give several recordings at different pressures: a dependence is reported as
/// established only if it exceeds the scatter between recordings and improves the prediction of recordings left out of
/// the fit. Writes DIR/friction.json and DIR/friction.html.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  \
    plant-sim friction --rig examples/rigs/piston-friction.toml --map examples/mappings/piston-friction.toml \\\n    \
    --log examples/data/piston-friction/circle_*.csv --out out/friction")]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: super::RigArgument,
    /// Logs (CSV) with y_m, f_ext_n and at least one of p_a_pa and p_b_pa
    #[arg(long, value_name = "FILE", num_args = 1.., required = true)]
    log: Vec<PathBuf>,
    /// Mapping file (TOML) if the logs are foreign tables, as for `plant-sim import`
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = RigFile::read(&arguments.rig.rig)?;
    let mapping = arguments.map.as_deref().map(Mapping::read).transpose()?;
    let read = |path: &PathBuf| match &mapping {
        Some(mapping) => mapping.convert_file(path),
        None => Log::read(path),
    };
    let logs = arguments.log.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let refused = |error: FrictionMapError| {
        let (FrictionMapError::Missing { log, .. } | FrictionMapError::NoMotion { log }) = error;
        let text = error.to_string();
        let (problem, remedy) = text.split_once(": ").unwrap_or((&text, "record it"));
        CliError::Input(InputError::new(arguments.log[log].display().to_string(), problem, remedy))
    };
    let map = friction_map(&rig, &logs.iter().collect::<Vec<_>>()).map_err(refused)?;
    let failed = |error: serde_json::Error| CliError::Failed(format!("cannot be written as JSON: {error}"));
    let json = serde_json::to_string_pretty(&map).map_err(failed)? + "\n";
    let sentences = sentences(&map, &rig);
    let page = page(&map, &sentences);
    super::make_folder(&arguments.out)?;
    let write = |name: &str, text: &str| write_file(&arguments.out.join(name), |out| out.write_all(text.as_bytes()));
    write("friction.html", &page.to_html())?;
    write("friction.json", &json)?;
    say!("{}", super::text_table(&runs_table(&map)));
    for sentence in &sentences {
        say!("- {sentence}");
    }
    say!("\n{}", super::text_table(&stage_table(&map)));
    say!("Report: {}", arguments.out.join("friction.html").display());
    Ok(())
}

fn value(finding: &Finding, factor: f64) -> String {
    if finding.std_error.is_finite() {
        format!("{:.2} ± {:.2}", finding.value * factor, finding.std_error * factor)
    } else {
        format!("{:.2}", finding.value * factor)
    }
}

/// What the recordings establish, and what they leave open.
fn sentences(map: &FrictionMap, rig: &RigFile) -> Vec<String> {
    let mut out = Vec::new();
    let count = map.runs.len();
    if map.pressure_n_per_pa.established {
        out.push(format!(
            "Friction grows with pressure: {} N plus {} N for each bar across the piston.",
            value(&map.friction_n, 1.0),
            value(&map.pressure_n_per_pa, 1.0 / BAR)
        ));
    } else if count < 3 {
        out.push(format!(
            "{count} recording(s) cannot establish a dependence on pressure: record at three or more pressures."
        ));
    } else {
        out.push(format!(
            "A growth of friction with pressure is not established: {} N/bar.",
            value(&map.pressure_n_per_pa, 1.0 / BAR)
        ));
    }
    let speed = value(&map.speed_n_s_per_m, 1.0e-3);
    out.push(if map.speed_n_s_per_m.established {
        format!("At equal pressure, runs at higher speed show more friction: {speed} N per mm/s.")
    } else {
        format!("A dependence on speed is not established between these runs: {speed} N per mm/s at equal pressure.")
    });
    if map.bias_n.established {
        out.push(format!(
            "The two directions differ: the force loop is off centre by {} N. It may be friction that is {:.0} % {} towards +y \
             than on average, or a constant force or \
             a zero error of the force sensor, or an area {:+.1} % off: recordings at constant pressure \
             cannot tell these apart. Turn the piston round, or record at zero pressure, to find out.",
            value(&map.bias_n, 1.0),
            100.0 * map.asymmetry.abs(),
            if map.asymmetry < 0.0 { "smaller" } else { "larger" },
            100.0 * map.area_error
        ));
        let tolerance = rig.tolerance.of("cylinder.area_m2");
        if map.area_error.abs() < 2.0 * tolerance && !map.bias_n_per_pa.established {
            out.push(format!(
                "An area {:+.1} % off would lie within the rig file's tolerance of {:.0} %, but the offset is not shown to \
                 grow with pressure ({} N/bar), as it then should.",
                100.0 * map.area_error,
                100.0 * tolerance,
                value(&map.bias_n_per_pa, 1.0 / BAR)
            ));
        }
    } else {
        out.push(format!(
            "A difference between the directions is not established: {} N off centre.",
            value(&map.bias_n, 1.0)
        ));
    }
    match &map.ripple {
        Some(line) => out.push(format!(
            "The force ripples along the stroke every {:.2} ± {:.2} mm with {:.2} ± {:.2} N, {:.1} times the spectrum around \
             it; it predicts {:.0} % of the variance along the stroke in second halves of recordings, better than without \
             it in {} of {count}. It {}.",
            line.wavelength_m * MM,
            line.resolution_m * MM,
            line.amplitude_n,
            line.amplitude_spread_n,
            line.prominence,
            100.0 * line.holdout_gain,
            line.better_in,
            if line.turns_with_motion {
                "changes its sign when the motion reverses, as friction does"
            } else {
                "keeps its sign when the motion reverses: a force of the drive or the guide (a lead screw, for example) \
                 rather than friction"
            }
        )),
        None => out.push("No ripple along the stroke stands out in the spectrum.".to_string()),
    }
    out
}

fn runs_table(map: &FrictionMap) -> Table {
    let mut table =
        Table::new(["pressure, bar", "speed, mm/s", "friction, N", "off centre, N", "ripple, N", "samples"]);
    for run in &map.runs {
        table.row([
            format!("{:.2}", run.pressure_pa * BAR),
            format!("{:.1}", run.speed_m_per_s * MM),
            format!("{:.2}", run.friction_n),
            format!("{:+.2}", run.bias_n),
            format!("{:.2}", run.ripple_n),
            run.samples.to_string(),
        ]);
    }
    table
}

fn stage_table(map: &FrictionMap) -> Table {
    let mut table = Table::new(["model", "error on recordings left out, N", "gain, %", "kept"]);
    let mut before: Option<f64> = None;
    for stage in &map.stages {
        let gain =
            before.map_or("–".to_string(), |b: f64| format!("{:+.0}", 100.0 * (1.0 - stage.holdout_rmse_n / b)));
        table.row([
            stage.model.to_string(),
            format!("{:.2}", stage.holdout_rmse_n),
            gain,
            if stage.kept { "yes" } else { "no" }.to_string(),
        ]);
        before = Some(stage.holdout_rmse_n);
    }
    table
}

fn page(map: &FrictionMap, sentences: &[String]) -> Page {
    let mut page = Page::new("What friction depends on");
    page.callout(Tone::Neutral, sentences.first().cloned().unwrap_or_default());
    page.block(report_html::Block::List(sentences.iter().skip(1).cloned().collect()));
    let x: Vec<f64> = map.runs.iter().map(|run| run.pressure_pa * BAR).collect();
    let highest = x.iter().copied().fold(0.0, f64::max);
    let at = |p_bar: f64| map.friction_n.value + map.pressure_n_per_pa.value * p_bar / BAR;
    let mut plots = vec![
        Plot::new("Friction (half the force loop) against pressure", "pressure across the piston, bar", "friction, N")
            .with(Series::dots("recordings", x.clone(), map.runs.iter().map(|run| run.friction_n).collect()))
            .with(Series::line("line through all", vec![0.0, highest], vec![at(0.0), at(highest)]).dashed()),
        Plot::new("Force that keeps its sign when the motion reverses", "pressure across the piston, bar", "force, N")
            .with(Series::dots("recordings", x, map.runs.iter().map(|run| run.bias_n).collect()))
            .marker(Marker::Horizontal(0.0)),
    ];
    if !map.spectrum.is_empty() {
        let mut points: Vec<(f64, f64)> = map.spectrum.iter().map(|(w, part)| (w * MM, 100.0 * part)).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (x, y) = points.into_iter().unzip();
        let mut plot = Plot::new("Ripple along the stroke", "wavelength, mm", "explained, % of the variance")
            .with(Series::line("mean over the recordings", x, y));
        if let Some(line) = &map.ripple {
            plot = plot.marker(Marker::Vertical(line.wavelength_m * MM));
        }
        plots.push(plot);
    }
    if let Some((run, points)) = map.runs.iter().zip(&map.scatter).next_back() {
        let of = |sign: f64| -> (Vec<f64>, Vec<f64>) {
            points.iter().filter(|p| p.2 == sign).map(|p| (p.0 * MM, p.1)).unzip()
        };
        let ((x1, y1), (x2, y2)) = (of(1.0), of(-1.0));
        plots.push(
            Plot::new(
                format!("Force loop at {:.1} bar", run.pressure_pa * BAR),
                "position, mm",
                "area × pressure + force, N",
            )
            .with(Series::dots("towards +y", x1, y1))
            .with(Series::dots("towards −y", x2, y2))
            .marker(Marker::Horizontal(0.0)),
        );
    }
    page.plots(plots);
    page.section("The recordings");
    page.table(runs_table(map));
    page.section("What each dependence gains");
    page.table(stage_table(map).caption(
        "Every recording is predicted from the others. The phase of the ripple depends on the recording's zero: its first \
         half gives it, the second half is predicted. It is kept for what it gains along the stroke, see above.",
    ));
    page
}
