//! What the controller can use of a diagnosis, and what that does to the closed loop.

use crate::charts::MM;
use crate::commission::from_rig::without_effects;
use crate::controller::{self, FROM_RIG};
use crate::metrics::StepMetrics;
use crate::recording::Recording;
use crate::{LoopError, LoopSettings, MonitorAction};
use control::{LawChoice, Parameters, Value};
use report_html::{Marker, Page, Plot, Series, Table};
use rig_files::RigFile;

/// Length of a positioning step, s.
const DURATION_S: f64 = 5.0;
/// The paper's target, m; shorter strokes get half of their half.
const TARGET_M: f64 = 0.045;
/// Proportional gains of the paper's law that are tried where the positioning law cannot hold the rig, V/m.
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
    /// Configured from the nominal rig.
    pub before: Configured,
    /// Configured from the extended rig.
    pub after: Configured,
}

/// The controller's parameters for a rig whose effects stand in its numbers, as `board apply` has them. A single-acting cylinder is
/// held by the paper's law, with the gain that settles best on the simulated rig.
fn tuned(rig: &RigFile, target_m: f64) -> Result<Parameters, LoopError> {
    let base = controller::parameters(&without_effects(rig)?.0);
    if base.law == LawChoice::Servo {
        return Ok(base);
    }
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
    /// The controller file (TOML) with all that follows from the extended rig but sensors, converters and tick, for `--config`.
    #[must_use]
    pub fn controller_toml(&self) -> String {
        let p = &self.after.parameters;
        let gain = (p.law == LawChoice::Paper).then_some(control::Key::gain_v_per_m);
        let keys = FROM_RIG.into_iter().filter(|key| !controller::OF_CONVERTERS.contains(key)).chain(gain);
        let given = keys.map(|key| (key, p.get(key))).filter(|(_, value)| *value != Value::Absent);
        let line = |(key, value): (control::Key, Value)| format!("{} = {value}\n", key.row().key);
        "# From the extended rig; for `plant-sim run --config` and `plant-sim controller --config`.\n".to_string()
            + &given.map(line).collect::<String>()
    }

    /// Before and after as a table.
    #[must_use]
    pub fn table(&self) -> Table {
        let seconds = |time: Option<f64>| time.map_or("–".to_string(), |time| format!("{time:.3}"));
        let mut table = Table::new([
            "controller",
            "law",
            "dead zone, V",
            "settled to 0.1 mm, s",
            "overshoot, %",
            "steady error, mm",
            "hunting, ± mm",
        ]);
        for Configured { name, parameters: p, metrics: m, .. } in [&self.before, &self.after] {
            let law = match p.law {
                LawChoice::Servo => "positioning".to_string(),
                LawChoice::Paper => format!("the paper's, {} V/m", p.gain_v_per_m),
            };
            table.row([
                (*name).to_string(),
                law,
                format!("{:+.3} / {:+.3}", p.dead_zone_left_v, p.dead_zone_right_v),
                seconds(m.settling_0_1_mm_s),
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
             simulated extended rig. Of the extended rig it takes the numbers of valve, cylinder, load and friction, with those \
             effects in them that stand for such a number. `controller.toml` holds the result.",
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
