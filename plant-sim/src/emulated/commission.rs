//! A rig's and a controller's numbers as parameters of the board, and how they get there: over the serial line, all at once.

use super::EmulatedError;
use super::board::Board;
use super::line::Line;
use crate::board::Client;
use crate::commission::from_rig::number;
use crate::commission::{out_of_range, transfer};
use crate::monitoring::MonitorAction;
use board_link::{Command, Parameter, Source};
use control::{Config, Parameters};
use firmware_core::Settings;
use monitor::MonitorParameters;
use plant_model::Rig;
use stm32_emulator::analog::Analog;

/// What the board must be told to control `rig` with `parameters`.
///
/// # Errors
/// A sentence that names the parameter that the board does not take, or does not have.
pub fn settings(
    rig: &Rig<f64>,
    parameters: &Parameters,
    monitor: MonitorAction,
    allowed: &MonitorParameters,
) -> Result<Settings, EmulatedError> {
    let rig = rig.convert();
    let mut settings = Settings::default();
    for parameter in Parameter::ALL {
        let value = number(parameter, parameters, allowed, &rig).unwrap_or(match (parameter.source(), monitor) {
            (Source::Board(board_link::own::Key::monitor), MonitorAction::Off) => 0.0,
            (Source::Board(board_link::own::Key::monitor), MonitorAction::Warn) => 1.0,
            (Source::Board(board_link::own::Key::monitor), MonitorAction::Trip) => 2.0,
            _ => parameter.default_value(),
        });
        settings.set(parameter, value).map_err(|_| EmulatedError::Other(out_of_range(parameter, value)))?;
    }
    let refused = |error: &dyn std::fmt::Display| EmulatedError::Other(format!("the controller refuses it: {error}"));
    let wanted = Config::from_parameters(parameters).map_err(|error| refused(&error))?;
    if settings.control_config().map_err(|error| refused(&error))? != wanted {
        let made = settings.control_parameters();
        let differs = control::Key::ALL
            .into_iter()
            .find(|key| *key != control::Key::setpoint_range_m && made.get(*key) != parameters.get(*key));
        let name = differs.map_or("setpoint_range_m", |key| key.row().key);
        return Err(EmulatedError::Other(format!("the board has no parameter for `{name}`; leave it at its default")));
    }
    settings.check().map_err(|error| refused(&error))?;
    Ok(settings)
}

/// Puts every parameter in force at once, and saves.
///
/// # Errors
/// The board refuses them.
pub fn apply<A: Analog>(board: &mut Board<A>, settings: &Settings) -> Result<(), EmulatedError> {
    let mut client = Client::open(Line::to(board), 1)?;
    let changes = Parameter::ALL.map(|parameter| (parameter, settings.get(parameter)));
    transfer::change(&mut client, &changes).map_err(|error| EmulatedError::Other(error.to_string()))?;
    client.ask(Command::Save)?;
    Ok(())
}
