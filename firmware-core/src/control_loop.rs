//! One tick, from converter codes to the valve code: the only one there is. The control interrupt calls
//! [`ControlLoop::tick`] and [`ControlLoop::conclude`], and so do the guest under QEMU, the scenarios, the simulated closed loop
//! and the co-process: what is simulated is what ships.
//!
//! Everything here runs in the control interrupt: no allocation, no waiting, no logging, no division, and no float outside
//! bench mode and the model monitor.

use board_link::LearnedValues;
use control::program::Program;
use control::{
    AdcCode, Config, ConfigError, Contradicts, ControllerState, ExternalFaults, Inputs, Learned, Mode, OperatorCommand,
    Parameters, Position, Pressure, Reason, Telemetry, Voltage,
};
use monitor::{Monitor, MonitorError, MonitorParameters, Readings, Verdict};
use plant_model::Plant;

use crate::bench::BenchPlant;
use crate::course::Course;
use crate::record::{Record, STOPPING, mode_number};

/// What the background asks of the loop, through a queue; at most one is taken per tick.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and orders are rare")]
pub enum Order {
    /// A command of the operator.
    Command(OperatorCommand),
    /// Another course of the setpoint.
    Course(Course),
    /// Other parameters. Not while running; the self-test follows.
    Configure(Setup),
    /// Bench mode on, with this plant. Not while running.
    BenchOn(BenchPlant),
    /// Bench mode off. Not while running.
    BenchOff,
}

/// What the settings become for the loop.
#[derive(Clone, Debug)]
pub struct Setup {
    /// For the control law.
    pub config: Config,
    /// The model monitor; `None` if it is off.
    pub monitor: Option<Monitor>,
    /// Whether its verdict trips; else it is only counted.
    pub monitor_trips: bool,
    /// One telemetry record every so many ticks.
    pub every: u32,
}

/// What the model monitor of a loop is made of.
#[derive(Clone, Debug)]
pub struct MonitorSetup {
    /// The plant as the controller knows it.
    pub plant: Plant<f32>,
    /// What the monitor allows.
    pub parameters: MonitorParameters,
    /// Whether its verdict trips; else it is only told.
    pub trips: bool,
    /// Whole ticks from a sample to the valve taking the code that answers it: one on the board, where a timer latches it.
    pub output_delay_ticks: u8,
}

/// Why a loop cannot be set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SetupError {
    /// The control law refuses a parameter.
    Control(ConfigError),
    /// The model monitor refuses a parameter.
    Monitor(MonitorError),
}

impl core::fmt::Display for SetupError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Control(error) => write!(f, "{error}"),
            Self::Monitor(error) => write!(f, "{error}"),
        }
    }
}

impl core::error::Error for SetupError {}

impl Setup {
    /// For a control law's parameters and, where a model of the plant is known, its monitor. One telemetry record every
    /// `every` ticks, at least 1.
    ///
    /// # Errors
    /// The first parameter of the law or of the monitor that is out of range.
    pub fn new(parameters: &Parameters, monitor: Option<MonitorSetup>, every: u32) -> Result<Self, SetupError> {
        let config = Config::from_parameters(parameters).map_err(SetupError::Control)?;
        let tick_s = 1.0 / parameters.tick_hz as f32;
        let monitor_trips = monitor.as_ref().is_some_and(|monitor| monitor.trips);
        let monitor = match monitor {
            None => None,
            Some(MonitorSetup { plant, parameters: allowed, output_delay_ticks, .. }) => {
                let lag_s = parameters.servo_lag_s;
                let monitor = Monitor::for_plant(plant, &allowed, tick_s, output_delay_ticks, lag_s);
                Some(monitor.map_err(SetupError::Monitor)?)
            }
        };
        Ok(Self { config, monitor, monitor_trips, every: every.max(1) })
    }
}

/// What a tick yields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoopTick {
    /// What to write to the valve: the control law's code, or the safe code in bench mode.
    pub valve: u16,
    /// For telemetry; its stamps are still zero.
    pub record: Record,
    /// Whether the record is due: by decimation, or because it is an event.
    pub record_due: bool,
}

/// The loop with everything it remembers.
#[derive(Clone, Debug)]
pub struct ControlLoop {
    setup: Setup,
    state: ControllerState,
    disagreement: bool,
    contradicts: Option<Contradicts>,
    warned: bool,
    previous_u_v: f32,
    seen: Telemetry,
    course: Course,
    bench: Option<BenchPlant>,
    latched: u16,
    command: Option<OperatorCommand>,
    dac: u16,
    reference: Position,
    tick: u32,
    sequence: u32,
    until_record: u32,
    last_mode: u16,
}

impl ControlLoop {
    /// A loop about to boot. `reset` is why the last run ended, if that needs acknowledging.
    #[must_use]
    pub fn new(setup: Setup, reset: Option<Reason>) -> Self {
        Self::in_state(setup, ControllerState::boot(reset))
    }

    /// The same in any state: for simulation and co-processes, where no one is there to arm.
    #[must_use]
    pub fn in_state(setup: Setup, state: ControllerState) -> Self {
        let dac = setup.config.safe_code().0;
        Self {
            setup,
            state,
            disagreement: false,
            contradicts: None,
            warned: false,
            previous_u_v: 0.0,
            seen: Telemetry::default(),
            course: Course::Hold(Position::ZERO),
            bench: None,
            latched: dac,
            command: None,
            dac,
            reference: Position::ZERO,
            tick: 0,
            sequence: 0,
            until_record: 0,
            last_mode: u16::MAX,
        }
    }

    /// The valve code at which nothing moves.
    #[must_use]
    pub fn safe_code(&self) -> u16 {
        self.setup.config.safe_code().0
    }

    /// The numbers of the control law: they change by [`Order::Configure`] alone.
    #[must_use]
    pub fn config(&self) -> &Config {
        &self.setup.config
    }

    /// The setpoint's program, if it has one: it changes by [`Order::Course`] alone.
    #[must_use]
    pub fn program(&self) -> Option<&Program> {
        match &self.course {
            Course::Hold(_) => None,
            Course::Repeat(program, _) => Some(program),
        }
    }

    /// What the model monitor takes for the rig, if there is a monitor: it changes by [`Order::Configure`] alone.
    #[inline]
    #[must_use]
    pub fn monitored(&self) -> Option<&Plant<f32>> {
        self.setup.monitor.as_ref().map(Monitor::plant)
    }

    /// The mode after the last tick.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.state.mode()
    }

    /// Everything that the control law remembers.
    #[must_use]
    pub fn state(&self) -> &ControllerState {
        &self.state
    }

    /// What the positioning law has learned, or will begin with. `None` under the paper's law.
    #[inline]
    #[must_use]
    pub fn learned(&self) -> Option<Learned> {
        self.setup.config.learned(self.state.servo())
    }

    /// The same in the quantities' units, beside nominal values. Not for the interrupt: it uses floats.
    #[must_use]
    pub fn learned_values(&self, tick_hz: u32) -> Option<LearnedValues> {
        let (learned, nominal) = self.learned().zip(self.setup.config.nominal())?;
        let values = |learned: Learned| learned.values(tick_hz);
        Some(LearnedValues { now: values(learned), nominal: values(nominal), ..LearnedValues::default() })
    }

    /// Whether air may be let to the valve: while idle, running or in a controlled stop, never on the bench.
    #[inline]
    #[must_use]
    pub fn air_allowed(&self) -> bool {
        (matches!(self.state.mode(), Mode::Idle | Mode::Run) || self.state.stopping()) && self.bench.is_none()
    }

    /// Where the simulated plant lies: memory without meaning while none stands in.
    #[inline]
    #[must_use]
    pub fn bench_slot(&self) -> &Option<BenchPlant> {
        &self.bench
    }

    /// Whether the simulated plant stands in.
    #[must_use]
    pub fn bench(&self) -> bool {
        self.bench.is_some()
    }

    /// Runs one tick; [`ControlLoop::conclude`] follows when the valve is written.
    #[inline]
    pub fn tick(&mut self, codes: [u16; 4], faults: ExternalFaults, host_heard: bool) -> LoopTick {
        let command = self.command.take();
        let codes = match &mut self.bench {
            Some(bench) => {
                // The hardware latches a code one tick after it was computed; so does the bench.
                let latched = core::mem::replace(&mut self.latched, self.dac);
                bench.advance(latched)
            }
            None => codes,
        };
        let [position, a, b, supply] = codes.map(AdcCode);
        let inputs = Inputs {
            reference: self.course.advance(),
            position,
            pressure_a: a,
            pressure_b: b,
            supply: Some(supply),
            command,
            host_heard,
            // The monitor's verdict of the tick before.
            faults: ExternalFaults {
                model_disagreement: self.disagreement && self.setup.monitor_trips,
                contradicts: self.contradicts,
                ..faults
            },
        };
        let outputs = control::step(&self.setup.config, &mut self.state, inputs);
        self.seen = outputs.telemetry;
        let held = core::mem::replace(&mut self.dac, outputs.dac.0);
        self.reference = outputs.telemetry.reference;
        self.tick = self.tick.wrapping_add(1);
        let mode = mode_number(outputs.mode) | if self.state.stopping() { STOPPING } else { 0 };
        let disagreement = self.disagreement;
        let event = mode != self.last_mode || (disagreement && !self.warned);
        (self.last_mode, self.warned) = (mode, disagreement);
        let record_due = event || self.until_record == 0;
        self.until_record =
            if self.until_record == 0 { self.setup.every.saturating_sub(1) } else { self.until_record - 1 };
        let record = Record {
            tick: self.tick,
            sequence: self.sequence,
            codes,
            dac: self.dac,
            held,
            reference_bits: self.reference.to_bits(),
            mode,
            disagreement,
            event,
            stamps: [0; 3],
        };
        self.sequence = self.sequence.wrapping_add(u32::from(record_due));
        LoopTick { valve: if self.bench.is_some() { self.safe_code() } else { self.dac }, record, record_due }
    }

    /// The setpoint of the coming ticks, for callers that have their own course of it.
    #[inline]
    pub fn hold(&mut self, reference: Position) {
        self.course = Course::Hold(reference);
    }

    /// As after a reset of the chip for `reason`, with the same setup: the valve is at the safe code at once, latch and all.
    pub fn reboot(&mut self, reason: Reason) {
        self.state = ControllerState::boot(Some(reason));
        self.disagreement = false;
        self.dac = self.safe_code();
    }

    /// Learning, and the monitor's look at the tick; to be called behind the valve write, both count in the next tick. Returns
    /// whether the monitor sees a contradiction.
    #[inline]
    pub fn conclude(&mut self) -> bool {
        control::learn(&self.setup.config, &mut self.state);
        self.watch()
    }

    /// The same, showing `see` what the monitor finds while the loop runs.
    #[inline]
    pub fn conclude_and(&mut self, see: impl FnOnce(&Verdict)) -> bool {
        control::learn(&self.setup.config, &mut self.state);
        self.watch_and(see)
    }

    /// Never inlined: apart from bench mode it is the only float in the control interrupt, and can be told apart so.
    #[inline(never)]
    fn watch(&mut self) -> bool {
        self.watch_and(|_| ())
    }

    #[inline]
    fn watch_and(&mut self, see: impl FnOnce(&Verdict)) -> bool {
        let Some(monitor) = &mut self.setup.monitor else { return false };
        // The types' own conversions round the same way, in ten times the instructions.
        let pascals =
            |pressure: Pressure| pressure.to_bits() as f32 * const { 1.0 / (1_u32 << Pressure::FRAC_NBITS) as f32 };
        let readings = Readings {
            position_m: self.seen.position.to_bits() as f32 * const { 1.0 / (1_u32 << Position::FRAC_NBITS) as f32 },
            pressure_a_pa: pascals(self.seen.pressure_a),
            pressure_b_pa: pascals(self.seen.pressure_b),
            supply_pa: self.seen.supply.map(pascals),
        };
        let u_v = self.seen.u.to_bits() as f32 * const { 1.0 / (1_u32 << Voltage::FRAC_NBITS) as f32 };
        if self.state.consistent() && !self.seen.pressure_lost {
            let verdict = monitor.step(&readings, self.previous_u_v);
            see(&verdict);
            (self.disagreement, self.contradicts) = (verdict.disagreement, verdict.contradicts.map(in_fixed_point));
        } else {
            monitor.restart(u_v);
            self.disagreement = false;
        }
        self.previous_u_v = u_v;
        self.disagreement
    }

    /// Takes an order of the background, for the coming tick.
    #[cold]
    #[inline(never)]
    pub fn order(&mut self, order: &Order) {
        // The desk refuses these while running; between its look and now the loop can only have left that state.
        let running = self.state.mode() == Mode::Run;
        match order {
            Order::Command(command) => {
                if *command == OperatorCommand::Arm {
                    // The setpoint of an earlier run must not move the piston of this one.
                    self.course = Course::Hold(self.reference);
                }
                self.command = Some(*command);
            }
            Order::Course(course) => self.course = course.clone(),
            Order::Configure(..) | Order::BenchOn(_) | Order::BenchOff if running => {}
            Order::Configure(setup) => {
                self.setup.clone_from(setup);
                self.disagreement = false;
                self.test_anew();
            }
            Order::BenchOn(plant) => {
                self.bench = Some(plant.clone());
                self.latched = self.safe_code();
                self.test_anew();
            }
            Order::BenchOff => {
                self.bench = None;
                self.test_anew();
            }
        }
    }

    /// The sensors mean something else now: nothing that is known of them holds, least of all their noise. Self-test, unless a
    /// latched reason waits for its acknowledgement.
    #[inline]
    fn test_anew(&mut self) {
        let latched = match self.state.mode() {
            Mode::Safe(reason) => Some(reason),
            _ => None,
        };
        self.state = ControllerState::boot(latched);
    }
}

/// What the monitor names, in the controller's numbers.
#[cold]
fn in_fixed_point(contradicts: monitor::Contradicts) -> Contradicts {
    // A conversion by the language: it saturates, and has no case that panics.
    let pressure = |pa: f32| Pressure::from_bits((pa * const { (1_u32 << Pressure::FRAC_NBITS) as f32 }) as i32);
    match contradicts {
        monitor::Contradicts::Position => Contradicts::Position,
        monitor::Contradicts::PressureA(pa) => Contradicts::PressureA(pressure(pa)),
        monitor::Contradicts::PressureB(pa) => Contradicts::PressureB(pressure(pa)),
    }
}
