//! The firmware's ELF file on an emulated STM32G474, its converters reading the plant model and its valve output driving it.
//!
//! Beside it runs the host's `ControlLoop`, given what the chip was given: the codes its converter delivered, the orders its
//! queue delivered, in the ticks in which they did. Every valve code must be the same. Skipped with a message where the target
//! is not installed, and without POSITIONER_TESTS=all.

#[path = "emulated/below.rs"]
mod below;
#[path = "emulated/broken.rs"]
mod broken;
#[path = "emulated/campaign.rs"]
mod campaign;
#[path = "emulated/facts.rs"]
mod facts;
#[path = "emulated/faults.rs"]
mod faults;

use std::sync::OnceLock;

use board_link::{
    Accumulator, Command, FRAME_BYTES, Generator, PROTOCOL_VERSION, Parameter, Reply, Request, Response, Shape, encode,
};
use control::{ExternalFaults, Mode, Reason};
use firmware_core::{Action, ControlLoop, Desk, Order, OutputCheck, OutputSeen, Settings, Snapshot, code_of_sum};
use object::{Object, ObjectSymbol};
use plant_model::{Simulator, Stepper, Tolerance};
use plant_sim::sensors::{CodeNoise, SensorChannel, channels, quantities};
use rig_files::RigFile;
use stm32_emulator::analog::{Analog, share_of};
use stm32_emulator::core::Stop;
use stm32_emulator::machine::Machine;
use stm32_emulator::memory::RAM;
use stm32_emulator::peripherals::adc::Conversion;
use stm32_emulator::peripherals::rcc::ResetCause;
use stm32_emulator::rtt;
use stm32_emulator::time::{Time, from_seconds, to_seconds};
use test_stages::firmware::build_for_target;
use test_stages::skipped;

/// The control interrupt: exception 16 plus interrupt 18.
const CONTROL_INTERRUPT: u32 = 34;
/// Input channels of ADC1 of position, p_a, p_b, p_sup (docs/wiring.md).
const CHANNELS: [u8; 4] = [1, 2, 7, 6];
const MILLISECOND: f64 = 0.001;
/// The valve's code at mid.
const MID: u16 = 2048;

fn elf() -> Option<&'static [u8]> {
    static ELF: OnceLock<Result<Vec<u8>, String>> = OnceLock::new();
    let built = ELF.get_or_init(|| {
        let path = build_for_target("firmware")?;
        Ok(std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    });
    built.as_deref().map_err(|why| skipped("emulated", why)).ok()
}

/// The cylinder and its sensors at the pins.
#[derive(Clone)]
struct Rig {
    simulator: Simulator<f64>,
    sensors: [SensorChannel; 4],
    valve: rig_files::Converter,
    supply_pa: f64,
    /// The valve's code; the output stage holds it at mid while the pin is high impedance.
    code: Option<u16>,
    /// Up to when the plant has been simulated.
    simulated_to: Time,
    sum: u32,
    /// Codes of the sequence under way, and of the last one finished.
    sums: [u16; 4],
    /// A channel whose wire is off, if one is.
    dead_channel: Option<usize>,
    outputs: Vec<(Time, Option<u16>)>,
}

impl Rig {
    fn new() -> Self {
        let file = RigFile::paper_a();
        let plant = plant_model::Plant::new(&file.rig, &file.effects).expect("the rig of the paper is valid");
        let p = file.rig.equilibrium_pressure_pa();
        let begin = plant.state_at_rest(0.0, p, p);
        Self {
            simulator: Simulator::from_state(plant, begin, Stepper::adaptive(&Tolerance::standard())),
            sensors: channels(&file.io, &CodeNoise::NONE),
            valve: file.io.valve(),
            supply_pa: file.rig.supply.pressure_pa,
            code: None,
            simulated_to: 0,
            sum: 0,
            sums: [0; 4],
            dead_channel: None,
            outputs: Vec::new(),
        }
    }

    fn advance(&mut self, to: Time) {
        let u_v = self.code.map_or(0.0, |code| self.valve.quantity(u32::from(code)));
        let inputs = plant_model::Inputs { u_v, external_force_n: 0.0, supply_pa: self.supply_pa };
        let seconds = to_seconds(to - self.simulated_to);
        if seconds > 0.0 {
            self.simulator.advance_with(&inputs, seconds);
        }
        self.simulated_to = to;
    }

    fn position_m(&self) -> f64 {
        self.simulator.state().y_m
    }
}

impl Analog for Rig {
    fn convert(&mut self, conversion: &Conversion) -> u16 {
        let rank = usize::from(conversion.rank);
        if conversion.sample == 0 {
            self.advance(conversion.at);
            let index = CHANNELS.iter().position(|channel| *channel == conversion.channel);
            let index = index.unwrap_or_else(|| panic!("channel {} is not wired", conversion.channel));
            let code = self.sensors[index].code(quantities(&self.simulator.measure())[index], 0.0);
            self.sum = if self.dead_channel == Some(index) { 0 } else { u32::from(code).min(65_520) };
            self.sums[rank] = self.sum as u16;
        }
        share_of(self.sum, conversion)
    }

    fn output(&mut self, at: Time, code: Option<u16>) {
        self.advance(at.max(self.simulated_to));
        self.code = code;
        self.outputs.push((at, code));
    }
}

/// What one control interrupt did.
#[derive(Clone, Copy, Debug)]
struct Tick {
    /// Instructions and cycles from the first instruction of the interrupt to the write of the valve code.
    instructions: u64,
    cycles: u64,
}

/// A board with a host loop beside it.
struct Bench {
    machine: Option<Machine<Rig>>,
    host: ControlLoop,
    desk: Desk,
    snapshot: Snapshot,
    /// An order that has been sent and not yet been taken.
    order: Option<Order>,
    /// The order that waited when the present control interrupt began, and whether the host had been heard then: a run may
    /// end in the midst of an interrupt.
    taken: Option<Order>,
    heard: bool,
    /// Codes of the sequence that ended with it: the next one begins before a late valve code is written.
    codes: [u16; 4],
    /// As the board's: whether its output shows what the board wrote in the tick before.
    output: OutputCheck,
    written: u16,
    host_heard_at: u32,
    order_queue_at: u32,
    answers: Accumulator,
    session: u32,
    sequence: u32,
    ticks: Vec<Tick>,
    compared: u64,
    differences: Vec<String>,
    log: Vec<u8>,
}

fn symbol(elf: &[u8], part: &str) -> (u32, u32) {
    let file = object::File::parse(elf).expect("an ELF file");
    let found = file.symbols().find(|symbol| {
        let name = symbol.name().unwrap_or_default();
        format!("{:#}", rustc_demangle::demangle(name)).contains(part)
    });
    let symbol = found.unwrap_or_else(|| panic!("no symbol is called {part}"));
    (symbol.address() as u32, symbol.size() as u32)
}

fn fresh_loop(settings: &Settings, reset: Option<Reason>) -> ControlLoop {
    ControlLoop::new(settings.setup().expect("the settings fit together"), reset)
}

fn fresh_desk(settings: Settings) -> Desk {
    Desk::new(settings, "", "", board_link::TextWord::new())
}

impl Bench {
    fn boot(elf: &[u8]) -> Self {
        let (queue, bytes) = symbol(elf, "sampling::start::ORDER_QUEUE");
        let settings = Settings::default();
        Self {
            machine: Some(Machine::new(elf, Rig::new()).expect("the firmware fits the chip")),
            host: fresh_loop(&settings, None),
            desk: fresh_desk(settings),
            snapshot: Snapshot::new(),
            order: None,
            taken: None,
            heard: false,
            codes: [0; 4],
            output: OutputCheck::default(),
            written: MID,
            host_heard_at: symbol(elf, "sampling::HOST_HEARD").0,
            // Counters of elements written and read stand behind the slots, ahead of the cell's own flag.
            order_queue_at: queue + bytes - 16,
            answers: Accumulator::new(),
            session: 0,
            sequence: 0,
            ticks: Vec::new(),
            compared: 0,
            differences: Vec::new(),
            log: Vec::new(),
        }
    }

    /// Idle, a session open.
    fn idle(elf: &[u8]) -> Self {
        let mut bench = Self::boot(elf);
        assert_eq!(bench.run(0.3), None);
        bench.open_session();
        bench
    }

    /// Armed, the piston held where it stands.
    fn armed(elf: &[u8]) -> Self {
        let mut bench = Self::idle(elf);
        bench.done(Command::Arm);
        assert_eq!(bench.run(0.2), None);
        bench
    }

    /// A second board in the same state, which goes on by itself.
    fn copy(&self) -> Self {
        Self {
            machine: self.machine.clone(),
            host: self.host.clone(),
            desk: self.desk.clone(),
            // The next tick fills it.
            snapshot: Snapshot::new(),
            order: self.order.clone(),
            taken: self.taken.clone(),
            heard: self.heard,
            codes: self.codes,
            output: self.output.clone(),
            written: self.written,
            host_heard_at: self.host_heard_at,
            order_queue_at: self.order_queue_at,
            answers: Accumulator::new(),
            session: self.session,
            sequence: self.sequence,
            ticks: Vec::new(),
            compared: 0,
            differences: Vec::new(),
            log: Vec::new(),
        }
    }

    fn machine(&mut self) -> &mut Machine<Rig> {
        self.machine.as_mut().expect("only a reset takes it, and puts it back")
    }

    fn word(&mut self, address: u32) -> u32 {
        let at = (address - RAM) as usize;
        u32::from_le_bytes(self.machine().chip.ram[at..at + 4].try_into().expect("four bytes"))
    }

    /// Runs for a time, comparing every tick. A reset ends it.
    fn run(&mut self, seconds: f64) -> Option<ResetCause> {
        self.run_and(seconds, |_, _| ()).unwrap_or_else(|stop| panic!("the emulator stopped {stop}"))
    }

    /// The same, showing every tick's valve code: the host's and the board's.
    fn run_and(&mut self, seconds: f64, mut see: impl FnMut(u16, u16)) -> Result<Option<ResetCause>, Stop> {
        let end = self.machine().chip.now + from_seconds(seconds);
        // A run may begin within an interrupt: that tick has no beginning to be measured from.
        let mut entered = None;
        while self.machine().chip.now < end {
            let host_heard_at = (self.host_heard_at - RAM) as usize;
            let machine = self.machine();
            let (inside, writes) = (machine.chip.system.current() == CONTROL_INTERRUPT, machine.chip.dac.writes);
            let reset = machine.step(end)?;
            if reset.is_some() {
                return Ok(reset);
            }
            if machine.chip.system.current() != CONTROL_INTERRUPT {
                continue;
            }
            let wrote = machine.chip.dac.writes != writes;
            if !inside {
                entered = Some((machine.core.instructions, machine.chip.system.cycles));
                let (heard, codes) = (machine.chip.ram[host_heard_at] != 0, machine.chip.analog.sums.map(code_of_sum));
                (self.heard, self.codes) = (heard, codes);
                let (written, read) = (self.word(self.order_queue_at), self.word(self.order_queue_at + 4));
                if written != read {
                    self.taken = Some(self.order.take().expect("an order is taken that nobody sent"));
                }
            } else if wrote {
                if let Some((instructions, cycles)) = entered.take() {
                    let (executed, elapsed) = (machine.core.instructions, machine.chip.system.cycles);
                    self.ticks.push(Tick { instructions: executed - instructions, cycles: elapsed - cycles });
                }
                let (order, heard) = (self.taken.take(), self.heard);
                let (host, board) = self.compare(order, heard);
                see(host, board);
            }
        }
        Ok(None)
    }

    fn compare(&mut self, order: Option<Order>, host_heard: bool) -> (u16, u16) {
        let chip = &self.machine().chip;
        let (board, at) = (chip.dac.holding(), chip.now);
        let seen = OutputSeen { latched: chip.dac.latched(), pin: chip.dac.pin() };
        let valve_output = self.output.faulty(core::mem::replace(&mut self.written, board), seen, false);
        let faults = ExternalFaults { valve_output, ..ExternalFaults::default() };
        let codes = self.codes;
        let tick = self.host.tick(codes, faults, host_heard);
        self.host.conclude();
        self.snapshot.publish(&tick.record, &self.host);
        // The board takes it last in the tick, for the coming one.
        if let Some(order) = order {
            self.host.order(&order);
        }
        self.compared += 1;
        if tick.valve != board && self.differences.len() < 5 {
            let mode = self.host.mode();
            self.differences.push(format!(
                "at {:.6} s in {mode}: host {} board {board}, codes {codes:?}",
                to_seconds(at),
                tick.valve
            ));
        }
        (tick.valve, board)
    }

    fn send(&mut self, command: Command) {
        let request = Request { version: PROTOCOL_VERSION, session: self.session, sequence: self.sequence, command };
        self.sequence += 1;
        let mut buffer = [0; FRAME_BYTES];
        let frame = encode(&request, &mut buffer).expect("a request fits its frame").to_vec();
        self.machine().chip.send(&frame);
    }

    /// The board's answer; the host's loop gets the same order.
    fn ask(&mut self, command: Command) -> Response {
        if let Ok(Action::Order(order, _)) = self.desk.decide(command, &self.snapshot, 0) {
            self.order = Some(order);
        }
        self.send(command);
        for _ in 0..200 {
            assert_eq!(self.run(MILLISECOND), None, "the board was reset in the midst of {command:?}");
            for byte in self.machine().chip.lpuart.take_sent() {
                match self.answers.push::<Response>(byte) {
                    Some(Ok(answer)) => return answer,
                    Some(Err(error)) => panic!("the answer to {command:?} is no frame: {error:?}"),
                    None => {}
                }
            }
        }
        panic!("no answer to {command:?} within 0.2 s");
    }

    fn open_session(&mut self) {
        self.session = self.ask(Command::Hello { nonce: 1 }).session;
    }

    fn done(&mut self, command: Command) {
        let answer = self.ask(command);
        assert_eq!(answer.result, Ok(Reply::Done), "{command:?}");
    }

    fn state(&mut self) -> String {
        match self.ask(Command::Status).result {
            Ok(Reply::Status(status)) => status.state.to_string(),
            other => panic!("status answered {other:?}"),
        }
    }

    /// The chip starts anew. The host's loop beside it starts with the settings that the desk knows: saved ones are meant.
    fn reset(&mut self, cause: ResetCause, reason: Option<Reason>) {
        let machine = self.machine.take().expect("only a reset takes it");
        self.machine = Some(machine.reset(cause).expect("flash holds a vector table"));
        self.boot_host(reason);
    }

    /// The supply fails and returns.
    fn power_cycle(&mut self) {
        let machine = self.machine.take().expect("only a reset takes it");
        self.machine = Some(machine.power_cycle().expect("flash holds a vector table"));
        self.boot_host(None);
    }

    fn boot_host(&mut self, reason: Option<Reason>) {
        let settings = self.desk.settings().clone();
        self.host = fresh_loop(&settings, reason);
        (self.output, self.written) = (OutputCheck::default(), MID);
        self.desk = fresh_desk(settings);
        (self.session, self.sequence, self.order, self.taken) = (0, 0, None, None);
        self.answers = Accumulator::new();
    }

    fn get(&mut self, parameter: Parameter) -> f32 {
        match self.ask(Command::Get(parameter)).result {
            Ok(Reply::Value(value)) => value,
            other => panic!("get answered {other:?}"),
        }
    }

    fn take_log(&mut self) {
        if let Some(bytes) = rtt::take(self.machine()) {
            self.log.extend(bytes);
        }
    }

    #[track_caller]
    fn agrees(&self) {
        assert!(self.differences.is_empty(), "of {} ticks some differ: {:#?}", self.compared, self.differences);
    }
}

#[test]
fn the_flashed_firmware_boots_arms_moves_and_writes_the_codes_of_the_host() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    assert_eq!(bench.run(0.3), None);
    bench.agrees();
    bench.open_session();
    assert_eq!(bench.state(), "idle");
    bench.done(Command::Generate(Generator::Hold { position_um: 0 }));
    bench.done(Command::Arm);
    bench.done(Command::Generate(Generator::Repeat {
        shape: Shape::Sine,
        centre_um: 0,
        amplitude_um: 50_000,
        period_ms: 2_000,
    }));
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    for _ in 0..500 {
        assert_eq!(bench.run(0.01), None);
        let position = bench.machine().chip.analog.position_m();
        (low, high) = (low.min(position), high.max(position));
    }
    bench.ticks.clear();
    assert_eq!(bench.run(0.5), None);
    assert_eq!(bench.state(), "run");
    bench.agrees();
    assert!(bench.compared > 5_800, "{} ticks", bench.compared);
    assert!(high - low > 0.08, "the piston moved from {low} m to {high} m");
    let worst = bench.ticks.iter().map(|tick| tick.cycles).max().expect("ticks were run");
    let most = bench.ticks.iter().map(|tick| tick.instructions).max().expect("ticks were run");
    // docs/emulator.md holds what was measured. A change beyond these bounds wants an explanation.
    assert!((1_500..3_400).contains(&most), "{most} instructions from the interrupt to the valve code");
    println!("{} ticks, at most {most} instructions and {worst} cycles to the valve code", bench.compared);
}

#[test]
fn a_lost_position_sensor_is_safe_on_the_chip_in_the_same_tick_as_on_the_host() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    assert_eq!(bench.run(0.3), None);
    bench.open_session();
    bench.done(Command::Arm);
    assert_eq!(bench.run(0.2), None);
    bench.machine().chip.analog.dead_channel = Some(0);
    assert_eq!(bench.run(0.1), None);
    bench.agrees();
    assert!(matches!(bench.host.mode(), Mode::Safe(_)), "{}", bench.host.mode());
    let state = bench.state();
    assert_eq!(state, bench.host.mode().to_string());
}

#[test]
fn without_ticks_the_watchdog_resets_the_chip_and_the_next_run_knows_why() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    assert_eq!(bench.run(0.3), None);
    bench.machine().chip.tim6.trigger_stuck = true;
    let stopped = bench.machine().chip.now;
    assert_eq!(bench.run(0.2), Some(ResetCause::Watchdog));
    let after = to_seconds(bench.machine().chip.now - stopped);
    assert!((0.015..0.045).contains(&after), "the reset came after {after} s");
    bench.machine().chip.tim6.trigger_stuck = false;
    bench.reset(ResetCause::Watchdog, Some(Reason::WatchdogReset));
    let at_reset = bench.machine().chip.analog.outputs.last().copied();
    assert_eq!(at_reset.map(|(_, code)| code), Some(None), "a reset makes the pin high impedance");
    assert_eq!(bench.run(0.3), None);
    bench.open_session();
    assert_eq!(bench.state(), "safe:watchdog-reset");
    bench.agrees();
}

#[test]
fn the_log_in_ram_is_a_stream_of_frames_and_names_the_boot() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    for _ in 0..30 {
        assert_eq!(bench.run(0.01), None);
        bench.take_log();
    }
    // Frames of defmt's rzcobs encoding end with a zero. One record a tick would be 300; decimation makes fewer.
    let frames = bench.log.split(|byte| *byte == 0).filter(|frame| !frame.is_empty()).count();
    assert!(frames > 10, "{frames} frames in {} bytes", bench.log.len());
}

#[test]
fn a_supply_that_fails_in_the_midst_of_a_save_leaves_the_old_parameters_or_the_new_ones() {
    let Some(elf) = elf() else { return };
    let parameter = Parameter::TelemetryEvery;
    let (old, new) = (7.0, 11.0);
    let mut saved = Bench::boot(elf);
    assert_eq!(saved.run(0.1), None);
    saved.open_session();
    saved.done(Command::Set(parameter, old));
    saved.done(Command::Save);
    let flash = saved.machine().chip.flash.clone();
    let mut seen = [0, 0];
    for cut in [1, 2, 5, 20, 38, 60, 66, 67, 68, 69, 70, 80, 120] {
        let mut bench = Bench::boot(elf);
        bench.machine().chip.flash = flash.clone();
        assert_eq!(bench.run(0.1), None);
        bench.open_session();
        bench.done(Command::Set(parameter, new));
        let before = bench.machine().chip.flash.programmed;
        bench.send(Command::Save);
        // Up to the middle of so many double words, or until the save is long over.
        for _ in 0..10_000 {
            assert_eq!(bench.run(20e-6), None);
            let flash = &bench.machine().chip.flash;
            if flash.programmed - before >= cut && flash.busy() {
                break;
            }
        }
        bench.power_cycle();
        assert_eq!(bench.run(0.3), None);
        bench.open_session();
        let found = bench.get(parameter);
        assert!(found == old || found == new, "cut in double word {cut}: {found}");
        seen[usize::from(found == new)] += 1;
    }
    assert!(seen.iter().all(|times| *times > 0), "old and new were found {seen:?} times");
}

#[test]
fn ten_thousand_ticks_a_second_are_kept_over_a_power_cycle_and_write_the_codes_of_the_host() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::boot(elf);
    assert_eq!(bench.run(0.1), None);
    bench.open_session();
    // With the paper's law, a new board's. The positioning law does not fit a tick of 100 us ("What 10 kHz leaves" in
    // docs/firmware.md).
    bench.done(Command::Set(Parameter::TickHz, 10_000.0));
    bench.done(Command::Save);
    bench.agrees();
    bench.power_cycle();
    bench.compared = 0;
    assert_eq!(bench.run(0.3), None);
    assert!((2_900..=3_000).contains(&bench.compared), "{} ticks in 0.3 s", bench.compared);
    bench.open_session();
    bench.done(Command::Arm);
    bench.done(Command::Generate(Generator::Hold { position_um: 20_000 }));
    bench.ticks.clear();
    assert_eq!(bench.run(0.3), None);
    assert_eq!(bench.state(), "run");
    bench.agrees();
    let most = bench.ticks.iter().map(|tick| tick.cycles).max().expect("ticks were run");
    assert!(most < 17_000, "{most} cycles to the valve code, of 17 000 a tick");
}
