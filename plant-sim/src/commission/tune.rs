//! A board finds out about its rig: the dead zone by small voltages, the rest by a log of moves that begin small, told by the
//! diagnosis. The log is made of the records that the board keeps for whoever asks: every third tick at 1 kHz is what the serial line
//! carries without a gap.

use super::dead_zone::{self, DeadZone, Search, SearchError};
use super::observe;
use super::{Change, from_rig, transfer};
use crate::board::{BoardError, Client};
use board_link::{Command, Generator, Parameter, Reply, SAMPLES, Sample, Samples, Shape, Status};
use control::Mode;
use firmware_core::{Settings, mode_from_number};
use rig_files::{Log, RigFile};
use std::io::{Read, Write};

/// Amplitudes of the moves as parts of the setpoint's range, smallest first, and how long each lasts, s. Only the last is long
/// enough for the diagnosis, whose sequence takes 40 s.
const MOVES: [(f64, f64); 3] = [(0.02, 6.0), (0.05, 6.0), (0.1, 40.0)];
/// Records a second during the moves: ten of them, some 200 bytes, take 22 ms at 115 200 baud with question and answer.
const RECORDS_PER_S: u32 = 333;
/// Length of the step that is shown before and after, as a part of the setpoint's range, and how long it is watched, s.
const STEP: (f64, f64) = (0.1, 3.0);
/// What counts as settled, as a part of the step.
const SETTLED: f64 = 0.02;

/// How a board steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Length, m.
    pub length_m: f64,
    /// Until it stays within 2 % of the length, s.
    pub settled_s: Option<f64>,
    /// Beyond the target, m.
    pub overshoot_m: f64,
    /// What is left at the end, m.
    pub error_m: f64,
}

/// What the moves have shown.
#[derive(Clone, Debug)]
pub struct Found {
    /// Of the valve.
    pub dead_zone: DeadZone,
    /// The rig file with that dead zone: what the diagnosis begins with.
    pub rig: RigFile,
    /// The log of the moves.
    pub log: Log,
    /// A step with the parameters of the rig file as given.
    pub before: Step,
}

/// Everything up to the diagnosis: the rig file's parameters, a step with them, dead zone, moves. Whatever comes of it, the board has
/// the parameters afterwards that it had, and is not running, unless it does not answer.
///
/// # Errors
/// As the search for the dead zone.
pub fn explore<P: Read + Write>(
    client: &mut Client<P>,
    rig: &RigFile,
    abort: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(String),
) -> Result<Found, SearchError> {
    let before = transfer::read(client)?;
    let found = explored(client, rig, &before, abort, tell);
    if observe::status(client)?.state == "run" {
        client.ask(Command::Disarm)?;
    }
    transfer::change(client, &Parameter::ALL.map(|parameter| (parameter, before.get(parameter))))?;
    found
}

fn explored<P: Read + Write>(
    client: &mut Client<P>,
    rig: &RigFile,
    before: &Settings,
    abort: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(String),
) -> Result<Found, SearchError> {
    let mut changes = of_rig(rig, before)?;
    // It warns only: its model is what is being looked for.
    changes.push((Parameter::Monitor, before.get(Parameter::Monitor).min(1.0)));
    transfer::change(client, &changes)?;
    wait_for_idle(client)?;
    tell("a step with the rig file as given".into());
    let first = step(client, abort)?;
    wait_for_idle(client)?;
    tell("the valve's dead zone".into());
    let dead_zone = dead_zone::search(client, &Search::default(), abort, tell)?;
    let mut rig = rig.clone();
    (rig.rig.valve.dead_zone_right_v, rig.rig.valve.dead_zone_left_v) = (dead_zone.right.volts, dead_zone.left.volts);
    let every = observe::version(client)?.tick_hz.div_ceil(RECORDS_PER_S);
    let [right, left] = dead_zone.changes();
    transfer::change(client, &[right, left, (Parameter::TelemetryEvery, every as f32)])?;
    wait_for_idle(client)?;
    let log = moves(client, abort, tell)?;
    Ok(Found { dead_zone, rig, log, before: first })
}

/// What a rig file changes.
fn of_rig(rig: &RigFile, present: &Settings) -> Result<Vec<Change>, SearchError> {
    Ok(from_rig::from_rig(rig, present).map_err(SearchError::NotFound)?.changes)
}

fn wait_for_idle<P: Read + Write>(client: &mut Client<P>) -> Result<(), SearchError> {
    let first = observe::status(client)?.ticks;
    loop {
        let status = observe::status(client)?;
        if status.state == "idle" {
            return Ok(());
        }
        if status.ticks.wrapping_sub(first) > 5000 {
            let text = format!("the board is `{}` and does not become `idle`; see `status`", status.state);
            return Err(SearchError::NotFound(text));
        }
    }
}

/// Watches a board that runs for so long; every answer is seen.
fn watch<P: Read + Write>(
    client: &mut Client<P>,
    ticks: u32,
    abort: &dyn Fn() -> bool,
    mut see: impl FnMut(&Status),
) -> Result<(), SearchError> {
    let mut begun = None;
    loop {
        if abort() {
            return Err(SearchError::Aborted);
        }
        let status = observe::status(client)?;
        if status.state != "run" {
            return Err(SearchError::NotFound(format!("the board went to `{}` in the midst of a move", status.state)));
        }
        see(&status);
        if status.ticks.wrapping_sub(*begun.get_or_insert(status.ticks)) >= ticks {
            return Ok(());
        }
    }
}

fn span_m(settings: &Settings) -> f64 {
    f64::from(settings.get(Parameter::SetpointHigh) - settings.get(Parameter::SetpointLow))
}

fn middle_um(settings: &Settings) -> i32 {
    (0.5e6 * f64::from(settings.get(Parameter::SetpointHigh) + settings.get(Parameter::SetpointLow))).round() as i32
}

/// Positions at which codes are read, m.
fn position_m(settings: &Settings, status: &Status) -> f64 {
    let [[low, high], ..] = settings.control_parameters().calibrated_ranges();
    low + (high - low) * f64::from(status.codes[0]) / observe::TOP_CODE
}

/// Arms, moves to the middle, steps, disarms.
///
/// # Errors
/// The board does not run, or it was broken off.
pub fn step<P: Read + Write>(client: &mut Client<P>, abort: &dyn Fn() -> bool) -> Result<Step, SearchError> {
    wait_for_idle(client)?;
    let (settings, tick_hz) = (transfer::read(client)?, observe::version(client)?.tick_hz);
    let (part, seconds) = STEP;
    let length_m = part * span_m(&settings);
    let from_um = middle_um(&settings);
    let to_um = from_um + (length_m * 1.0e6).round() as i32;
    let span = (seconds * f64::from(tick_hz)) as u32;
    client.ask(Command::Arm)?;
    client.ask(Command::Generate(Generator::Hold { position_um: from_um }))?;
    watch(client, span, abort, |_| ())?;
    client.ask(Command::Generate(Generator::Hold { position_um: to_um }))?;
    let (mut seen, mut begun) = (Vec::new(), None);
    watch(client, span, abort, |status| {
        let ticks = status.ticks.wrapping_sub(*begun.get_or_insert(status.ticks));
        seen.push((f64::from(ticks) / f64::from(tick_hz), position_m(&settings, status) - 1.0e-6 * f64::from(to_um)));
    })?;
    client.ask(Command::Disarm)?;
    let last_outside = seen.iter().rposition(|(_, error)| error.abs() > SETTLED * length_m);
    let tail: Vec<f64> = seen.iter().rev().take(20).map(|(_, error)| *error).collect();
    Ok(Step {
        length_m,
        settled_s: match last_outside {
            None => Some(0.0),
            Some(at) => seen.get(at + 1).map(|(t_s, _)| *t_s),
        },
        overshoot_m: seen.iter().map(|(_, error)| *error).fold(0.0, f64::max),
        error_m: tail.iter().sum::<f64>() / tail.len().max(1) as f64,
    })
}

/// The board's next records.
fn samples<P: Read + Write>(client: &mut Client<P>) -> Result<Samples, SearchError> {
    match client.ask(Command::Samples)? {
        Reply::Samples(samples) => Ok(samples),
        _ => Err(BoardError::Unexpected.into()),
    }
}

/// Shows the records of a board that runs, one by one, as long as `more` wants them.
fn record<P: Read + Write>(
    client: &mut Client<P>,
    abort: &dyn Fn() -> bool,
    mut more: impl FnMut(&Sample) -> bool,
) -> Result<(), SearchError> {
    loop {
        if abort() {
            return Err(SearchError::Aborted);
        }
        for sample in samples(client)? {
            match mode_from_number(sample.mode) {
                Some(Mode::Run) if more(&sample) => {}
                Some(Mode::Run) => return Ok(()),
                mode => {
                    let word = mode.map_or_else(|| sample.mode.to_string(), |mode| mode.to_string());
                    return Err(SearchError::NotFound(format!("the board went to `{word}` in the midst of a move")));
                }
            }
        }
    }
}

/// The moves, and their log.
fn moves<P: Read + Write>(
    client: &mut Client<P>,
    abort: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(String),
) -> Result<Log, SearchError> {
    let (settings, tick_hz) = (transfer::read(client)?, f64::from(observe::version(client)?.tick_hz));
    let ranges = settings.control_parameters().calibrated_ranges();
    let [low_v, high_v] = settings.control_parameters().valve_range_v.map(f64::from);
    let (mut rows, mut begun) = (Vec::new(), None);
    client.ask(Command::Arm)?;
    // What was kept before is not of these moves.
    while samples(client)?.len() == SAMPLES {}
    for (part, seconds) in MOVES {
        let amplitude_m = part * span_m(&settings);
        tell(format!("moves of ± {:.1} mm for {seconds:.0} s", 1.0e3 * amplitude_m));
        client.ask(Command::Generate(Generator::Repeat {
            shape: Shape::Identification,
            centre_um: middle_um(&settings),
            amplitude_um: (amplitude_m * 1.0e6).round() as i32,
            period_ms: (seconds * 1.0e3) as u32,
        }))?;
        let mut since = None;
        record(client, abort, |sample| {
            let ticks = sample.tick.wrapping_sub(*begun.get_or_insert(sample.tick));
            let u_v = low_v + (high_v - low_v) * f64::from(sample.held) / 4095.0;
            let quantity = |channel: usize| {
                let [low, high] = ranges[channel];
                low + (high - low) * f64::from(sample.codes[channel]) / observe::TOP_CODE
            };
            let row = [f64::from(ticks) / tick_hz, quantity(0), u_v, quantity(1), quantity(2), quantity(3)];
            if rows.last().is_none_or(|last: &[f64; 6]| row[0] > last[0]) {
                rows.push(row);
            }
            f64::from(sample.tick.wrapping_sub(*since.get_or_insert(sample.tick))) < seconds * tick_hz
        })?;
    }
    client.ask(Command::Disarm)?;
    let column = |at: usize| rows.iter().map(|row| row[at]).collect::<Vec<f64>>();
    let supply = settings.get(Parameter::SupplySensor) > 0.5;
    Ok(Log {
        t_s: column(0),
        y_m: column(1),
        u_v: Some(column(2)),
        p_a_pa: Some(column(3)),
        p_b_pa: Some(column(4)),
        p_sup_pa: supply.then(|| column(5)),
        ..Log::default()
    })
}

/// Puts a rig file's parameters in force, with the dead zone less its uncertainty, and steps again.
///
/// # Errors
/// The board refuses them, or the step fails.
pub fn apply<P: Read + Write>(
    client: &mut Client<P>,
    extended: &RigFile,
    dead_zone: &DeadZone,
    abort: &dyn Fn() -> bool,
) -> Result<Step, SearchError> {
    let present = transfer::read(client)?;
    let mut changes = of_rig(extended, &present)?;
    // What was measured at the valve itself is better known than what moves show of it.
    changes.retain(|(parameter, _)| ![Parameter::DeadZoneRight, Parameter::DeadZoneLeft].contains(parameter));
    changes.extend(dead_zone.changes());
    transfer::change(client, &changes)?;
    step(client, abort)
}
