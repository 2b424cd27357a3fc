//! What the controller can use of a diagnosis, and what that does to the closed loop.

use crate::charts::MM;
use crate::controller;
use crate::metrics::StepMetrics;
use crate::recording::Recording;
use crate::{LoopError, LoopSettings, MonitorAction};
use control::Parameters;
use plant_model::Plant;
use report_html::{Marker, Page, Plot, Series, Table};
use rig_files::RigFile;

/// Length of a positioning step, s.
const DURATION_S: f64 = 5.0;
/// The paper's target, m; shorter strokes get half of their half.
const TARGET_M: f64 = 0.045;
/// Proportional gains that are tried, V/m.
const GAINS: [f32; 9] = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0];

/// A controller and what it does on the extended rig.
#[derive(Clone, Debug)]
pub struct Configured {
    /// In words.
    pub name: &'static str,
    /// Its parameters.
    pub parameters: Parameters,
    /// Its step on the extended rig.
    pub recording: Recording,
    /// The figures of the step.
    pub metrics: StepMetrics,
}

/// The loop before and after.
#[derive(Clone, Debug)]
pub struct Applied {
    /// Target, m.
    pub target_m: f64,
    /// Configured from the nominal rig, with its dead zone and the gain that is best on it.
    pub before: Configured,
    /// Configured from the extended rig.
    pub after: Configured,
}

/// The controller's parameters for a rig with effects: the dead zone is that of the valve with its effects.
///
/// # Errors
/// The plant refuses a parameter.
pub fn informed(rig: &RigFile) -> Result<Parameters, LoopError> {
    let mut parameters = controller::papers_parameters(rig);
    let plant = Plant::new(&rig.rig, &rig.effects)?;
    let dead_zone = plant.dead_zone();
    (parameters.dead_zone_right_v, parameters.dead_zone_left_v) = (dead_zone.right_v as f32, dead_zone.left_v as f32);
    Ok(parameters)
}

/// The gain that settles best on a simulated rig: mass, friction and flow coefficients enter through it.
fn tuned(rig: &RigFile, target_m: f64) -> Result<Parameters, LoopError> {
    let base = informed(rig)?;
    let mut best = (f64::INFINITY, base.clone());
    for gain in GAINS {
        let parameters = Parameters { gain_v_per_m: gain, ..base.clone() };
        let metrics = step(rig, &parameters, target_m)?.1;
        let settling = metrics.settling_2_percent_s.unwrap_or(2.0 * DURATION_S);
        let lasting = (metrics.steady_error_m.abs() + metrics.hunting_m) / target_m;
        let cost = settling + 5.0 * metrics.overshoot + 10.0 * lasting;
        if cost < best.0 {
            best = (cost, parameters);
        }
    }
    Ok(best.1)
}

fn step(rig: &RigFile, parameters: &Parameters, target_m: f64) -> Result<(Recording, StepMetrics), LoopError> {
    let ticks = (DURATION_S * f64::from(rig.io.tick_hz)) as usize;
    // How well the law positions; whether the board's monitor accepts a rig with this gap is another question.
    let settings = LoopSettings { monitor: MonitorAction::Off, ..LoopSettings::default() };
    let recording = Recording::run(rig, parameters, &settings, ticks, |_| target_m)?;
    let metrics = recording.step_metrics(target_m);
    Ok((recording, metrics))
}

/// Tunes the controller on either rig and runs both on the extended one, which stands for the real one.
///
/// # Errors
/// Plant or controller refuse a parameter.
pub fn apply(nominal: &RigFile, extended: &RigFile) -> Result<Applied, LoopError> {
    let target_m = TARGET_M.min(0.25 * nominal.rig.cylinder.stroke_m);
    let configured = |name, rig| -> Result<Configured, LoopError> {
        let parameters = tuned(rig, target_m)?;
        let (recording, metrics) = step(extended, &parameters, target_m)?;
        Ok(Configured { name, parameters, recording, metrics })
    };
    let before = configured("from the rig file as given", nominal)?;
    let after = configured("from the extended rig", extended)?;
    Ok(Applied { target_m, before, after })
}

impl Applied {
    /// The controller file (TOML) with what the diagnosis changes, for `--config`.
    #[must_use]
    pub fn controller_toml(&self) -> String {
        let p = &self.after.parameters;
        format!(
            "# From the extended rig; for `plant-sim run --config` and `plant-sim controller --config`.\n\
             gain_v_per_m = {:?}\ndead_zone_right_v = {:?}\ndead_zone_left_v = {:?}\n",
            p.gain_v_per_m, p.dead_zone_right_v, p.dead_zone_left_v
        )
    }

    /// Before and after as a table.
    #[must_use]
    pub fn table(&self) -> Table {
        let seconds = |time: Option<f64>| time.map_or("–".to_string(), |time| format!("{time:.3}"));
        let mut table = Table::new([
            "controller",
            "gain, V/m",
            "dead zone, V",
            "settled to 2 %, s",
            "overshoot, %",
            "steady error, mm",
            "hunting, ± mm",
        ]);
        for Configured { name, parameters: p, metrics: m, .. } in [&self.before, &self.after] {
            table.row([
                (*name).to_string(),
                format!("{}", p.gain_v_per_m),
                format!("{:+.3} / {:+.3}", p.dead_zone_left_v, p.dead_zone_right_v),
                seconds(m.settling_2_percent_s),
                format!("{:.1}", 100.0 * m.overshoot),
                format!("{:.3}", m.steady_error_m * MM),
                format!("{:.3}", m.hunting_m * MM),
            ]);
        }
        table
    }

    /// The section of the report.
    pub fn write(&self, page: &mut Page) {
        page.section("What the controller gains");
        page.text(
            "The firmware's controller, configured once from the rig file as given and once from the extended rig, on the \
             simulated extended rig: the dead zone goes into its inverse, mass, friction and flow coefficients into the \
             choice of the gain by simulation. `controller.toml` holds the result.",
        );
        page.table(self.table());
        let mut plot = Plot::new("Positioning step on the extended rig", "time, s", "y, mm")
            .marker(Marker::Horizontal(self.target_m * MM));
        for run in [&self.before, &self.after] {
            let y = crate::charts::scaled(&run.recording.y_m, MM);
            plot = plot.with(Series::line(run.name, run.recording.t_s.clone(), y));
        }
        page.plot(plot);
    }
}
