//! One tick, from converter codes to the valve code. Everything here runs in the control interrupt: no allocation, no
//! waiting, no logging, no division, and no float outside bench mode and the model monitor.

use control::{AdcCode, Command, Config, ExternalFaults, Inputs, Mode, Position, Reason, State};

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
    /// Other parameters and telemetry decimation. Not while running; the self-test follows.
    Configure(Config, u32),
    /// Bench mode on, with this plant. Not while running.
    BenchOn(BenchPlant),
    /// Bench mode off. Not while running.
    BenchOff,
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
    config: Config,
    state: State,
    course: Course,
    bench: Option<BenchPlant>,
    command: Option<Command>,
    dac: u16,
    reference: Position,
    tick: u32,
    sequence: u32,
    every: u32,
    until_record: u32,
    last_mode: u16,
}

impl ControlLoop {
    /// A loop about to boot. `reset` is why the last run ended, if that needs acknowledging; `every` the telemetry
    /// decimation.
    #[must_use]
    pub fn new(config: Config, reset: Option<Reason>, every: u32) -> Self {
        let dac = config.safe_code().0;
        Self {
            config,
            state: State::boot(reset),
            course: Course::hold(Position::ZERO),
            bench: None,
            command: None,
            dac,
            reference: Position::ZERO,
            tick: 0,
            sequence: 0,
            every: every.max(1),
            until_record: 0,
            last_mode: u16::MAX,
        }
    }

    /// The same, already armed: for lock-step comparison with the desktop.
    #[must_use]
    pub fn armed(config: Config, every: u32) -> Self {
        Self { state: State::armed(), ..Self::new(config, None, every) }
    }

    /// The valve code at which nothing moves.
    #[must_use]
    pub fn safe_code(&self) -> u16 {
        self.config.safe_code().0
    }

    /// The mode after the last tick.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.state.mode()
    }

    /// Whether the simulated plant stands in.
    #[must_use]
    pub fn bench(&self) -> bool {
        self.bench.is_some()
    }

    /// Runs one tick.
    #[inline]
    pub fn tick(&mut self, codes: [u16; 4], faults: ExternalFaults, host_heard: bool) -> Tick {
        let command = self.command.take();
        let codes = match &mut self.bench {
            Some(bench) => bench.advance(self.dac),
            None => codes,
        };
        let asked = self.course.next(self.reference);
        let [position, a, b, supply] = codes.map(AdcCode);
        let outputs = control::step(
            &self.config,
            &mut self.state,
            Inputs {
                reference: asked,
                position,
                pressure_a: a,
                pressure_b: b,
                supply: Some(supply),
                command,
                host_heard,
                faults,
            },
        );
        self.dac = outputs.dac.0;
        self.reference = outputs.telemetry.reference;
        self.tick = self.tick.wrapping_add(1);
        let mode = mode_number(outputs.mode);
        let event = mode != self.last_mode;
        self.last_mode = mode;
        let record_due = event || self.until_record == 0;
        self.until_record = if self.until_record == 0 { self.every - 1 } else { self.until_record - 1 };
        let record = Record {
            tick: self.tick,
            sequence: self.sequence,
            codes,
            dac: self.dac,
            reference_bits: self.reference.to_bits(),
            mode,
            event,
            stamps: [0; 3],
        };
        self.sequence = self.sequence.wrapping_add(u32::from(record_due));
        Tick { valve: if self.bench.is_some() { self.safe_code() } else { self.dac }, record, record_due }
    }

    /// Takes an order of the background, for the coming tick.
    #[cold]
    #[inline(never)]
    pub fn order(&mut self, order: Order) {
        // The desk refuses these while running; between its look and now the loop can only have left that state.
        let running = self.state.mode() == Mode::Run;
        match order {
            Order::Command(command) => {
                if command == Command::Arm {
                    // The setpoint of an earlier run must not move the piston of this one.
                    self.course = Course::hold(self.reference);
                }
                self.command = Some(command);
            }
            Order::Course(course) => self.course = course,
            Order::Configure(..) | Order::BenchOn(_) | Order::BenchOff if running => {}
            Order::Configure(config, every) => {
                self.config = config;
                self.every = every.max(1);
                self.test_anew();
            }
            Order::BenchOn(plant) => {
                self.bench = Some(plant);
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
