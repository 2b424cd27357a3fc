//! One tick, from converter codes to the valve code. Everything here runs in the control interrupt: no allocation, no
//! waiting, no logging, no division, and no float outside bench mode and the model monitor.

use control::{
    AdcCode, Command, Config, ExternalFaults, Inputs, Mode, Outputs, Position, Pressure, Reason, State, Telemetry,
    Voltage,
};
use monitor::{Monitor, Readings};

use crate::bench::BenchPlant;
use crate::generator::Course;
use crate::record::{Record, mode_number};

/// What the background asks of the loop, through a queue; at most one is taken per tick.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and orders are rare")]
pub enum Order {
    /// A command of the operator.
    Command(Command),
    /// Another setpoint generator.
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

/// What a tick yields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// What to write to the valve: the control law's code, or the safe code in bench mode.
    pub valve: u16,
    /// For telemetry; its stamps are still zero.
    pub record: Record,
    /// Whether the record is due: by decimation, or because it is an event.
    pub record_due: bool,
}

/// The loop with everything it remembers.
#[derive(Debug)]
pub struct ControlLoop {
    setup: Setup,
    state: State,
    disagreement: bool,
    warned: bool,
    previous_u_v: f32,
    seen: Telemetry,
    course: Course,
    bench: Option<BenchPlant>,
    latched: u16,
    command: Option<Command>,
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
        Self::in_state(setup, State::boot(reset))
    }

    /// The same in any state: for lock-step comparison with the desktop.
    #[must_use]
    pub fn in_state(setup: Setup, state: State) -> Self {
        let dac = setup.config.safe_code().0;
        Self {
            setup,
            state,
            disagreement: false,
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

    /// The mode after the last tick.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.state.mode()
    }

    /// Whether air may be let to the valve: while idle or running, never on the bench.
    #[inline]
    #[must_use]
    pub fn air_allowed(&self) -> bool {
        matches!(self.state.mode(), Mode::Idle | Mode::Run) && self.bench.is_none()
    }

    /// Whether the simulated plant stands in.
    #[must_use]
    pub fn bench(&self) -> bool {
        self.bench.is_some()
    }

    /// Runs one tick; [`ControlLoop::watch`] follows when the valve is written.
    #[inline]
    pub fn tick(&mut self, codes: [u16; 4], faults: ExternalFaults, host_heard: bool) -> Tick {
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
            faults,
        };
        let outputs = self.step(inputs);
        let held = core::mem::replace(&mut self.dac, outputs.dac.0);
        self.reference = outputs.telemetry.reference;
        self.tick = self.tick.wrapping_add(1);
        let mode = mode_number(outputs.mode);
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
        Tick { valve: if self.bench.is_some() { self.safe_code() } else { self.dac }, record, record_due }
    }

    /// The control law with the monitor's verdict of the tick before; all that lock-step comparison needs.
    #[inline]
    pub fn step(&mut self, inputs: Inputs) -> Outputs {
        let disagreement = self.disagreement && self.setup.monitor_trips;
        let faults = ExternalFaults { model_disagreement: disagreement, ..inputs.faults };
        let outputs = control::step(&self.setup.config, &mut self.state, Inputs { faults, ..inputs });
        self.seen = outputs.telemetry;
        outputs
    }

    /// As after a reset of the chip for `reason`, with the same setup: for lock-step comparison with the desktop.
    pub fn reboot(&mut self, reason: Reason) {
        self.state = State::boot(Some(reason));
        self.disagreement = false;
    }

    /// Lets the monitor look at the tick; to be called behind the valve write, its verdict counts in the next tick.
    ///
    /// Never inlined: apart from bench mode it is the only float in the control interrupt, and can be told apart so.
    #[inline(never)]
    pub fn watch(&mut self) -> bool {
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
        if self.state.mode() == Mode::Run {
            self.disagreement = monitor.step(&readings, self.previous_u_v).disagreement;
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
                if *command == Command::Arm {
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

    /// The sensors mean something else now: self-test, unless a latched reason waits for its acknowledgement.
    #[inline]
    fn test_anew(&mut self) {
        if !matches!(self.state.mode(), Mode::Safe(_)) {
            self.state = State::boot(None);
        }
    }
}
