//! Parameters of the board as a set: list, read, change, from and to files.

use super::{failed, parameter};
use crate::commands::CliError;
use board_link::Parameter;
use plant_sim::board::Client;
use plant_sim::commission::parameter_file::{self, Kind};
use plant_sim::commission::transfer::{self, TransferError};
use plant_sim::commission::{Change, from_rig};
use rig_files::{InputError, RigFile, read_text, write_file};
use std::io::{Read, Write};
use std::path::Path;

impl From<TransferError> for CliError {
    fn from(error: TransferError) -> Self {
        match error {
            TransferError::Board(error) => failed(error),
            TransferError::Refused(sentence) => Self::Usage(sentence),
        }
    }
}

/// All parameters with range, default and meaning; no board is asked.
pub(super) fn list() {
    for parameter in Parameter::ALL {
        let info = parameter.info();
        say!("{:34} {:>12} ({})  {}", info.name, info.default, info.range(), info.words());
    }
}

/// All values of the board.
pub(super) fn show<P: Read + Write>(client: &mut Client<P>) -> Result<(), CliError> {
    let settings = transfer::read(client).map_err(failed)?;
    for parameter in Parameter::ALL {
        say!("{:34} {}", parameter.name(), settings.get(parameter));
    }
    Ok(())
}

/// All values of the board into a file.
pub(super) fn write<P: Read + Write>(client: &mut Client<P>, out: &Path) -> Result<(), CliError> {
    let board_link::Reply::Version(version) = client.ask(board_link::Command::Version).map_err(failed)? else {
        return Err(failed(plant_sim::board::BoardError::Unexpected));
    };
    let settings = transfer::read(client).map_err(failed)?;
    let text = parameter_file::text(&settings, &format!("a {} with firmware {}", version.board, version.firmware));
    write_file(out, |file| file.write_all(text.as_bytes()))?;
    say!("{} parameters written to {}", Parameter::ALL.len(), out.display());
    Ok(())
}

/// Names and values in turn, as typed.
pub(super) fn pairs(words: &[String]) -> Result<Vec<Change>, CliError> {
    let pair = |pair: &[String]| {
        let [name, value] = pair else {
            return Err(CliError::Usage("give names and values in turn: `set NAME VALUE NAME VALUE …`".into()));
        };
        let parameter = parameter(name)?;
        let value = value.parse().map_err(|_| CliError::Usage(format!("`{name}` wants a number, not `{value}`")))?;
        Ok((parameter, value))
    };
    words.chunks(2).map(pair).collect()
}

/// Changes what was typed.
pub(super) fn set<P: Read + Write>(client: &mut Client<P>, changes: &[Change]) -> Result<(), CliError> {
    transfer::change(client, changes)?;
    say!("done");
    Ok(())
}

/// A file for `apply`, read and checked as far as it can be without a board.
pub(super) enum ToApply {
    /// A rig file.
    Rig(Box<RigFile>),
    /// Parameters.
    Changes(Vec<Change>),
}

/// Reads a file for `apply`.
pub(super) fn read(path: &Path) -> Result<ToApply, CliError> {
    let (text, file) = (read_text(path)?, path.display().to_string());
    Ok(match parameter_file::kind(&text, &file)? {
        Kind::Rig => ToApply::Rig(Box::new(RigFile::parse(&text, &file)?)),
        Kind::Parameters => ToApply::Changes(parameter_file::parse(&text, &file)?),
    })
}

/// Puts a file's parameters in force, all at once or none; saves them if that is asked for.
pub(super) fn apply<P: Read + Write>(
    client: &mut Client<P>,
    path: &Path,
    file: &ToApply,
    save: bool,
) -> Result<(), CliError> {
    let name = path.display();
    let (changes, notes) = match file {
        ToApply::Changes(changes) => (changes.clone(), Vec::new()),
        ToApply::Rig(rig) => {
            let present = transfer::read(client).map_err(failed)?;
            let found = from_rig::from_rig(rig, &present).map_err(|problem| {
                CliError::Input(InputError::new(name.to_string(), problem, "correct the value in the rig file"))
            })?;
            (found.changes, found.notes)
        }
    };
    let changed = transfer::change(client, &changes)?;
    for (parameter, value) in &changed {
        say!("{:34} {value}", parameter.name());
    }
    for note in notes {
        say!("note: {note}");
    }
    say!("{} of {} parameters of {name} were different and are in force now", changed.len(), changes.len());
    if changed.iter().any(|(parameter, _)| *parameter == Parameter::TickHz) {
        say!("note: `tick_hz` takes effect at the next start, once it is saved");
    }
    if save {
        client.ask(board_link::Command::Save).map_err(failed)?;
        say!("saved");
    } else if !changed.is_empty() {
        say!("not saved: until the next start only; `save` keeps them");
    }
    Ok(())
}
