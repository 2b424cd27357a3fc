//! Parameters of a running board: read all, change several at once.

use super::{Change, out_of_range};
use crate::board::{BoardError, Client};
use board_link::{Command, Parameter, Refusal, Reply};
use firmware_core::{Settings, SettingsError};
use std::io::{Read, Write};

/// Why a board keeps the parameters it had.
#[derive(Clone, Debug, PartialEq)]
pub enum TransferError {
    /// It did not answer, or refused for a reason that has nothing to do with the values.
    Board(BoardError),
    /// A value is not possible, or they do not fit together: a sentence with the key, its value and the remedy.
    Refused(String),
}

impl std::fmt::Display for TransferError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Board(error) => error.fmt(f),
            Self::Refused(sentence) => f.write_str(sentence),
        }
    }
}

impl std::error::Error for TransferError {}

impl From<BoardError> for TransferError {
    fn from(error: BoardError) -> Self {
        Self::Board(error)
    }
}

/// All parameters as the board has them now; a tick rate that waits for the next start is the one told.
///
/// # Errors
/// No answer, or a value that this program's table does not allow: another version of the firmware.
pub fn read<P: Read + Write>(client: &mut Client<P>) -> Result<Settings, BoardError> {
    let mut settings = Settings::default();
    for parameter in Parameter::ALL {
        match client.ask(Command::Get(parameter))? {
            Reply::Value(value) => settings.set(parameter, value).map_err(|_| BoardError::Unexpected)?,
            _ => return Err(BoardError::Unexpected),
        }
    }
    Ok(settings)
}

/// Changes parameters all at once until the next reset of the board, and returns those that were different before. If the
/// line breaks or the power fails before the end, or a value is refused, the board keeps what it had.
///
/// # Errors
/// See [`TransferError`].
pub fn change<P: Read + Write>(client: &mut Client<P>, changes: &[Change]) -> Result<Vec<Change>, TransferError> {
    let before = read(client)?;
    let mut wanted = before.clone();
    for (parameter, value) in changes {
        wanted.set(*parameter, *value).map_err(|_| TransferError::Refused(out_of_range(*parameter, *value)))?;
    }
    let differs = |parameter: &Parameter| wanted.get(*parameter) != before.get(*parameter);
    let changed: Vec<_> = Parameter::ALL.into_iter().filter(differs).map(|p| (p, wanted.get(p))).collect();
    if changed.is_empty() {
        return Ok(changed);
    }
    client.ask(Command::Begin)?;
    for (parameter, value) in &changed {
        client.ask(Command::Stage(*parameter, *value))?;
    }
    match client.ask(Command::Apply) {
        Ok(_) => {}
        Err(BoardError::Refused(Refusal::Configuration(key))) => {
            return Err(TransferError::Refused(misfit(&wanted, key)));
        }
        Err(error) => return Err(error.into()),
    }
    // What the board has now decides, not what it was told.
    let found = read(client)?;
    match Parameter::ALL.into_iter().find(|parameter| found.get(*parameter) != wanted.get(*parameter)) {
        None => Ok(changed),
        Some(parameter) => {
            let (name, found, wanted) = (parameter.name(), found.get(parameter), wanted.get(parameter));
            let text =
                format!("the board has `{name}` = {found} instead of {wanted}; is another program talking to it?");
            Err(TransferError::Refused(text))
        }
    }
}

/// Why these settings do not fit together; `key` is what the board says stands in the way.
fn misfit(wanted: &Settings, key: Option<Parameter>) -> String {
    let value = |parameter: Parameter| format!("`{}` = {}", parameter.name(), wanted.get(parameter));
    let reason = match (wanted.check(), key) {
        (Err(error), key) => told(wanted, &error, key.or_else(|| wanted.named_by(&error))),
        // At the rate of its timer, which `tick_hz` changes with the next start.
        (Ok(()), Some(key)) => format!("{} does not fit the tick rate at which the board runs now", value(key)),
        (Ok(()), None) => "the values do not fit together".into(),
    };
    format!(
        "refused, and nothing was changed: {reason}. Change what belongs together at once: `plant-sim board --port … set NAME \
         VALUE NAME VALUE …`, or `apply` with a file"
    )
}

fn told(wanted: &Settings, error: &SettingsError, key: Option<Parameter>) -> String {
    match key {
        Some(key) => format!("`{}` = {} must {}", key.name(), wanted.get(key), error.must),
        None => error.to_string(),
    }
}
