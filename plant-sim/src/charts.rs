//! The plots of runs and logs, the same for reports and pictures.

use crate::recording::Recording;
use report_html::{Marker, Plot, Series};
use rig_files::{Column, Log};

/// Values times a factor, for plots in mm and bar.
#[must_use]
pub fn scaled(values: &[f64], factor: f64) -> Vec<f64> {
    values.iter().map(|value| value * factor).collect()
}

/// Metres → millimetres.
pub const MM: f64 = 1.0e3;
/// Pascals → bar.
pub const BAR: f64 = 1.0e-5;

/// The positions of several runs with their common target.
#[must_use]
pub fn positions(runs: &[(&str, &Recording)], target_m: f64) -> Plot {
    let mut plot = Plot::new("Position", "time, s", "y, mm").marker(Marker::Horizontal(target_m * MM));
    for (name, run) in runs {
        plot = plot.with(Series::line(*name, run.t_s.clone(), scaled(&run.y_m, MM)));
    }
    plot.cursor_group("time").height_px(380)
}

/// Runs of one rig under several laws up to `to_s`, with their target and the time that no law beats.
#[must_use]
pub fn comparison(title: &str, runs: &[(&str, &Recording)], target_m: f64, bound_s: f64, to_s: f64) -> Plot {
    let mut plot = Plot::new(title, "time, s", "y, mm").marker(Marker::Horizontal(target_m * MM));
    if bound_s < to_s {
        plot = plot.marker(Marker::Vertical(bound_s));
    }
    for (law, run) in runs {
        plot = plot.with(Series::line(*law, run.t_s.clone(), scaled(&run.y_m, MM)));
    }
    plot.x_range(0.0, to_s).cursor_group("time").height_px(340)
}

/// The last part of several runs as error in mm: hunting and steady-state error.
#[must_use]
pub fn errors(runs: &[(&str, &Recording)], target_m: f64, from_s: f64) -> Plot {
    let mut plot =
        Plot::new("The end of the run: position error", "time, s", "y − target, mm").marker(Marker::Horizontal(0.0));
    for (name, run) in runs {
        let tail = run.t_s.iter().position(|t_s| *t_s >= from_s).unwrap_or(0);
        let error = run.y_m[tail..].iter().map(|y_m| (y_m - target_m) * MM).collect();
        plot = plot.with(Series::line(*name, run.t_s[tail..].to_vec(), error));
    }
    plot.height_px(320)
}

/// The true chamber pressures of one run.
#[must_use]
pub fn pressures(title: &str, run: &Recording) -> Plot {
    Plot::new(title, "time, s", "pressure, bar absolute")
        .with(Series::line("A", run.t_s.clone(), scaled(&run.p_a_pa, BAR)).colour(0))
        .with(Series::line("B", run.t_s.clone(), scaled(&run.p_b_pa, BAR)).colour(1))
}

/// Pressures, valve command and velocity of one run.
#[must_use]
pub fn details(name: &str, run: &Recording) -> Vec<Plot> {
    let t = || run.t_s.clone();
    let group = format!("details of {name}");
    let plots = vec![
        Plot::new("Chamber pressures", "time, s", "pressure, bar absolute")
            .with(Series::line("A as read", t(), scaled(&run.p_read_pa[0], BAR)).colour(5))
            .with(Series::line("B as read", t(), scaled(&run.p_read_pa[1], BAR)).colour(4))
            .with(Series::line("A", t(), scaled(&run.p_a_pa, BAR)).colour(0))
            .with(Series::line("B", t(), scaled(&run.p_b_pa, BAR)).colour(1)),
        Plot::new("Valve command", "time, s", "u, V").with(Series::steps("u", t(), run.u_v.clone())),
        Plot::new("Velocity", "time, s", "v, mm/s").with(Series::line("v", t(), scaled(&run.v_m_per_s, MM))),
        Plot::new("Bristle deflection of the seals", "time, s", "z, µm").with(Series::line(
            "z",
            t(),
            scaled(&run.z_m, 1e6),
        )),
    ];
    plots.into_iter().map(|plot| plot.cursor_group(group.clone()).height_px(260)).collect()
}

/// A log, one plot per kind of quantity, with a shared cursor.
#[must_use]
pub fn log(log: &Log) -> Vec<Plot> {
    let t = || log.t_s.clone();
    let mut plots = Vec::new();
    let mut add = |title: &str, y_label: &str, factor: f64, columns: &[(Column, &str, bool)]| {
        let mut plot = Plot::new(title, "time, s", y_label).cursor_group("log").height_px(300);
        for (column, name, dashed) in columns {
            if let Some(values) = log.column(*column) {
                let series = Series::line(*name, t(), scaled(values, factor));
                plot = plot.with(if *dashed { series.dashed() } else { series });
            }
        }
        if !plot.series.is_empty() {
            plots.push(plot);
        }
    };
    add("Position", "y, mm", MM, &[(Column::Y, "position", false), (Column::YRef, "setpoint", true)]);
    add(
        "Pressures",
        "pressure, bar absolute",
        BAR,
        &[(Column::PA, "A", false), (Column::PB, "B", false), (Column::PSup, "supply", true)],
    );
    add("Valve command", "u, V", 1.0, &[(Column::U, "u", false)]);
    add("External force", "force, N", 1.0, &[(Column::FExt, "force", false)]);
    add("Velocity", "v, mm/s", MM, &[(Column::V, "velocity", false)]);
    add("Bristle deflection", "z, µm", 1e6, &[(Column::Z, "z", false)]);
    plots
}
