//! A rig's and a controller's numbers as parameters of the board, and how they get there: one by one over the serial line, as
//! a person would do it.

use super::EmulatedError;
use super::board::Board;
use super::line::Line;
use crate::board::{BoardError, Client};
use crate::monitoring::MonitorAction;
use board_link::{Command, Parameter, Refusal, Reply, Source};
use control::{Config, Parameters};
use firmware_core::Settings;
use monitor::MonitorParameters;
use parameter_table::End;
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
        let value = match parameter.source() {
            // Absent means the range of the position; the board always has both ends.
            Source::Control(control::Key::setpoint_range_m, end) => {
                let (low, high) = parameters.setpoint_range_m.unwrap_or(parameters.position_range_m).into();
                if end == End::First { low } else { high }
            }
            Source::Control(key, end) => parameters.get(key).number(end),
            Source::Monitor(key) => allowed.get(key).number(End::First),
            Source::Rig(place) => place.key().get(&rig),
            Source::Board(board_link::own::Key::monitor) => match monitor {
                MonitorAction::Off => 0.0,
                MonitorAction::Warn => 1.0,
                MonitorAction::Trip => 2.0,
            },
            Source::Board(key) => key.default_value().number(End::First),
        };
        settings.set(parameter, value).map_err(|_| {
            let (name, info) = (parameter.name(), parameter.info());
            EmulatedError::Other(format!("the board does not take `{name}` = {value}; its range is {}", info.range()))
        })?;
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

/// How often values that do not yet fit the others are tried again: the ends of a range move one at a time.
const PASSES: usize = 4;

/// Sets every parameter that differs from what the board has, and saves. Takes effect as a whole with the next start.
///
/// # Errors
/// The board refuses a value for good.
pub fn apply<A: Analog>(board: &mut Board<A>, settings: &Settings) -> Result<(), EmulatedError> {
    let mut client = Client::open(Line::to(board), 1)?;
    let mut waiting = Vec::new();
    for parameter in Parameter::ALL {
        match client.ask(Command::Get(parameter))? {
            Reply::Value(value) if value == settings.get(parameter) => {}
            _ => waiting.push(parameter),
        }
    }
    let mut refused = None;
    for _ in 0..PASSES {
        let mut left = Vec::new();
        for parameter in waiting {
            match client.ask(Command::Set(parameter, settings.get(parameter))) {
                Ok(_) => {}
                Err(BoardError::Refused(Refusal::Configuration)) => left.push(parameter),
                Err(error) => refused = Some((parameter, error)),
            }
        }
        waiting = left;
        if waiting.is_empty() || refused.is_some() {
            break;
        }
    }
    if let Some(parameter) = waiting.first() {
        refused.get_or_insert((*parameter, BoardError::Refused(Refusal::Configuration)));
    }
    if let Some((parameter, error)) = refused {
        return Err(EmulatedError::Other(format!("`{}` = {}: {error}", parameter.name(), settings.get(parameter))));
    }
    client.ask(Command::Save)?;
    Ok(())
}
