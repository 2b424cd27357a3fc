//! `plant-sim controller --stdio`: the firmware's control law as a co-process.

use super::{CliError, RigArgument};
use control::Config;
use plant_sim::controller;
use plant_sim::stdio::Coprocess;
use rig_files::RigFile;
use std::path::PathBuf;

/// Run the firmware's control law as a co-process, so that any plant model can close the loop around it.
///
/// Per line on standard input "y_ref_m adc_position adc_p_a adc_p_b adc_p_sup" (codes: integers of io.adc_bits) one line
/// "dac_code state" is answered on standard output, where state is "run" or "safe:REASON". Each line is one tick of
/// io.tick_hz. The controller starts armed. A malformed line is answered "error ..." and changes nothing.
#[derive(clap::Args, Debug)]
#[command(after_long_help = "EXAMPLE\n  \
    echo '0.045 32768 23710 23710 45875' | plant-sim controller --rig rigs/paper-a.toml --stdio\n  \
    2121 run\n\n".to_owned() + &controller::keys_help())]
pub(crate) struct Arguments {
    #[command(flatten)]
    rig: RigArgument,
    /// Controller file (TOML) with gains, limits and dead-zone values that replace those derived from the rig
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Talk over standard input and output (the only way there is; say it so that scripts stay clear)
    #[arg(long, required = true)]
    stdio: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let rig = RigFile::read(&arguments.rig.rig)?;
    let parameters = match &arguments.config {
        Some(path) => controller::read_parameters(path, &rig)?,
        None => controller::parameters(&rig),
    };
    let file = arguments.rig.rig.display().to_string();
    let config = Config::from_parameters(&parameters).map_err(|error| controller::config_error(&file, &error))?;
    let mut coprocess = Coprocess::new(config, u32::from(parameters.adc_bits));
    coprocess
        .serve(std::io::stdin().lock(), std::io::stdout().lock())
        .map_err(|error| CliError::Failed(format!("standard input or output failed: {error}")))
}
