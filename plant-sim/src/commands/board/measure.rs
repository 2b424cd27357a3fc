//! What a board measures of itself: calibration of a channel, dead zone of the valve.

use super::failed;
use crate::commands::CliError;
use board_link::Command;
use plant_sim::board::Client;
use plant_sim::commission::calibrate::{Calibration, CalibrationError, Channel, measure};
use plant_sim::commission::dead_zone::{Search, SearchError, search};
use plant_sim::commission::{Change, transfer};
use std::io::{BufRead, Read, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// A channel as typed.
#[derive(clap::ValueEnum, Clone, Copy, Debug)]
pub(super) enum ChannelName {
    /// Piston position, m
    Position,
    /// Pressure of chamber A, Pa absolute
    PressureA,
    /// Pressure of chamber B, Pa absolute
    PressureB,
    /// Supply pressure, Pa absolute
    Supply,
}

impl From<ChannelName> for Channel {
    fn from(name: ChannelName) -> Self {
        match name {
            ChannelName::Position => Self::Position,
            ChannelName::PressureA => Self::PressureA,
            ChannelName::PressureB => Self::PressureB,
            ChannelName::Supply => Self::Supply,
        }
    }
}

impl From<CalibrationError> for CliError {
    fn from(error: CalibrationError) -> Self {
        match error {
            CalibrationError::Board(error) => failed(error),
            CalibrationError::Implausible(sentence) => Self::Failed(format!("{sentence}; nothing was changed")),
        }
    }
}

impl From<SearchError> for CliError {
    fn from(error: SearchError) -> Self {
        match error {
            SearchError::Transfer(error) => error.into(),
            SearchError::Aborted => Self::Failed("broken off; the board is idle with the parameters it had".into()),
            SearchError::NotFound(sentence) => Self::Failed(sentence),
        }
    }
}

/// Two-point calibration; `wait` returns when the rig is in the state it was told.
pub(super) fn calibrate<P: Read + Write>(
    client: &mut Client<P>,
    channel: Channel,
    values: [f64; 2],
    save: bool,
    mut wait: impl FnMut(&str) -> Result<(), CliError>,
) -> Result<(), CliError> {
    let settings = transfer::read(client).map_err(failed)?;
    let unit = channel.unit();
    let mut points = Vec::new();
    for value in values {
        wait(&format!("bring the {} to {value} {unit} and hold it there", channel.name()))?;
        points.push(measure(client, channel, value)?);
    }
    let [first, second] = points[..] else { return Err(failed(plant_sim::board::BoardError::Unexpected)) };
    let found = Calibration::of(&settings, channel, [first, second])?;
    say!("{:26} {:>10} {:>8} {:>14} {:>14}", channel.name(), "code", "noise", "read as", "is");
    for (point, reading) in found.points.iter().zip(found.readings) {
        let cells = [reading, point.value].map(|value| format!("{} {unit}", rounded(value, channel)));
        say!("{:26} {:>10.1} {:>8.1} {:>14} {:>14}", "", point.codes.mean, point.codes.noise, cells[0], cells[1]);
    }
    let changes = found.changes(&settings);
    for (parameter, value) in &changes {
        say!("{:26} {value} (was {})", parameter.name(), settings.get(*parameter));
    }
    say!(
        "{:26} ±{} {unit}, from the noise of the two averages",
        "error near the points",
        rounded(found.error(&settings), channel)
    );
    if found.unusual(&settings) {
        let [low, high] = channel.range().map(board_link::Parameter::name);
        say!("note: more than 5 % of correction; are `{low}` and `{high}` those of the sensor?");
    }
    keep(client, &changes, save)
}

fn rounded(value: f64, channel: Channel) -> String {
    if channel == Channel::Position { format!("{value:.6}") } else { format!("{value:.0}") }
}

fn keep<P: Read + Write>(client: &mut Client<P>, changes: &[Change], save: bool) -> Result<(), CliError> {
    transfer::change(client, changes)?;
    if save {
        client.ask(Command::Save).map_err(failed)?;
        say!("in force, and saved");
    } else {
        say!("in force until the next start; `save` keeps it");
    }
    Ok(())
}

/// Asks the person at the keyboard.
pub(super) fn ask_person(what: &str) -> Result<(), CliError> {
    say!("{what}; then press Enter");
    let mut line = String::new();
    match std::io::stdin().lock().read_line(&mut line) {
        Ok(count) if count > 0 => Ok(()),
        _ => Err(CliError::Usage("nobody has pressed Enter: the calibration wants a person at the keyboard".into())),
    }
}

/// Whether Ctrl-C is caught, and whether it was pressed since. A session may need it more than once, a handler is set once.
static CAUGHT: AtomicBool = AtomicBool::new(false);
static PRESSED: AtomicBool = AtomicBool::new(false);

/// While it exists Ctrl-C is noted instead of ending the program: it would leave the board running.
pub(super) struct Interrupted;

impl Interrupted {
    pub(super) fn watch() -> Result<Self, CliError> {
        static HANDLER: OnceLock<Result<(), String>> = OnceLock::new();
        let handler = || {
            if CAUGHT.load(Ordering::SeqCst) {
                PRESSED.store(true, Ordering::SeqCst);
            } else {
                std::process::exit(130);
            }
        };
        let set = HANDLER.get_or_init(|| ctrlc::set_handler(handler).map_err(|error| error.to_string()));
        set.clone().map_err(|error| CliError::Failed(format!("Ctrl-C cannot be caught: {error}")))?;
        PRESSED.store(false, Ordering::SeqCst);
        CAUGHT.store(true, Ordering::SeqCst);
        Ok(Self)
    }

    pub(super) fn interrupted(&self) -> bool {
        PRESSED.load(Ordering::SeqCst)
    }
}

impl Drop for Interrupted {
    fn drop(&mut self) {
        CAUGHT.store(false, Ordering::SeqCst);
    }
}

/// Searches the dead zone; puts it in force if that is asked for.
pub(super) fn dead_zone<P: Read + Write>(
    client: &mut Client<P>,
    how: &Search,
    apply: bool,
    save: bool,
) -> Result<(), CliError> {
    let hand = Interrupted::watch()?;
    let abort = || hand.interrupted();
    say!("searching; Ctrl-C breaks off, the emergency stop always does");
    let found = search(client, how, &abort, &mut |line| say!("{line}"))?;
    for (name, edge) in [("right", found.right), ("left", found.left)] {
        say!("dead zone, {name:5} {:+.3} V ± {:.3} V", edge.volts, edge.uncertainty_v);
    }
    let changes = found.changes();
    let words: Vec<String> = changes.iter().map(|(parameter, value)| format!("{} {value}", parameter.name())).collect();
    if apply || save {
        keep(client, &changes, save)
    } else {
        say!("to compensate it, less the uncertainty: plant-sim board --port … set {}", words.join(" "));
        Ok(())
    }
}
