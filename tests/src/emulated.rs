//! The flashed ELF on the emulated chip, as a [`Target`].
//!
//! The runner's codes stand at the converter's inputs when the timer triggers it; references and commands go over the serial
//! line, as a host would send them, and so arrive some ticks later than on the desktop. Beside the chip runs the desktop's
//! loop, given what the chip was given in the same ticks: the codes that its converter delivered, the orders that its
//! queue delivered. A valve code that differs ends the run. The rig's and the controller's numbers are set over the serial line,
//! saved, and read from flash at the start that follows.

use crate::scenario::{ReferenceSegment, Scenario, Start};
use crate::target::{Target, TargetError, TickOutput};
use board_link::{
    Accumulator, Command, FRAME_BYTES, Generator, PROTOCOL_VERSION, Refusal, Reply, Request, Response, Shape, TextWord,
    encode,
};
use control::program;
use control::{DacCode, Inputs, Mode, OperatorCommand};
use firmware_core::{Action, ControlLoop, Desk, Order, Settings, Snapshot, code_of_sum};
use object::{Object, ObjectSymbol};
use plant_sim::emulated::board::{Board, Event};
use plant_sim::emulated::commission;
use plant_sim::emulated::cylinder::{CHANNELS, sum_of_code};
use plant_sim::{MonitorAction, emulated::EmulatedError};
use std::collections::VecDeque;
use stm32_emulator::analog::{Analog, share_of};
use stm32_emulator::memory::RAM;
use stm32_emulator::peripherals::adc::Conversion;
use stm32_emulator::time::{Time, from_seconds, to_seconds};

/// Longest wait for the first tick after power-up, s.
const BOOT_S: f64 = 0.5;
/// How often a host that has nothing to say shows that it is there, s.
const HEARTBEAT_S: f64 = 0.02;
/// Ticks after which a request counts as unanswered, in seconds.
const ANSWER_S: f64 = 0.5;

/// The converter's inputs and the valve's pin.
struct Pins {
    codes: [u16; 4],
    sums: [u16; 4],
    sum: u32,
    pin: Option<u16>,
    /// What the pin showed when the last sequence began: the timer has latched the code of the tick before.
    pin_at_sampling: Option<u16>,
    sampled: Time,
}

impl Analog for Pins {
    fn convert(&mut self, conversion: &Conversion) -> u16 {
        if conversion.sample == 0 {
            if conversion.rank == 0 {
                self.pin_at_sampling = self.pin;
                self.sampled = conversion.at;
            }
            let wired = CHANNELS.iter().position(|channel| *channel == conversion.channel);
            self.sum = wired.map_or(0, |index| sum_of_code(self.codes[index]));
            self.sums[usize::from(conversion.rank) % 4] = self.sum as u16;
        }
        share_of(self.sum, conversion)
    }
    fn output(&mut self, _: Time, code: Option<u16>) {
        self.pin = code;
    }
}

/// Where the firmware keeps what decides how the desktop's loop is fed.
#[derive(Clone, Copy)]
struct Symbols {
    host_heard: u32,
    /// Counters of orders written and read.
    orders: [u32; 2],
}

impl Symbols {
    fn of(elf: &[u8]) -> Result<Self, TargetError> {
        let find = |part: &str| {
            let file = object::File::parse(elf).map_err(|error| TargetError(error.to_string()))?;
            let found = file.symbols().find(|symbol| {
                let name = symbol.name().unwrap_or_default();
                format!("{:#}", rustc_demangle::demangle(name)).contains(part)
            });
            let found = found.ok_or_else(|| TargetError(format!("the firmware has no symbol `{part}`")))?;
            Ok((found.address() as u32, found.size() as u32))
        };
        let (queue, bytes) = find("sampling::start::ORDER_QUEUE")?;
        // The counters stand behind the slots, ahead of the cell's own flag.
        let written = queue + bytes - 16;
        Ok(Self { host_heard: find("sampling::HOST_HEARD")?.0, orders: [written, written + 4] })
    }
}

/// The host's side of the serial line, while ticks go on.
#[derive(Default)]
struct Conversation {
    session: Option<u32>,
    sequence: u32,
    answers: Accumulator,
    waiting: VecDeque<Command>,
    asked: Option<(Command, u64)>,
    /// What the board has refused.
    refused: Vec<(Command, Refusal)>,
    status: Option<String>,
}

/// What a run has shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Facts {
    /// Ticks compared.
    pub ticks: u64,
    /// Most instructions from the interrupt's entry to the valve code.
    pub instructions: u64,
    /// Most cycles of the same.
    pub cycles: u64,
    /// Lowest stack pointer.
    pub lowest_stack: u32,
}

/// A board with the scenario's parameters, and the desktop's loop beside it.
pub struct EmulatedTarget {
    board: Board<Pins>,
    symbols: Symbols,
    shadow: ControlLoop,
    desk: Desk,
    snapshot: Snapshot,
    /// An order that has been sent and not yet been taken.
    order: Option<Order>,
    talk: Conversation,
    segments: Vec<(f64, Generator)>,
    begun: usize,
    heartbeat: bool,
    tick_s: f64,
    ticks: u64,
    lost: bool,
    /// What the air output is to be since the last tick.
    air: Option<bool>,
    last_sampled: Option<Time>,
    facts: Facts,
}

fn fail(error: &dyn std::fmt::Display) -> TargetError {
    TargetError(error.to_string())
}

fn generator(segment: &ReferenceSegment) -> Generator {
    let micro = |metres: f64| (metres * 1.0e6).round() as i32;
    match &segment.program {
        None => Generator::Hold { position_um: micro(segment.position_m.unwrap_or_default()) },
        Some(program) => Generator::Repeat {
            shape: match program.shape {
                program::Shape::Step => Shape::Step,
                program::Shape::Ramp => Shape::Ramp,
                program::Shape::Sine => Shape::Sine,
                program::Shape::Identification => Shape::Identification,
            },
            centre_um: micro(program.centre_m.into()),
            amplitude_um: micro(program.amplitude_m.into()),
            period_ms: (program.period_s * 1.0e3).round() as u32,
        },
    }
}

impl EmulatedTarget {
    /// Powers a board up, commissions it for the scenario, powers it up again and, if the scenario begins so, arms it.
    ///
    /// # Errors
    /// The board cannot be told the scenario's numbers, or refuses them.
    pub fn start(elf: &[u8], scenario: &Scenario) -> Result<Self, TargetError> {
        let rig = scenario.rig_file().map_err(|error| fail(&error))?;
        let parameters = scenario.parameters(&scenario.name).map_err(|error| fail(&error))?;
        let monitor = if scenario.monitor.enabled { MonitorAction::Trip } else { MonitorAction::Off };
        let settings = commission::settings(&rig.rig, &parameters, monitor, &scenario.monitor.parameters)
            .map_err(|error| fail(&error))?;
        // The sensors of a piston at rest.
        let [p_a, p_b] = rig.rig.equilibrium_pressures_pa();
        let (position, pressure) = (rig.io.position(), rig.io.pressure());
        let codes = [
            position.code(scenario.initial_position_m),
            pressure.code(p_a),
            pressure.code(p_b),
            pressure.code(rig.rig.supply.pressure_pa),
        ];
        let codes = codes.map(|code| code as u16);
        let pins = Pins { codes, sums: [0; 4], sum: 0, pin: None, pin_at_sampling: None, sampled: 0 };
        let mut board = Board::power_up(elf, pins).map_err(|error| fail(&error))?;
        let commissioned = (|| {
            board.run(0.1)?;
            commission::apply(&mut board, &settings)?;
            board.power_cycle()
        })();
        commissioned.map_err(|error: EmulatedError| fail(&error))?;
        let mut target = Self {
            board,
            symbols: Symbols::of(elf)?,
            shadow: ControlLoop::new(settings.setup().map_err(|error| fail(&error))?, None),
            desk: desk(settings),
            snapshot: Snapshot::new(),
            order: None,
            talk: Conversation::default(),
            segments: scenario.reference.iter().map(|segment| (segment.at_s, generator(segment))).collect(),
            begun: 0,
            heartbeat: parameters.command_time_out_s.is_some(),
            tick_s: rig.io.tick_s(),
            ticks: 0,
            lost: false,
            air: None,
            last_sampled: None,
            facts: Facts::default(),
        };
        if scenario.start == Start::Armed {
            let at_rest = Inputs { host_heard: true, ..Inputs::default() };
            target.until("idle", &at_rest, |mode| mode == Mode::Idle)?;
            target.talk.waiting.push_back(Command::Arm);
            target.until("running", &at_rest, |mode| mode == Mode::Run)?;
            let initial = ReferenceSegment { at_s: 0.0, position_m: Some(scenario.initial_position_m), program: None };
            target.talk.waiting.push_back(Command::Generate(generator(&initial)));
            while target.busy() {
                target.one_tick(&at_rest)?;
            }
        }
        (target.ticks, target.facts) = (0, Facts::default());
        Ok(target)
    }

    /// Ticks with the sensors as they are until the mode is reached.
    fn until(&mut self, what: &str, inputs: &Inputs, reached: impl Fn(Mode) -> bool) -> Result<(), TargetError> {
        for _ in 0..(5.0 / self.tick_s) as u64 {
            if reached(self.shadow.mode()) && !self.busy() {
                return Ok(());
            }
            self.one_tick(inputs)?;
        }
        Err(TargetError(format!(
            "the board is not {what} within 5 s but {}; {:?}",
            self.shadow.mode(),
            self.talk.refused
        )))
    }

    fn busy(&self) -> bool {
        self.talk.asked.is_some() || !self.talk.waiting.is_empty()
    }

    fn word(&mut self, address: u32) -> u32 {
        let at = address.wrapping_sub(RAM) as usize;
        let bytes = self.board.machine().chip.ram.get(at..at.saturating_add(4)).and_then(|bytes| bytes.try_into().ok());
        u32::from_le_bytes(bytes.unwrap_or_default())
    }

    /// Sends what waits if the line is free, and hears what has been answered.
    fn converse(&mut self) -> Result<(), TargetError> {
        for byte in self.board.take_sent() {
            match self.talk.answers.push::<Response>(byte) {
                Some(Ok(answer)) => self.hear(answer),
                Some(Err(error)) => return Err(TargetError(format!("an answer that is no frame: {error:?}"))),
                None => {}
            }
        }
        if let Some((command, since)) = self.talk.asked
            && (self.ticks.saturating_sub(since)) as f64 * self.tick_s > ANSWER_S
        {
            return Err(TargetError(format!("no answer to {command:?}")));
        }
        if self.talk.asked.is_some() {
            return Ok(());
        }
        let command = match self.talk.session {
            // The board listens once it has booted; before its first tick nothing is heard.
            None if self.facts.ticks == 0 => return Ok(()),
            None => Command::Hello { nonce: 1 },
            Some(_) => match self.talk.waiting.pop_front() {
                Some(command) => command,
                None => return Ok(()),
            },
        };
        if let Ok(Action::Order(order, _)) = self.desk.decide(command, &self.snapshot, 0) {
            self.order = Some(order);
        }
        self.talk.sequence += 1;
        let (session, sequence) = (self.talk.session.unwrap_or_default(), self.talk.sequence);
        let request = Request { version: PROTOCOL_VERSION, session, sequence, command };
        let mut buffer = [0; FRAME_BYTES];
        let frame = encode(&request, &mut buffer).map_err(|error| TargetError(format!("{command:?}: {error:?}")))?;
        self.board.send(frame);
        self.talk.asked = Some((command, self.ticks));
        Ok(())
    }

    fn hear(&mut self, answer: Response) {
        let Some((command, _)) = self.talk.asked.take() else { return };
        if let Command::Hello { .. } = command {
            self.talk.session = Some(answer.session);
        }
        match answer.result {
            // What was held at the moment of arming is held; the reference in force comes again.
            Ok(Reply::Done) if command == Command::Arm => {
                if let Some((_, generator)) = self.begun.checked_sub(1).and_then(|last| self.segments.get(last)) {
                    self.talk.waiting.push_front(Command::Generate(*generator));
                }
            }
            Ok(Reply::Status(status)) => self.talk.status = Some(status.state.to_string()),
            Ok(_) => {}
            Err(refusal) => self.talk.refused.push((command, refusal)),
        }
    }

    /// One tick of chip and desktop with the codes that stand at the pins.
    fn one_tick(&mut self, inputs: &Inputs) -> Result<Mode, TargetError> {
        self.converse()?;
        let latest = if self.facts.ticks == 0 { BOOT_S } else { 3.0 * self.tick_s };
        let end = self.board.now() + from_seconds(latest);
        let mut given = (false, None);
        let before = self.board.machine().chip.dac.holding();
        let tick = loop {
            match self.board.advance(end).map_err(|error| fail(&error))? {
                Event::Entered => {
                    self.air_as_wanted()?;
                    let heard = self.word(self.symbols.host_heard & !3) >> (8 * (self.symbols.host_heard & 3)) & 0xFF;
                    let [written, read] = self.symbols.orders.map(|address| self.word(address));
                    let taken = if written == read { None } else { self.order.take() };
                    if written != read && taken.is_none() {
                        return Err(TargetError("the board takes an order that nobody sent".into()));
                    }
                    given = (heard != 0, taken);
                }
                Event::Wrote(tick) => break tick,
                Event::Reset(cause) => return Err(TargetError(format!("the chip was reset by {cause:?}"))),
                Event::Time => return Err(TargetError(format!("no tick within {latest} s"))),
            }
        };
        self.in_time(before)?;
        let (host_heard, order) = given;
        let pins = self.board.analog();
        let codes = pins.sums.map(code_of_sum);
        let wanted = self.shadow.tick(codes, inputs.faults, host_heard);
        self.shadow.conclude();
        self.air = Some(self.shadow.air_allowed());
        self.snapshot.publish(&wanted.record, &self.shadow);
        // The chip takes it last in the tick, for the coming one.
        if let Some(order) = order {
            self.shadow.order(&order);
        }
        self.facts.ticks += 1;
        self.facts.instructions = self.facts.instructions.max(tick.instructions);
        self.facts.cycles = self.facts.cycles.max(tick.cycles);
        self.facts.lowest_stack = self.board.lowest_stack();
        let mode = self.shadow.mode();
        if wanted.valve != tick.code {
            return Err(TargetError(format!(
                "tick {} in {mode}: the chip writes {}, the desktop {}; codes {codes:?}",
                self.facts.ticks, tick.code, wanted.valve
            )));
        }
        Ok(mode)
    }

    /// A tick is sampled a period after the one before, and by then the pin shows the code of the one before.
    fn in_time(&mut self, before: u16) -> Result<(), TargetError> {
        let lost = std::mem::take(&mut self.lost);
        let (pin, sampled) = (self.board.analog().pin_at_sampling, self.board.analog().sampled);
        let Some(last) = self.last_sampled.replace(sampled) else { return Ok(()) };
        let periods = to_seconds(sampled - last) / self.tick_s;
        // Setting the timer up may convert once ahead of its first period.
        let first = self.facts.ticks < 2;
        if !lost && !first && (periods - 1.0).abs() > 0.001 {
            return Err(TargetError(format!("tick {} came after {periods:.4} periods", self.facts.ticks)));
        }
        if pin != Some(before) {
            return Err(TargetError(format!("the pin shows {pin:?}, the code of the tick before is {before}")));
        }
        Ok(())
    }

    /// Since the last tick the air output stands as the desktop's loop says.
    fn air_as_wanted(&mut self) -> Result<(), TargetError> {
        let air = self.board.machine().chip.gpio[1].driven(0) == Some(true);
        if self.air.is_some_and(|wanted| wanted != air) {
            return Err(TargetError(format!("tick {}: the air output is {air}", self.facts.ticks)));
        }
        Ok(())
    }

    /// Asks the board for its state, which must be the desktop's, and returns what the run has shown.
    ///
    /// # Errors
    /// The states differ, or the board does not answer.
    pub fn finish(mut self) -> Result<Facts, TargetError> {
        let facts = self.facts;
        self.talk.status = None;
        self.talk.waiting.clear();
        self.talk.waiting.push_back(Command::Status);
        while self.talk.status.is_none() {
            self.one_tick(&Inputs::default())?;
        }
        let (board, desktop) = (self.talk.status.unwrap_or_default(), self.shadow.mode().to_string());
        if board == desktop {
            Ok(facts)
        } else {
            Err(TargetError(format!("the board says it is `{board}`, the desktop's loop is `{desktop}`")))
        }
    }
}

fn desk(settings: Settings) -> Desk {
    Desk::new(settings, "", "", TextWord::new())
}

impl Target for EmulatedTarget {
    fn tick(&mut self, inputs: &Inputs) -> Result<TickOutput, TargetError> {
        let t_s = self.ticks as f64 * self.tick_s;
        while let Some((_, generator)) = self.segments.get(self.begun).filter(|(at_s, _)| *at_s <= t_s) {
            self.talk.waiting.push_back(Command::Generate(*generator));
            self.begun += 1;
        }
        if let Some(command) = inputs.command {
            self.talk.waiting.push_back(match command {
                OperatorCommand::Arm => Command::Arm,
                OperatorCommand::Disarm => Command::Disarm,
                OperatorCommand::ResetFault => Command::Acknowledge,
            });
        }
        let beat = ((HEARTBEAT_S / self.tick_s) as u64).max(1);
        if self.heartbeat && inputs.host_heard && !self.busy() && self.ticks.is_multiple_of(beat) {
            self.talk.waiting.push_back(Command::Status);
        }
        self.board.analog().codes =
            [inputs.position, inputs.pressure_a, inputs.pressure_b, inputs.supply.unwrap_or_default()]
                .map(|code| code.0);
        let mode = self.one_tick(inputs)?;
        self.ticks += 1;
        Ok(TickOutput {
            dac: DacCode(self.board.machine().chip.dac.holding()),
            mode,
            stopping: self.shadow.state().stopping(),
        })
    }

    fn lose_tick(&mut self) -> Result<(), TargetError> {
        self.ticks += 1;
        self.lost = true;
        self.board.machine().chip.tim6.trigger_stuck = true;
        let end = self.board.now() + from_seconds(self.tick_s);
        let event = self.board.advance(end).map_err(|error| fail(&error))?;
        self.board.machine().chip.tim6.trigger_stuck = false;
        if event == Event::Time { Ok(()) } else { Err(TargetError(format!("without a trigger: {event:?}"))) }
    }

    /// The chip has its own watchdog and says itself when it bites.
    fn has_watchdog(&self) -> bool {
        false
    }

    fn watchdog_reset(&mut self) -> Result<(), TargetError> {
        Err(TargetError("the chip's own watchdog has not bitten".into()))
    }
}
