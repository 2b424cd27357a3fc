//! `plant-sim controller --stdio`: the firmware's control loop as a co-process.

use super::{CliError, RigArgument};
use firmware_core::SetupError;
use plant_sim::controller;
use plant_sim::monitoring::{self, MonitorAction};
use plant_sim::stdio::Coprocess;
use rig_files::InputError;
use std::path::PathBuf;

/// Run the firmware's control loop as a co-process, so that any plant model can close the loop around it.
///
/// Per line on standard input "y_ref_m adc_position adc_p_a adc_p_b adc_p_sup" (codes: integers of io.adc_bits) one
/// line "dac_code state" is answered on standard output, where state is "run" or "safe:REASON". Each line is one tick
/// of io.tick_hz. The controller starts armed. A malformed line is answered "error ..." and changes nothing. The line "learned" is no
/// tick: it is answered with what the positioning law has learned.
///
/// The board's model monitor runs too and knows the rig file. By default it only warns, once, on standard error: a
/// plant with other physics than the rig file's is no fault here. With --monitor trip it leads to the safe state, as on
/// the board.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  \
    echo '0.045 32768 23710 23710 45875' | plant-sim controller --rig rigs/paper-a.toml --stdio\n  \
    2297 run\n\n".to_owned() + &controller::keys_help())]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Controller file (TOML) with gains, limits and dead-zone values that replace those derived from the rig
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// What the model monitor does when the readings contradict the rig's nominal values
    #[arg(long, value_name = "ACTION", value_enum, default_value_t = MonitorAction::Warn)]
    monitor: MonitorAction,
    /// Communicate over standard input and output; required, so that a script says what it does
    #[arg(long, required = true)]
    stdio: bool,
}

/// Ticks from a line to the valve taking its answer, as the model monitor supposes: the board's one.
const LATCHED_TICKS: u8 = 1;

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = super::read_rig(&arguments.rig.rig)?;
    let parameters = match &arguments.config {
        Some(path) => controller::read_parameters(path, &rig)?,
        None => controller::parameters(&rig),
    };
    let file = arguments.rig.rig.display().to_string();
    let setup =
        monitoring::setup(&parameters, &rig.rig, arguments.monitor, LATCHED_TICKS).map_err(|error| match error {
            SetupError::Control(error) => controller::config_error(&file, &error),
            SetupError::Monitor(error) => InputError::new(
                &file,
                format!("the model monitor refuses it: {error}"),
                "correct it, or give --monitor off",
            ),
        })?;
    if rig.rig.cylinder.is_single_acting() && arguments.config.is_none() {
        eprintln!(
            "note: {file} describes a single-acting cylinder: the paper's law drives it, as the positioning law needs two driven chambers"
        );
    }
    let mut coprocess = Coprocess::new(setup, &parameters);
    let warn = |tick| {
        eprintln!(
            "warning: at tick {tick} the readings contradict the rig's nominal values, by the controller's model monitor; \
             --monitor off silences this"
        );
    };
    coprocess
        .serve(std::io::stdin().lock(), std::io::stdout().lock(), warn)
        .map_err(|error| CliError::Failed(format!("standard input or output failed: {error}")))
}
