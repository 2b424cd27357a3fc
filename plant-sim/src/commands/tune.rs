//! `plant-sim tune`: the positioning law's constants for a rig, with margins and a verdict.

use super::{CliError, RigArgument, in_range, text_table};
use plant_model::{Effect, Effects};
use plant_sim::bound::bound_s;
use plant_sim::servo::margins::{Demand, Margins, move_time_s, shortfalls};
use plant_sim::servo::{Tuning, tuning::law_bandwidths};
use report_html::Table;
use rig_files::tuning::{LIMIT_PARTS, OBSERVER_RATIO};
use rig_files::{InputError, RigFile};

/// Work out the positioning law's constants for a rig, its margins, and whether the rig can do what is asked.
///
/// One rule for every rig (docs/control-law.md). A controller made for the rig file has these constants.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  plant-sim tune --rig rigs/paper-a.toml --move-mm 45 --within-s 0.3")]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Lag of the valve's spool, ms; by default that of the rig file's effect valve-lag, else 1.7
    #[arg(long, value_name = "MS")]
    lag_ms: Option<f64>,
    /// Length of a move, mm
    #[arg(long, value_name = "MM", default_value_t = 45.0)]
    move_mm: f64,
    /// Time in which the move is wanted, s
    #[arg(long, value_name = "S", default_value_t = 0.35)]
    within_s: f64,
    /// Standard deviation of the noise in a position code, um
    #[arg(long, value_name = "UM", default_value_t = 20.0)]
    noise_um: f64,
    /// Error allowed at rest, um
    #[arg(long, value_name = "UM", default_value_t = 45.0)]
    rest_um: f64,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let file = super::read_rig(&arguments.rig.rig)?;
    if file.rig.cylinder.is_single_acting() {
        return Err(CliError::Usage(
            "the positioning law needs two driven chambers; a single-acting cylinder is held by the paper's law: \
             write `law = \"paper\"` and a `gain_v_per_m` in a controller file"
                .into(),
        ));
    }
    let stroke_mm = file.rig.cylinder.stroke_m * 1e3;
    in_range("--lag-ms", arguments.lag_ms.unwrap_or(0.0), 0.0, 1000.0, "ms")?;
    in_range("--move-mm", arguments.move_mm, 0.2, stroke_mm, "mm, up to the stroke")?;
    in_range("--within-s", arguments.within_s, 1e-3, 1e3, "s")?;
    in_range("--noise-um", arguments.noise_um, 0.0, 1e5, "um")?;
    in_range("--rest-um", arguments.rest_um, 1.0, 1e5, "um")?;
    let lag_s = arguments.lag_ms.map_or(rig_files::tuning::lag_s(&file), |ms| ms * 1e-3);
    let tick_s = file.io.tick_s();
    let tuning = Tuning::of(&file.rig, lag_s, tick_s);
    let demand = Demand {
        move_m: arguments.move_mm * 1e-3,
        within_s: arguments.within_s,
        noise_m: arguments.noise_um * 1e-6,
        rest_m: arguments.rest_um * 1e-6,
    };

    let [by_delay, by_jerk] = law_bandwidths(&file.rig, lag_s, tick_s);
    let row = |name: &str, value: String, from: &str| vec![name.to_string(), value, from.to_string()];
    say!("{}: lag of the spool {:.1} ms, {:.0} ticks a second\n", file.name, lag_s * 1e3, 1.0 / tick_s);
    let limits = tuning.limits;
    let [part_v, part_a, part_j] = LIMIT_PARTS;
    let mut constants = Table::new(["constant", "value", "from"]);
    constants.rows = vec![
        row("speed", format!("{:.3} m/s", limits.speed), &format!("{part_v} of what the flow holds up")),
        row("acceleration", format!("{:.2} m/s2", limits.acceleration), &format!("{part_a} of that speed times w_n")),
        row("jerk", format!("{:.1} m/s3", limits.jerk), &format!("{part_j} of that speed times w_n squared")),
        row("law", format!("{:.1} rad/s", tuning.law_w), if by_delay < by_jerk { "delay and lag" } else { "jerk" }),
        row("observer", format!("{:.1} rad/s", tuning.observer_w), &format!("{OBSERVER_RATIO} times the law")),
        row("force", format!("{:.0} 1/s", tuning.force_rate), "pressure noise"),
        row(
            "friction at start",
            format!("{:.1} N", tuning.coulomb_start * tuning.coulomb),
            &format!("{} of nominal", tuning.coulomb_start),
        ),
    ];
    say!("{}", text_table(&constants));
    let margins = Margins::of(&tuning);
    say!(
        "margins of the loop without observer: {:.0} degrees at {:.0} rad/s, {:.1} ms, flow times {:.1}",
        margins.phase_deg,
        margins.crossover,
        margins.delay_s * 1e3,
        margins.gain
    );
    let fastest = bound_s(&file.rig, &with_lag(&file, lag_s), demand.move_m)
        .map_err(|error| InputError::new(&file.name, error.to_string(), "correct the value"))?;
    let time_s = move_time_s(&tuning, demand.move_m);
    let time =
        if time_s.is_finite() { format!("about {time_s:.3} s") } else { "does not settle for certain".to_string() };
    say!(
        "a move of {:.1} mm: {time}; the valve's full flow, there and back, would take {fastest:.3} s",
        arguments.move_mm,
    );
    let lacking = shortfalls(&file.rig, &tuning, &demand);
    if lacking.is_empty() {
        say!("verdict: the rig can do what is asked");
    }
    for sentence in lacking {
        say!("verdict: {sentence}");
    }
    Ok(())
}

/// The rig's effects with a spool of this lag.
fn with_lag(file: &RigFile, lag_s: f64) -> Effects<f64> {
    let mut effects = file.effects;
    effects.set(Effect::ValveLag, &[lag_s]);
    effects
}
