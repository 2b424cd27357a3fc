//! A search for the valve's dead zone with the air on: small valve voltages in small steps, until a chamber's pressure begins to
//! change or the piston to move.
//!
//! The board's proportional law makes the voltages: with the gain `K`, a reference `u / K` away from the resting piston asks the
//! valve for `u`. If the piston starts to move, it moves towards the reference, and the voltage falls by itself: the piston cannot
//! go further than a tenth of its range. First in steps of 50 mV, then once more over the last of them in steps of 10 mV; both
//! directions, several passes. The parameters that the search changes are put back at the end, however it ends.

use super::observe::{self, Observation, Signal};
use super::transfer::{self, TransferError};
use super::{Change, calibrate::Channel};
use crate::board::{BoardError, Client};
use board_link::{Command, Generator, Parameter, Status};
use firmware_core::Settings;
use std::io::{Read, Write};

/// What is searched, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Largest voltage tried, V.
    pub limit_v: f64,
    /// Passes in each direction.
    pub passes: usize,
}

impl Default for Search {
    /// Up to 1 V: dead zones of proportional valves of 10 V are below ±0.6 V.
    fn default() -> Self {
        Self { limit_v: 1.0, passes: 2 }
    }
}

/// Steps of the first and of the second look, V. The uncertainty is half of the second.
const STEPS_V: [f64; 2] = [0.05, 0.01];
/// Part of the setpoint's range that the piston may move at most to either side.
const REACH: f64 = 0.1;
/// How long a voltage stands, s: 10 mV beyond a dead zone change 250 cm3 by 5 kPa in this time.
const DWELL_S: f64 = 0.2;
/// Answers whose mean tells that air flows: some 30 ms, in which 10 mV beyond a dead zone change 250 cm3 by 1.5 kPa.
const RECENT: usize = 4;
/// A change of the pressures beyond so many standard errors is flow. The errors are estimated from some 25 samples: by chance
/// (Student's t, 23 degrees of freedom) 4 in a million looks at a channel go beyond, one search in a hundred.
const SIGNIFICANT: f64 = 6.0;
/// A change of less, Pa, is no flow: twenty codes of a 10 bar sensor.
const LEAST_PA: f64 = 300.0;
/// A piston that drifts by less in half the time that a voltage stands is still, m.
const STILL_M: f64 = 1.0e-4;
/// How often the piston is waited for to come to rest.
const PATIENCE: usize = 40;

/// One direction's result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Valve voltage about mid at which flow begins, V.
    pub volts: f64,
    /// Half-width of the interval it lies in: the step, or the spread of the passes if that is larger; V.
    pub uncertainty_v: f64,
}

impl Edge {
    /// What to compensate: never more than there is, or the piston hunts. V.
    #[must_use]
    pub fn safe_v(&self) -> f64 {
        self.volts.signum() * (self.volts.abs() - self.uncertainty_v).max(0.0)
    }
}

/// Both break-points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadZone {
    /// Where chamber A begins to fill, V.
    pub right: Edge,
    /// Where chamber B begins to fill, V.
    pub left: Edge,
}

impl DeadZone {
    /// The parameters that compensate it, rounded to millivolts.
    #[must_use]
    pub fn changes(&self) -> [Change; 2] {
        let volts = |edge: &Edge| ((edge.safe_v() * 1.0e3).round() / 1.0e3) as f32;
        [(Parameter::DeadZoneRight, volts(&self.right)), (Parameter::DeadZoneLeft, volts(&self.left))]
    }
}

/// Why nothing was found.
#[derive(Clone, Debug, PartialEq)]
pub enum SearchError {
    /// The board, or its parameters.
    Transfer(TransferError),
    /// It was broken off.
    Aborted,
    /// A sentence with the remedy.
    NotFound(String),
}

impl From<BoardError> for SearchError {
    fn from(error: BoardError) -> Self {
        Self::Transfer(error.into())
    }
}

impl From<TransferError> for SearchError {
    fn from(error: TransferError) -> Self {
        Self::Transfer(error)
    }
}

/// Searches. The board must be idle, with air; `abort` is asked between the steps, `tell` hears what is going on.
///
/// # Errors
/// See [`SearchError`]. The board is idle then, with the parameters it had, unless it does not answer.
pub fn search<P: Read + Write>(
    client: &mut Client<P>,
    search: &Search,
    abort: &dyn Fn() -> bool,
    tell: &mut dyn FnMut(String),
) -> Result<DeadZone, SearchError> {
    let before = transfer::read(client)?;
    let status = observe::status(client)?;
    if status.state != "idle" {
        return Err(SearchError::NotFound(format!(
            "the board is `{}` and must be `idle`: acknowledge or disarm it first",
            status.state
        )));
    }
    if status.bench {
        return Err(SearchError::NotFound(
            "in bench mode there is no valve to search; switch it off: `bench off`".into(),
        ));
    }
    let reach_m = REACH * f64::from(before.get(Parameter::SetpointHigh) - before.get(Parameter::SetpointLow));
    let gain = search.limit_v / reach_m;
    let temporary = [
        // The voltages are the proportional law's.
        (Parameter::Law, 0.0),
        (Parameter::Gain, gain as f32),
        (Parameter::DeadZoneRight, 0.0),
        (Parameter::DeadZoneLeft, 0.0),
        (Parameter::DeadZoneBlend, 0.0),
        (Parameter::SetpointVelocity, 0.0),
        (Parameter::SetpointAcceleration, 0.0),
        // Its model has the dead zone that is being looked for.
        (Parameter::Monitor, before.get(Parameter::Monitor).min(1.0)),
    ];
    transfer::change(client, &temporary)?;
    let tick_hz = observe::version(client)?.tick_hz;
    let settings = transfer::read(client)?;
    let mut run = Run { client, settings: &settings, gain, reach_m, tick_hz, abort };
    let found = run.both(search, tell);
    // Whatever came of it: valve to mid, parameters back. A board that has tripped is not running any more.
    let disarmed = run.client.ask(Command::Disarm);
    let restored = temporary.map(|(parameter, _)| (parameter, before.get(parameter)));
    transfer::change(run.client, &restored)?;
    let found = found?;
    disarmed?;
    Ok(found)
}

/// A search under way.
struct Run<'a, P> {
    client: &'a mut Client<P>,
    settings: &'a Settings,
    gain: f64,
    reach_m: f64,
    tick_hz: u32,
    abort: &'a dyn Fn() -> bool,
}

impl<P: Read + Write> Run<'_, P> {
    fn both(&mut self, search: &Search, tell: &mut dyn FnMut(String)) -> Result<DeadZone, SearchError> {
        // The self-test follows new parameters.
        self.wait_for("idle")?;
        self.client.ask(Command::Arm)?;
        let mut edges = [Vec::new(), Vec::new()];
        for pass in 1..=search.passes.max(1) {
            for (side, found) in [1.0, -1.0].into_iter().zip(&mut edges) {
                let interval = self.edge(side, search.limit_v)?;
                tell(format!("pass {pass}: flow begins between {:+.3} and {:+.3} V", interval[0], interval[1]));
                found.push(interval);
            }
        }
        let [right, left] = edges.map(|intervals| {
            let middle = |[a, b]: &[f64; 2]| 0.5 * (a + b);
            let middles: Vec<f64> = intervals.iter().map(middle).collect();
            let volts = middles.iter().sum::<f64>() / middles.len() as f64;
            let spread = middles.iter().map(|middle| (middle - volts).abs()).fold(0.0, f64::max);
            let width = intervals.iter().map(|[a, b]| 0.5 * (b - a).abs()).fold(0.0, f64::max);
            Edge { volts, uncertainty_v: width.max(spread) }
        });
        Ok(DeadZone { right, left })
    }

    fn wait_for(&mut self, state: &str) -> Result<(), SearchError> {
        let mut last = String::new();
        for _ in 0..PATIENCE {
            last =
                observe::ticks(self.client, self.tick_hz / 10)?.statuses.last().map_or(last, |s| s.state.to_string());
            if last == state {
                return Ok(());
            }
        }
        Err(SearchError::NotFound(format!("the board is `{last}` and does not become `{state}`; see `status`")))
    }

    /// One answer of a board that still runs.
    fn look(&mut self) -> Result<Status, SearchError> {
        if (self.abort)() {
            return Err(SearchError::Aborted);
        }
        let status = observe::status(self.client)?;
        if status.state == "run" {
            return Ok(status);
        }
        Err(SearchError::NotFound(format!(
            "the board went to `{}` in the midst of the search; docs/commissioning.md says what that means",
            status.state
        )))
    }

    /// Watches for the time that a voltage stands, or until air flows: until the mean of the last few answers has left that of
    /// `before`, in a pressure, or in the position of a piston that a little force moves. Returns what was seen, and, if it was
    /// flow, its direction: positive fills chamber A.
    fn watch(&mut self, before: Option<&Observation>) -> Result<(Observation, Option<f64>), SearchError> {
        let mut seen = Observation::default();
        let mut begun = None;
        loop {
            let status = self.look()?;
            let begun = *begun.get_or_insert(status.ticks);
            let over = f64::from(status.ticks.wrapping_sub(begun)) >= DWELL_S * f64::from(self.tick_hz);
            seen.statuses.push(status);
            if let (Some(before), Some(last)) = (before, seen.last(RECENT))
                && let Some(direction) = self.left(before, &last)
            {
                return Ok((seen, Some(direction)));
            }
            if over {
                return Ok((seen, None));
            }
        }
    }

    /// In which direction something has changed, if it has.
    fn left(&self, before: &Observation, last: &Observation) -> Option<f64> {
        let samples = [before, last].map(|seen| 1.0 / seen.statuses.len() as f64);
        let change = |channel: Channel, least: f64| {
            let [old, new] = [before, last].map(|seen| seen.quantity(self.settings, channel.index()));
            let error = old.noise * (samples[0] + samples[1]).sqrt();
            (new.mean - old.mean, least.max(SIGNIFICANT * error))
        };
        let signals = [
            (1.0, change(Channel::PressureA, LEAST_PA)),
            (-1.0, change(Channel::PressureB, LEAST_PA)),
            (1.0, change(Channel::Position, STILL_M)),
        ];
        // By the signal that tells it most clearly.
        let (sign, (change, limit)) = signals
            .into_iter()
            .max_by(|(_, (a, of_a)), (_, (b, of_b))| (a.abs() / of_a).total_cmp(&(b.abs() / of_b)))?;
        (change.abs() > limit).then_some(sign * change.signum())
    }

    /// Brings piston and pressures to rest with the valve at mid; returns what is seen then.
    fn rest(&mut self) -> Result<Observation, SearchError> {
        let mut before = None;
        for _ in 0..PATIENCE {
            let (seen, flow) = self.watch(before.as_ref())?;
            let y = self.position(&seen);
            self.hold(y.mean)?;
            if before.is_some() && flow.is_none() && y.drift.abs() < STILL_M.max(SIGNIFICANT * y.drift_error) {
                return Ok(seen);
            }
            before = Some(seen);
        }
        Err(SearchError::NotFound(
            "the pressures do not come to rest with the valve at mid: it has no dead zone to compensate, or chambers or hoses leak; \
             leave dead_zone_right_v and dead_zone_left_v at 0, or mend the leak"
                .into(),
        ))
    }

    fn position(&self, seen: &Observation) -> Signal {
        seen.quantity(self.settings, Channel::Position.index())
    }

    fn hold(&mut self, position_m: f64) -> Result<(), SearchError> {
        let position_um = (position_m * 1.0e6).round() as i32;
        self.client.ask(Command::Generate(Generator::Hold { position_um }))?;
        Ok(())
    }

    /// The interval of voltages in which flow begins, in the direction `side`.
    fn edge(&mut self, side: f64, limit_v: f64) -> Result<[f64; 2], SearchError> {
        let [coarse, fine] = STEPS_V;
        let [below, _] = self.climb(side, 0.0, coarse, limit_v)?;
        self.climb(side, (below.abs() - coarse).max(0.0), fine, limit_v)
    }

    /// Raises the voltage step by step from rest until air flows; the voltages are those that the valve was given.
    fn climb(&mut self, side: f64, from_v: f64, step_v: f64, limit_v: f64) -> Result<[f64; 2], SearchError> {
        let mut before = self.rest()?;
        let rest_m = self.position(&before).mean;
        let [low, high] =
            [Parameter::SetpointLow, Parameter::SetpointHigh].map(|end| f64::from(self.settings.get(end)));
        if !(low..=high).contains(&(rest_m + side * self.reach_m)) {
            return Err(SearchError::NotFound(format!(
                "the piston stands at {rest_m:.3} m, too near to an end for a move of {:.3} m; move it to the middle first",
                self.reach_m
            )));
        }
        let mut below = 0.0;
        let mut volts = from_v;
        while volts < limit_v {
            volts += step_v;
            self.hold(rest_m + side * volts / self.gain)?;
            let (seen, flow) = self.watch(Some(&before))?;
            // As the valve got it: the piston may have crept.
            let given = seen.valve_v(self.settings).mean;
            if let Some(direction) = flow {
                // Enough: what has begun to move shall not get far.
                self.hold(seen.last(1).map_or(rest_m, |last| self.position(&last).mean))?;
                return if direction * side > 0.0 {
                    Ok([below, given])
                } else {
                    Err(SearchError::NotFound(format!(
                        "at {given:+.3} V the pressures change the wrong way: the valve's ports or the two pressure sensors are \
                         exchanged (docs/wiring.md)"
                    )))
                };
            }
            (below, before) = (given, seen);
        }
        Err(SearchError::NotFound(format!(
            "no air flows up to {:+.2} V: is the air on (PB0, dump valve, supply), is the valve supplied and its setpoint wire \
             connected? a larger dead zone wants --limit",
            side * limit_v
        )))
    }
}
