//! The firmware's loop with the model monitor that the board would have.

use control::Parameters;
use firmware_core::{MonitorSetup, Setup, SetupError};
use monitor::MonitorParameters;
use plant_model::{Plant, Rig};

/// What the model monitor's verdict does: the board's parameter `monitor`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum MonitorAction {
    /// There is no monitor.
    Off,
    /// A contradiction is reported; the controller runs on.
    Warn,
    /// A contradiction leads to the safe state, as on the board by default.
    #[default]
    Trip,
}

/// The firmware's loop for a controller's parameters, with the monitor that the board would have: it knows the nominal
/// values `model` and none of a rig's effects, and allows the board's default limits. `output_delay_ticks` is 1 on the board.
///
/// # Errors
/// The first parameter of controller, model or monitor that is out of range.
pub fn setup(
    parameters: &Parameters,
    model: &Rig<f64>,
    action: MonitorAction,
    output_delay_ticks: u8,
) -> Result<Setup, SetupError> {
    let monitor = match action {
        MonitorAction::Off => None,
        MonitorAction::Warn | MonitorAction::Trip => Some(MonitorSetup {
            plant: Plant::without_effects(&model.convert()).map_err(SetupError::Monitor)?,
            parameters: MonitorParameters::default(),
            trips: action == MonitorAction::Trip,
            output_delay_ticks,
        }),
    };
    // Telemetry is not sent here; a record that is due every tick costs nothing.
    Setup::new(parameters, monitor, 1)
}
