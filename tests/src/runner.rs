//! Closes the loop: plant and converters on this computer, the control step wherever the target is.

use crate::fault::Kind;
use crate::scenario::{ReferenceSegment, Scenario, Start};
use crate::sensors::FaultySensors;
use crate::target::{HostTarget, Target, TargetError};
use control::program::{Program, ProgramState};
use control::{AdcCode, ControllerState, Inputs, Mode, Position, Reason};
use plant_model::{Simulator, Stepper, Tolerance};
use std::collections::VecDeque;

/// What came of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The mode at the end.
    pub end: Mode,
    /// The first fault's reason and the time from the first fault of the scenario to the safe state, s; without a fault,
    /// from the beginning.
    pub tripped: Option<(Reason, f64)>,
    /// Furthest the piston went, after the first fault, outside the span of where it was then and where it was sent
    /// afterwards, m.
    pub excursion_m: f64,
    /// Entry `k` is the time from the first fault until that excursion reached `k + 1` mm, s.
    pub millimetres_s: Vec<f64>,
    /// Largest |position − reference| in the last tenth, m.
    pub final_error_m: f64,
    /// Furthest beyond the last reference, seen from where the piston began, m.
    pub overshoot_m: f64,
    /// FNV-1a over all codes and modes, to compare targets.
    pub fingerprint: u64,
    /// Ticks run.
    pub ticks: u64,
}

/// What an observer sees each tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub t_s: f64,
    /// Where the piston should be, m, before any limiter.
    pub reference_m: f64,
    /// Where it is, m.
    pub position_m: f64,
    /// Velocity, m/s.
    pub velocity_m_per_s: f64,
    /// True chamber pressures, Pa absolute.
    pub pressures_pa: [f64; 2],
    /// What the controller was given: position, A, B, supply.
    pub codes: [u16; 4],
    /// What it answered.
    pub dac: u16,
    /// Its mode.
    pub mode: Mode,
    /// Whether a controlled stop is under way.
    pub stopping: bool,
}

/// How long the independent watchdog waits for a tick, s; as on the board.
const WATCHDOG_S: f64 = 0.020;

/// Runs a scenario on the host and returns what came of it.
///
/// # Errors
/// The scenario's parameters are refused by controller, monitor or plant.
pub fn run(scenario: &Scenario) -> Result<Outcome, TargetError> {
    run_observed(scenario, &mut host_target(scenario)?, |_| ())
}

/// The firmware's loop on this computer, made for a scenario.
///
/// # Errors
/// As [`run`].
pub fn host_target(scenario: &Scenario) -> Result<HostTarget, TargetError> {
    let rig = scenario.rig_file().map_err(|error| TargetError(error.to_string()))?;
    let parameters = scenario.parameters(&scenario.name).map_err(|error| TargetError(error.to_string()))?;
    let state = match scenario.start {
        Start::Armed => ControllerState::armed(),
        Start::Boot => ControllerState::boot(None),
    };
    let monitor = scenario.monitor.enabled.then_some(&scenario.monitor.parameters);
    HostTarget::new(&rig, &parameters, monitor, scenario.output_delay_ticks, state)
}

/// Runs a scenario on a target, showing every tick to `observe`.
///
/// # Errors
/// The target gave up, or plant or program refuse the scenario's numbers.
pub fn run_observed(
    scenario: &Scenario,
    target: &mut dyn Target,
    mut observe: impl FnMut(&Sample),
) -> Result<Outcome, TargetError> {
    let fail = |error: &dyn std::fmt::Display| TargetError(error.to_string());
    let mut rig = scenario.rig_file().map_err(|error| fail(&error))?;
    scenario.deviation.spoil(&mut rig);
    let plant = plant_model::Plant::new(&rig.rig, &rig.effects).map_err(|error| fail(&error))?;
    let [p_a, p_b] = rig.rig.equilibrium_pressures_pa();
    let begin = plant.state_at_rest(scenario.initial_position_m, p_a, p_b);
    let mut simulator = Simulator::<f64>::from_state(plant, begin, Stepper::adaptive(&Tolerance::standard()));
    let mut sensors = FaultySensors::new(&rig.io, &scenario.noise, scenario.seed, &scenario.fault);
    let mut references = References::new(&scenario.reference, rig.io.tick_hz, scenario.initial_position_m)?;
    let valve = rig.io.valve();
    let tick_s = rig.io.tick_s();
    let ticks = (scenario.duration_s / tick_s).round() as u64;
    let onset_s = scenario.fault.iter().map(|fault| fault.at_s).fold(f64::INFINITY, f64::min);

    // What the valve holds before the first code arrives: mid position.
    let mid = valve.code(0.0) as u16;
    let mut latched: VecDeque<u16> = std::iter::repeat_n(mid, usize::from(scenario.output_delay_ticks)).collect();
    let (mut dac, mut mode, mut stopping) = (mid, Mode::Boot, false);
    let (mut held_u, mut jammed_u) = (0.0, None);
    let mut last_codes = [0; 4];
    let mut missed = 0_u8;
    let watchdog_ticks = (WATCHDOG_S / tick_s).round() as u64;
    let mut silent_ticks = 0;
    let mut supply_pa = rig.rig.supply.pressure_pa;
    let mut outcome = Outcome {
        end: Mode::Boot,
        tripped: None,
        excursion_m: 0.0,
        millimetres_s: Vec::new(),
        final_error_m: 0.0,
        overshoot_m: 0.0,
        fingerprint: 0xcbf2_9ce4_8422_2325,
        ticks,
    };
    let mut span: Option<(f64, f64)> = None;
    let last_reference = references.last_position();
    let direction = (last_reference - scenario.initial_position_m).signum();

    for n in 0..ticks {
        let t_s = n as f64 * tick_s;
        let active = |kind: Kind| scenario.fault.iter().find(|fault| fault.kind == kind && fault.active(t_s));
        let since = |at_s: f64| ((t_s - at_s) / tick_s).round().max(0.0) as u64;
        let hit = |kind: Kind| active(kind).is_some_and(|fault| fault.hits(since(fault.at_s)));

        let truth = simulator.measure();
        let state = *simulator.state();
        let mut codes = sensors.codes(&truth, t_s, &scenario.fault);
        let reference_m = references.at(t_s);
        let (dropped, late, overrun) = (hit(Kind::DroppedTicks), hit(Kind::LateTicks), hit(Kind::Overrun));
        if overrun {
            std::mem::swap(&mut codes, &mut last_codes);
        } else {
            last_codes = codes;
        }
        silent_ticks = if dropped { silent_ticks + 1 } else { 0 };
        if silent_ticks == watchdog_ticks && target.has_watchdog() {
            target.watchdog_reset()?;
            // A reset takes the DAC to mid at once, latch and all.
            (dac, mode, stopping) = (mid, Mode::Safe(Reason::WatchdogReset), false);
            latched.iter_mut().for_each(|code| *code = mid);
        }
        if !dropped {
            let inputs = Inputs {
                reference: Position::saturating_from_num(reference_m),
                position: AdcCode(codes[0]),
                pressure_a: AdcCode(codes[1]),
                pressure_b: AdcCode(codes[2]),
                supply: Some(AdcCode(codes[3])),
                command: scenario
                    .command
                    .iter()
                    .find(|c| since(c.at_s) == 0 && t_s + 0.5 * tick_s >= c.at_s)
                    .map(|c| c.command),
                host_heard: active(Kind::HostSilent).is_none(),
                faults: control::ExternalFaults {
                    missed_ticks: missed,
                    late_tick: late,
                    overrun,
                    model_disagreement: false,
                    contradicts: None,
                    valve_output: active(Kind::ValveOutput).is_some(),
                },
            };
            let answer = target.tick(&inputs)?;
            (dac, mode, stopping) = (answer.dac.0, answer.mode, answer.stopping);
            for byte in codes.iter().chain([&dac]).flat_map(|code| code.to_le_bytes()) {
                outcome.fingerprint = (outcome.fingerprint ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        } else {
            target.lose_tick()?;
        }
        missed = if dropped { missed.saturating_add(1) } else { 0 };
        if let (Mode::Safe(reason), None) = (mode, outcome.tripped) {
            let from = if onset_s.is_finite() { onset_s } else { 0.0 };
            outcome.tripped = Some((reason, t_s + tick_s - from));
        }

        if t_s >= onset_s {
            let (low, high) = span.get_or_insert((state.y_m, state.y_m));
            (*low, *high) = (low.min(reference_m), high.max(reference_m));
            outcome.excursion_m = outcome.excursion_m.max(*low - state.y_m).max(state.y_m - *high);
            let millimetres = (1.0e3 * outcome.excursion_m) as usize;
            outcome.millimetres_s.resize(millimetres.max(outcome.millimetres_s.len()), t_s - onset_s);
        }
        outcome.overshoot_m = outcome.overshoot_m.max((state.y_m - last_reference) * direction);
        if n >= ticks - ticks / 10 - 1 {
            outcome.final_error_m = outcome.final_error_m.max((state.y_m - reference_m).abs());
        }
        observe(&Sample {
            t_s,
            reference_m,
            position_m: state.y_m,
            velocity_m_per_s: state.v_m_per_s,
            pressures_pa: [state.p_a_pa, state.p_b_pa],
            codes,
            dac,
            mode,
            stopping,
        });

        latched.push_back(dac);
        let code = latched.pop_front().unwrap_or(mid);
        let u = valve.quantity(u32::from(code));
        if active(Kind::JammedValve).is_some() {
            jammed_u.get_or_insert(held_u);
        } else {
            jammed_u = None;
        }
        let new_u = jammed_u.unwrap_or(u);
        let air = stopping || matches!(mode, Mode::Idle | Mode::Run);
        let dumped = scenario.dump_valve_s.filter(|_| !air);
        if let Some(time_constant_s) = active(Kind::SupplyLoss).map(|fault| fault.time_constant_s).or(dumped) {
            let fallen = (supply_pa - rig.rig.supply.atmosphere_pa) * (-tick_s / time_constant_s).exp();
            supply_pa = rig.rig.supply.atmosphere_pa + fallen;
        } else {
            supply_pa = rig.rig.supply.pressure_pa;
        }
        let inputs = |u_v: f64| plant_model::Inputs { u_v, external_force_n: 0.0, supply_pa };
        if late {
            simulator.advance_with(&inputs(held_u), 0.5 * tick_s);
            simulator.advance_with(&inputs(new_u), 0.5 * tick_s);
        } else {
            simulator.advance_with(&inputs(new_u), tick_s);
        }
        held_u = new_u;
    }
    outcome.end = mode;
    Ok(outcome)
}

/// The reference over time.
struct References {
    segments: Vec<(ReferenceSegment, Option<(Program, ProgramState)>)>,
    /// Segments that have begun.
    begun: usize,
    initial_m: f64,
}

impl References {
    fn new(segments: &[ReferenceSegment], tick_hz: u32, initial_m: f64) -> Result<Self, TargetError> {
        let mut prepared = Vec::new();
        for segment in segments {
            let program = match &segment.program {
                None => None,
                Some(program) => Some((
                    Program::from_parameters(program, tick_hz).map_err(|error| TargetError(error.to_string()))?,
                    ProgramState::default(),
                )),
            };
            prepared.push((*segment, program));
        }
        Ok(Self { segments: prepared, begun: 0, initial_m })
    }

    /// The reference at a time; called once per tick.
    fn at(&mut self, t_s: f64) -> f64 {
        while self.segments.get(self.begun).is_some_and(|(segment, _)| segment.at_s <= t_s) {
            self.begun += 1;
        }
        let Some((segment, program)) = self.begun.checked_sub(1).and_then(|n| self.segments.get_mut(n)) else {
            return self.initial_m;
        };
        match program {
            Some((program, state)) => program.advance(state).to_num(),
            None => segment.position_m.unwrap_or(self.initial_m),
        }
    }

    fn last_position(&self) -> f64 {
        self.segments.last().and_then(|(segment, _)| segment.position_m).unwrap_or(self.initial_m)
    }
}

impl Scenario {
    /// What of the expectations the outcome does not fulfil, as sentences.
    #[must_use]
    pub fn complaints(&self, outcome: &Outcome) -> Vec<String> {
        let e = &self.expect;
        let mut complaints = Vec::new();
        let word = outcome.end.to_string();
        if let Some(expected) = &e.end_state
            && *expected != word
        {
            complaints.push(format!("ended in `{word}` instead of `{expected}`"));
        }
        if !e.end_state_one_of.is_empty() && !e.end_state_one_of.contains(&word) {
            complaints.push(format!("ended in `{word}` instead of one of {:?}", e.end_state_one_of));
        }
        if let Some(limit) = e.caught_within_s {
            match outcome.tripped {
                None => complaints.push("was never caught".into()),
                Some((reason, after)) if after > limit + 1e-9 => {
                    complaints.push(format!("was caught ({reason}) after {after:.4} s, allowed {limit} s"));
                }
                Some(_) => (),
            }
        }
        let mut bound = |what: &str, value: f64, limit: Option<f64>, upper: bool| {
            if let Some(limit) = limit
                && (value > limit) == upper
            {
                complaints.push(format!("{what} is {value:.6} m, bound {limit} m"));
            }
        };
        bound("excursion", outcome.excursion_m, e.max_excursion_m, true);
        bound("final error", outcome.final_error_m, e.final_error_below_m, true);
        bound("final error", outcome.final_error_m, e.final_error_above_m, false);
        bound("overshoot", outcome.overshoot_m, e.max_overshoot_m, true);
        bound("overshoot", outcome.overshoot_m, e.min_overshoot_m, false);
        complaints
    }
}
