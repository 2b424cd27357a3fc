//! One tick: sensor codes in, valve code out.

use crate::codes::{AdcCode, DacCode};
use crate::config::Config;
use crate::frozen::FreezeWatch;
use crate::modes::{Channel, Mode, OperatorCommand, Reason};
use crate::plausibility::{ChannelState, Fault, GLITCH_WEIGHT};
use crate::quantities::{Position, Pressure, Voltage};
use crate::servo::{Readings, ServoState, Stage};
use crate::setpoint::SetpointState;
use crate::stop::{Causes, Stop};

/// What the shell hands in each tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inputs {
    /// Where the piston should be, m; limited to the setpoint range.
    pub reference: Position,
    /// Piston position.
    pub position: AdcCode,
    /// Pressure of chamber A.
    pub pressure_a: AdcCode,
    /// Pressure of chamber B.
    pub pressure_b: AdcCode,
    /// Supply pressure; ignored when the configuration says that there is no such sensor. With the sensor configured,
    /// `None` counts as a code out of range.
    pub supply: Option<AdcCode>,
    /// A command of the operator, if one arrived since the last tick.
    pub command: Option<OperatorCommand>,
    /// Whether the host has been heard since the last tick.
    pub host_heard: bool,
    /// What the shell found wrong.
    pub faults: ExternalFaults,
}

/// A sensor that contradicts the rest, and what a pressure should read instead.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contradicts {
    /// The position.
    Position,
    /// The pressure of chamber A.
    PressureA(Pressure),
    /// The pressure of chamber B.
    PressureB(Pressure),
}

/// Faults that only the shell can see, each for this tick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExternalFaults {
    /// How many ticks between this one and the last did not happen.
    pub missed_ticks: u8,
    /// The last tick began or ended too late.
    pub late_tick: bool,
    /// A conversion was overwritten before it was read.
    pub overrun: bool,
    /// The on-board model cannot explain the readings; already debounced by the monitor.
    pub model_disagreement: bool,
    /// Of a disagreement: which sensor contradicts the rest, where that is known.
    pub contradicts: Option<Contradicts>,
    /// The valve output is not what was written; already debounced by the shell.
    pub valve_output: bool,
}

/// What the controller hands out each tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// What to write to the DAC.
    pub dac: DacCode,
    /// The mode after this tick.
    pub mode: Mode,
    /// The quantities behind it.
    pub telemetry: Telemetry,
}

/// The quantities of one tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Telemetry {
    /// The reference after the setpoint limiter.
    pub reference: Position,
    /// The position the law used: the last good reading.
    pub position: Position,
    /// Last good pressure of chamber A.
    pub pressure_a: Pressure,
    /// Last good pressure of chamber B.
    pub pressure_b: Pressure,
    /// Last good supply pressure; `None` without the sensor.
    pub supply: Option<Pressure>,
    /// Whether one of the chambers' pressures is not measured, or lost.
    pub pressure_lost: bool,
    /// Effective voltage `w` asked for by the law; zero unless running or in a controlled stop.
    pub w: Voltage,
    /// Valve voltage `u`, before rounding to a DAC code.
    pub u: Voltage,
}

/// Everything that one tick hands to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControllerState {
    mode: Mode,
    stop: Stop,
    reset: Option<Reason>,
    begin: bool,
    freeze: FreezeWatch,
    position: ChannelState,
    pressure_a: ChannelState,
    pressure_b: ChannelState,
    supply: ChannelState,
    setpoint: SetpointState,
    servo: ServoState,
    /// Whether the pressures of chamber A and B are lost this tick.
    lost: [bool; 2],
    supply_low: u16,
    missed: u16,
    late: u16,
    overrun: u16,
    host_silent: u32,
}

impl ControllerState {
    /// After power-on or reset: boot, self-test, then idle. A `reset` reason leads to safe instead, latched until the
    /// operator resets the fault.
    #[must_use]
    pub fn boot(reset: Option<Reason>) -> Self {
        Self { reset, ..Self::default() }
    }

    /// Already armed, self-test skipped: for simulation and for co-processes, where no one is there to arm.
    #[must_use]
    pub fn armed() -> Self {
        Self { mode: Mode::Run, begin: true, ..Self::default() }
    }

    /// The present mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Whether a controlled stop is under way: the mode is safe, the reason latched, and the valve still moves to equalise the
    /// chambers' forces.
    #[inline]
    #[must_use]
    pub fn stopping(&self) -> bool {
        self.stop.is_on()
    }

    /// Whether the readings should be those of one cylinder, tick by tick: in a run, and in a controlled stop that is for nothing
    /// but a silent host.
    #[inline]
    #[must_use]
    pub fn consistent(&self) -> bool {
        self.mode == Mode::Run || self.stop.is_for(Causes::HOST)
    }

    /// What the positioning law remembers.
    #[must_use]
    pub fn servo(&self) -> &ServoState {
        &self.servo
    }

    /// Whether a channel is known to be noisy, so that silence on it counts as stuck.
    #[must_use]
    pub fn noisy(&self, channel: Channel) -> bool {
        match channel {
            Channel::Position => self.position.noisy(),
            Channel::PressureA => self.pressure_a.noisy(),
            Channel::PressureB => self.pressure_b.noisy(),
            Channel::Supply => self.supply.noisy(),
        }
    }
}

/// Runs one tick; [`learn`] follows when the valve code is written.
#[inline]
pub fn step(config: &Config, state: &mut ControllerState, inputs: Inputs) -> Outputs {
    let fault = judge(config, state, &inputs);
    advance_mode(config, state, &inputs, fault);

    let position = Position::from_bits(state.position.good());
    let begin = state.begin && state.position.seen();
    if begin {
        state.setpoint = SetpointState::at(position);
        state.begin = false;
    }
    let (reference, w, u) = if state.mode == Mode::Run && state.position.seen() {
        let reference = config.setpoint.advance(&mut state.setpoint, inputs.reference);
        match &config.servo {
            None => {
                let w = config.law.effective_voltage(reference, position);
                (reference, w, config.inverse.valve_voltage(w))
            }
            Some(servo) => {
                let readings = readings(config, state, position);
                let stage = if begin { Stage::Begin } else { Stage::Run };
                let [u, w] = servo.step(&mut state.servo, stage, reference, &readings);
                (reference, w, u)
            }
        }
    } else {
        match &config.servo {
            Some(servo) if state.stopping() => {
                let mut readings = readings(config, state, position);
                if inputs.faults.model_disagreement {
                    let [p_a, p_b] = &mut readings.chambers;
                    let told = match inputs.faults.contradicts {
                        Some(Contradicts::PressureA(told)) => Some(p_a.insert(told)),
                        Some(Contradicts::PressureB(told)) => Some(p_b.insert(told)),
                        Some(Contradicts::Position) | None => None,
                    };
                    if told.is_some() {
                        servo.believe(&mut state.servo, &readings);
                    }
                }
                let [u, w] = servo.step(&mut state.servo, Stage::Stop, position, &readings);
                (position, w, u)
            }
            _ => (position, Voltage::ZERO, config.safe_voltage),
        }
    };
    Outputs {
        dac: config.dac.code(u),
        mode: state.mode,
        telemetry: Telemetry {
            reference,
            position,
            pressure_a: Pressure::from_bits(state.pressure_a.good()),
            pressure_b: Pressure::from_bits(state.pressure_b.good()),
            supply: config.supply_sensor.then(|| Pressure::from_bits(state.supply.good())),
            pressure_lost: state.lost != [false; 2],
            w,
            u,
        },
    }
}

/// What the positioning law learns of the tick; to be called once the valve code is written, it counts from the next tick on.
#[inline]
pub fn learn(config: &Config, state: &mut ControllerState) {
    if let Some(servo) = &config.servo {
        servo.learn(&mut state.servo);
    }
}

/// What the positioning law sees. In a controlled stop a failed position reads as the reference at the trip, a failed pressure follows
/// from the modelled force, and a failed or low supply counts as nominal.
#[inline]
fn readings(config: &Config, state: &ControllerState, y: Position) -> Readings {
    let read = |channel: &ChannelState| Pressure::from_bits(channel.good());
    let [lost_a, lost_b] = state.lost;
    let failed = |cause: Causes| state.stop.is_for(cause);
    Readings {
        y: if failed(Causes::POSITION) { state.servo.motion.position() } else { y },
        chambers: [
            (!lost_a && !failed(Causes::PRESSURE_A)).then(|| read(&state.pressure_a)),
            (!lost_b && !failed(Causes::PRESSURE_B)).then(|| read(&state.pressure_b)),
        ],
        supply: (config.supply_sensor && !failed(Causes::SUPPLY)).then(|| read(&state.supply)),
    }
}

/// What is wrong in a tick.
#[derive(Clone, Copy)]
struct Faults {
    /// The most telling reason to leave the mode.
    reason: Option<Reason>,
    /// Everything.
    causes: Causes,
}

/// What is wrong this tick.
#[inline]
fn judge(config: &Config, state: &mut ControllerState, inputs: &Inputs) -> Faults {
    let testing = !matches!(state.mode, Mode::Run | Mode::Idle);
    // Before the first good reading, nothing tells an end stop from a broken wire.
    let rail_is_fault = config.position_rail_is_fault || testing || !state.position.seen();
    // Every channel takes its code every tick, whatever the others say.
    let position = config.position.check(&mut state.position, inputs.position, rail_is_fault);
    let [mut pressure_a, mut pressure_b] = if config.pressure_sensors {
        let [step_a, step_b] = pressure_steps(config, state);
        [
            config.pressure_a.check_step(&mut state.pressure_a, inputs.pressure_a, true, step_a),
            config.pressure_b.check_step(&mut state.pressure_b, inputs.pressure_b, true, step_b),
        ]
    } else {
        [None; 2]
    };
    // Before the first good reading there is none to bridge with.
    let seen = [state.pressure_a.seen(), state.pressure_b.seen()].map(|seen| seen && config.pressure_sensors);
    state.lost = [pressure_a.is_some() || !seen[0], pressure_b.is_some() || !seen[1]];
    if !config.pressure_loss_trips {
        (pressure_a, pressure_b) = (None, None);
    }
    let supply = if config.supply_sensor {
        config.supply.check(&mut state.supply, inputs.supply.unwrap_or(AdcCode(0)), true)
    } else {
        None
    };
    let difference = state.pressure_a.good().saturating_sub(state.pressure_b.good());
    // An obstacle shows in both pressures alone.
    let frozen = state.freeze.frozen(&config.freeze, inputs.position, difference) && state.lost == [false; 2];
    let supply_low = config.supply_sensor
        && state.supply.seen()
        && bucket(
            &mut state.supply_low,
            Pressure::from_bits(state.supply.good()) < config.supply_minimum,
            config.glitch_ticks * GLITCH_WEIGHT,
        );
    let overrun = bucket(&mut state.overrun, inputs.faults.overrun, config.timing_limit);
    let missed = fill(&mut state.missed, inputs.faults.missed_ticks.into(), config.timing_limit);
    let late = bucket(&mut state.late, inputs.faults.late_tick, config.timing_limit);
    state.host_silent = if inputs.host_heard { 0 } else { state.host_silent.saturating_add(1) };

    // What forbids running forbids arming too.
    let silent = state.host_silent >= config.command_time_out_ticks;
    let disagreement = inputs.faults.model_disagreement;
    let contradicts = if disagreement { named(&inputs.faults) } else { Causes::default() };
    let causes = contradicts
        .and(Causes::POSITION, position.is_some() || frozen)
        .and(Causes::PRESSURE_A, state.lost[0])
        .and(Causes::PRESSURE_B, state.lost[1])
        .and(Causes::SUPPLY, supply.is_some() || supply_low)
        .and(Causes::TIMING, overrun || missed || late)
        .and(Causes::HOST, silent)
        .and(Causes::AT_ONCE, inputs.faults.valve_output);
    let running = state.mode == Mode::Run || (state.mode == Mode::Idle && inputs.command == Some(OperatorCommand::Arm));
    // A valve that does not obey is no better while idle: the air is on.
    let reason = None
        .or(inputs.faults.valve_output.then_some(Reason::ValveOutput))
        .or(position.map(|fault| reason(fault, Channel::Position)))
        .or(pressure_a.map(|fault| reason(fault, Channel::PressureA)))
        .or(pressure_b.map(|fault| reason(fault, Channel::PressureB)))
        .or(supply.map(|fault| reason(fault, Channel::Supply)))
        .or((running && frozen).then_some(Reason::Stuck(Channel::Position)))
        .or((running && supply_low).then_some(Reason::SupplyLow))
        .or((running && overrun).then_some(Reason::Overrun))
        .or((running && missed).then_some(Reason::MissedTick))
        .or((running && late).then_some(Reason::LateTick))
        .or((running && disagreement).then_some(Reason::ModelDisagreement))
        .or((state.mode == Mode::Run && silent).then_some(Reason::CommandTimeOut));
    Faults { reason, causes }
}

/// How far the chambers' pressures can have moved in a tick.
#[inline]
fn pressure_steps(config: &Config, state: &ControllerState) -> [i32; 2] {
    let most = [config.pressure_a.step, config.pressure_b.step];
    match &config.air_steps {
        Some([a, b]) if state.position.seen() => {
            let y = Position::from_bits(state.position.good());
            [a.at(y).min(most[0]), b.at(y.saturating_neg()).min(most[1])]
        }
        _ => most,
    }
}

/// What a disagreement of this tick names.
#[cold]
#[inline(never)]
fn named(faults: &ExternalFaults) -> Causes {
    match faults.contradicts {
        None => Causes::AT_ONCE,
        Some(Contradicts::Position) => Causes::POSITION,
        Some(Contradicts::PressureA(_)) => Causes::PRESSURE_A,
        Some(Contradicts::PressureB(_)) => Causes::PRESSURE_B,
    }
}

fn reason(fault: Fault, channel: Channel) -> Reason {
    match fault {
        Fault::Range => Reason::Range(channel),
        Fault::Rate => Reason::Rate(channel),
        Fault::Stuck => Reason::Stuck(channel),
    }
}

/// Fills on a bad tick, empties a quarter as fast on a good one; true when full.
#[inline]
fn bucket(level: &mut u16, bad: bool, limit: u16) -> bool {
    fill(level, bad.into(), limit)
}

/// The same for several at once.
#[inline]
fn fill(level: &mut u16, bad: u16, limit: u16) -> bool {
    // At most 255 times the weight.
    *level = if bad > 0 { level.saturating_add(bad * GLITCH_WEIGHT).min(limit) } else { level.saturating_sub(1) };
    *level >= limit
}

#[inline]
fn advance_mode(config: &Config, state: &mut ControllerState, inputs: &Inputs, faults: Faults) {
    let before = state.mode;
    let mode = match (before, faults.reason, inputs.command) {
        (Mode::Safe(_), _, Some(OperatorCommand::ResetFault)) => {
            for channel in [&mut state.position, &mut state.pressure_a, &mut state.pressure_b, &mut state.supply] {
                channel.clear();
            }
            state.freeze = FreezeWatch::default();
            (state.missed, state.late, state.overrun, state.supply_low) = (0, 0, 0, 0);
            Mode::SelfTest { ticks_left: config.self_test_ticks }
        }
        (Mode::Safe(reason), _, _) => Mode::Safe(reason),
        (Mode::Boot, _, _) => match state.reset {
            Some(reason) => Mode::Safe(reason),
            None => Mode::SelfTest { ticks_left: config.self_test_ticks },
        },
        (_, Some(reason), _) => Mode::Safe(reason),
        (Mode::SelfTest { ticks_left }, None, _) => {
            let all_seen = state.position.seen()
                && (state.pressure_a.seen() && state.pressure_b.seen() || !config.pressure_sensors)
                && (state.supply.seen() || !config.supply_sensor);
            match ticks_left.saturating_sub(1) {
                0 if all_seen => Mode::Idle,
                ticks_left => Mode::SelfTest { ticks_left },
            }
        }
        (Mode::Idle, None, Some(OperatorCommand::Arm)) => {
            state.begin = true;
            // Silence before arming does not count: a time-out of the host begins now.
            state.host_silent = 0;
            Mode::Run
        }
        (Mode::Run, None, Some(OperatorCommand::Disarm)) => Mode::Idle,
        (mode, None, _) => mode,
    };
    state.mode = mode;
    if matches!((before, mode), (Mode::Run, Mode::Safe(_))) && !state.begin && faults.causes.spoil_learning() {
        state.servo.forget();
    }
    match (before, mode) {
        // A law that has not begun yet knows nothing of the rig.
        (Mode::Run, Mode::Safe(_)) if !state.begin && !state.servo.hold.on => {
            state.stop = Stop::begin(config.stop_ticks, faults.causes);
        }
        (Mode::Safe(_), Mode::Safe(_)) => state.stop.advance(inputs.faults.missed_ticks, faults.causes),
        _ => state.stop = Stop::default(),
    }
}
