//! `plant-sim friction`: what friction depends on, from logs with a measured force.

use super::CliError;
use diagnosis::{Finding, FrictionMap, FrictionMapError, OffCentre, friction_map};
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
    let rig = super::read_rig(&arguments.rig.rig)?;
    let mapping = arguments.map.as_deref().map(Mapping::read).transpose()?;
    let read = |path: &PathBuf| match &mapping {
        Some(mapping) => mapping.convert_file(path),
        None => Log::read(path),
    };
    let logs = arguments.log.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let refused = |error: FrictionMapError| {
        let (FrictionMapError::Missing { log, .. }
        | FrictionMapError::NoMotion { log }
        | FrictionMapError::Reversed { log }) = error;
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
            "Friction grows with pressure: {} N plus {} N for each bar, both chambers together.",
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
    out.push(speed_sentence(map));
    out.push(off_centre_sentence(map, rig));
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

/// What is known about speed, and over which speeds.
fn speed_sentence(map: &FrictionMap) -> String {
    let lowest = map.runs.iter().map(|run| run.speed_range_m_per_s[0]).fold(f64::INFINITY, f64::min);
    let highest = map.runs.iter().map(|run| run.speed_range_m_per_s[1]).fold(0.0, f64::max);
    let covered = format!("speeds from {:.1} to {:.1} mm/s", lowest * MM, highest * MM);
    let speed = value(&map.speed_n_s_per_m, 1.0e-3);
    match (map.speed_n_s_per_m.established, map.speed_inside_recordings) {
        (true, true) => format!("Friction grows with speed, inside the recordings ({covered}): {speed} N per mm/s."),
        (true, false) => {
            format!("At equal pressure, runs at higher speed show more friction ({covered}): {speed} N per mm/s.")
        }
        (false, true) => {
            format!("A dependence on speed is not established inside the recordings ({covered}): {speed} N per mm/s.")
        }
        (false, false) => format!(
            "A dependence on speed is not established between these runs ({covered}): {speed} N per mm/s at equal \
             pressure. Record at speeds that do not follow the pressure."
        ),
    }
}

/// What the force is that keeps its sign when the motion reverses.
fn off_centre_sentence(map: &FrictionMap, rig: &RigFile) -> String {
    let area = || {
        let (off, tolerance) = (map.area_error.value, rig.tolerance.of("cylinder.area_m2"));
        format!(
            "by {} N for each bar: the pressure acts on an area {} % off the rig file's, {} its tolerance of {:.1} %, or a \
             gain of the force or pressure sensor is off",
            value(&Finding { value: -off, ..map.area_error }, rig.rig.cylinder.mean_area_m2() / BAR),
            value(&map.area_error, 100.0),
            if off.abs() > tolerance { "beyond" } else { "within" },
            100.0 * tolerance
        )
    };
    let force = || format!("{} N", value(&map.bias_n, 1.0));
    let direction = || {
        format!(
            "friction is {} % {} towards +y than on average",
            value(&Finding { value: map.asymmetry.value.abs(), ..map.asymmetry }, 100.0),
            if map.asymmetry.value < 0.0 { "smaller" } else { "larger" }
        )
    };
    let Some(likeliest) = map.off_centre else {
        return format!(
            "No force that keeps its sign when the motion reverses is established: {} N off centre.",
            value(&map.bias_n, 1.0)
        );
    };
    let found = match likeliest {
        OffCentre::ConstantForce => format!(
            "The force loop is off centre by {} at every pressure: a constant force, or a zero error of the force sensor.",
            force()
        ),
        OffCentre::Area => format!("The force loop's centre moves with pressure, {}.", area()),
        OffCentre::Direction => format!("The two directions differ: {}.", direction()),
        OffCentre::AreaAndForce => format!(
            "The force loop's centre moves with pressure, {}. Besides it is off centre by {}: a constant force, or a zero \
             error of the force sensor.",
            area(),
            force()
        ),
    };
    if map.off_centre_ties.is_empty() {
        return found;
    }
    let others: Vec<String> = (map.off_centre_ties.iter())
        .map(|tie| match tie {
            OffCentre::ConstantForce => format!("{tie} ({})", force()),
            OffCentre::Area => format!("{tie} (area {} %)", value(&map.area_error, 100.0)),
            OffCentre::Direction => format!("{tie} ({})", direction()),
            OffCentre::AreaAndForce => tie.to_string(),
        })
        .collect();
    format!(
        "{found} As likely: {}. Record at zero pressure and at more pressures, or turn the piston round, to tell.",
        others.join("; or ")
    )
}

fn runs_table(map: &FrictionMap) -> Table {
    let mut table = Table::new([
        "pressures A + B, bar",
        "A - B, bar",
        "speed, mm/s",
        "friction, N",
        "off centre, N",
        "ripple, N",
        "samples",
    ]);
    for run in &map.runs {
        table.row([
            format!("{:.2}", run.pressure_pa * BAR),
            format!("{:.2}", run.difference_pa * BAR),
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
    let mut table =
        Table::new(["model", "error on recordings left out, N", "gain, %", "beyond scatter (1 % level)", "kept"]);
    for stage in &map.stages {
        table.row([
            stage.model.to_string(),
            format!("{:.2}", stage.holdout_rmse_n),
            stage.gain.map_or("–".to_string(), |gain| format!("{:+.0}", 100.0 * gain)),
            if stage.established { "yes" } else { "no" }.to_string(),
            match (stage.kept, stage.tied) {
                (true, _) => "yes",
                (_, true) => "as likely",
                _ => "no",
            }
            .to_string(),
        ]);
    }
    table
}

fn page(map: &FrictionMap, sentences: &[String]) -> Page {
    let mut page = Page::new("What friction depends on");
    page.callout(Tone::Neutral, sentences.first().cloned().unwrap_or_default());
    page.block(report_html::Block::List(sentences.iter().skip(1).cloned().collect()));
    let x: Vec<f64> = map.runs.iter().map(|run| run.pressure_pa * BAR).collect();
    let across = map.runs.iter().map(|run| run.difference_pa * BAR).collect();
    let highest = x.iter().copied().fold(0.0, f64::max);
    let at = |p_bar: f64| map.friction_n.value + map.pressure_n_per_pa.value * p_bar / BAR;
    let mut plots = vec![
        Plot::new("Friction (half the force loop) against pressure", "gauge pressures A + B, bar", "friction, N")
            .with(Series::dots("recordings", x.clone(), map.runs.iter().map(|run| run.friction_n).collect()))
            .with(Series::line("line through all", vec![0.0, highest], vec![at(0.0), at(highest)]).dashed()),
        Plot::new("Force that keeps its sign when the motion reverses", "pressure across the piston, bar", "force, N")
            .with(Series::dots("recordings", across, map.runs.iter().map(|run| run.bias_n).collect()))
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
        "Every recording is predicted from the others. Each model is compared with the last one kept before its kind; of the \
         forces that keep their sign the likeliest is kept. The phase of the ripple depends on the recording's zero: its \
         first half gives it, the second half is predicted. It is kept for what it gains along the stroke, see above.",
    ));
    page
}
