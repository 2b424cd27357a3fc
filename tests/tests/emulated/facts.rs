//! Times, loads and stack of the firmware on the emulated chip: bounded here, told in `docs/emulator.md`.

use std::fmt::Write as _;
use std::path::Path;

use board_link::{Command, Generator, Parameter, Shape};
use stm32_emulator::memory::RAM;
use stm32_emulator::time::{from_seconds, to_seconds};

use super::{Bench, CONTROL_INTERRUPT, MID, elf, symbol};

/// Wait states of flash at 170 MHz (RM0440, table of wait states), and bytes that it delivers at once.
const WAIT_STATES: u64 = 4;
const LINE_BYTES: u32 = 8;
const CORE_HZ: f64 = 170.0e6;

/// Smallest and largest.
#[derive(Clone, Copy)]
struct Span(u64, u64);

impl Span {
    fn none() -> Self {
        Self(u64::MAX, 0)
    }
    fn see(&mut self, value: u64) {
        *self = Self(self.0.min(value), self.1.max(value));
    }
}

/// What a stretch of a run shows.
struct Facts {
    /// From the timer's edge to the first instruction of the interrupt, cycles.
    entry: Span,
    /// From the timer's edge to the write of the valve code, cycles.
    write: Span,
    /// From the first instruction to the write: instructions, cycles, cycles without cache.
    instructions: Span,
    cycles: Span,
    uncached: Span,
    /// The whole interrupt, cycles, and without cache.
    whole: Span,
    whole_uncached: Span,
    /// Share of the time in the interrupt, and in anything but sleep.
    control_load: f64,
    load: f64,
    lowest_stack: u32,
}

fn watch(bench: &mut Bench, seconds: f64) -> Facts {
    let machine = bench.machine();
    let none = Span::none();
    let mut facts = Facts {
        entry: none,
        write: none,
        instructions: none,
        cycles: none,
        uncached: none,
        whole: none,
        whole_uncached: none,
        control_load: 0.0,
        load: 0.0,
        lowest_stack: u32::MAX,
    };
    let (begin, idle) = (machine.chip.now, machine.idle);
    let end = begin + from_seconds(seconds);
    let mut control_cycles = 0;
    // Cycles at the entry and at the timer's edge, instructions, wait states so far.
    let mut entered: Option<(u64, u64, u64, u64)> = None;
    let mut line = 0;
    while machine.chip.now < end {
        let inside = machine.chip.system.current() == CONTROL_INTERRUPT;
        let (writes, pc) = (machine.chip.dac.writes, machine.core.pc);
        assert_eq!(machine.step(end).expect("the run is modelled"), None);
        facts.lowest_stack = facts.lowest_stack.min(machine.core.r[13]);
        let now_inside = machine.chip.system.current() == CONTROL_INTERRUPT;
        let cycles = machine.chip.system.cycles;
        if inside && let Some((since, edge, instructions, waited)) = &mut entered {
            if pc / LINE_BYTES != line {
                *waited += WAIT_STATES;
                line = pc / LINE_BYTES;
            }
            if machine.chip.dac.writes != writes {
                facts.write.see(cycles - *edge);
                facts.instructions.see(machine.core.instructions - *instructions);
                facts.cycles.see(cycles - *since);
                facts.uncached.see(cycles - *since + *waited);
            }
        }
        match (inside, now_inside) {
            (false, true) => {
                let count = u64::from(machine.chip.tim6.count(machine.chip.now)) * 4;
                facts.entry.see(count);
                entered = Some((cycles, cycles - count, machine.core.instructions, 0));
            }
            (true, false) => {
                if let Some((since, _, _, waited)) = entered.take() {
                    facts.whole.see(cycles - since);
                    facts.whole_uncached.see(cycles - since + waited);
                    control_cycles += cycles - since;
                }
            }
            _ => {}
        }
    }
    let elapsed = (machine.chip.now - begin) as f64;
    facts.control_load = control_cycles as f64 / CORE_HZ / to_seconds(machine.chip.now - begin);
    facts.load = 1.0 - (machine.idle - idle) as f64 / elapsed;
    facts
}

/// A board that moves: rate, law, simulated plant or real one.
fn moving(elf: &[u8], tick_hz: f32, law: f32, simulated: bool) -> Bench {
    let mut bench = Bench::idle(elf);
    bench.done(Command::Set(Parameter::TickHz, tick_hz));
    bench.done(Command::Set(Parameter::Law, law));
    // Whether the monitor trips is not the question here; that it runs is.
    bench.done(Command::Set(Parameter::Monitor, 1.0));
    bench.done(Command::Save);
    bench.power_cycle();
    assert_eq!(bench.run(0.3), None);
    bench.open_session();
    if simulated {
        bench.done(Command::Bench { on: true });
        assert_eq!(bench.run(0.2), None);
    }
    bench.done(Command::Arm);
    let shape = Shape::Sine;
    bench.done(Command::Generate(Generator::Repeat { shape, centre_um: 0, amplitude_um: 50_000, period_ms: 1_000 }));
    assert_eq!(bench.run(0.3), None);
    assert_eq!(bench.host.mode(), control::Mode::Run);
    bench.agrees();
    bench
}

/// From the first instruction after a reset to a valve output at mid, s.
fn reset_to_safe_output(elf: &[u8]) -> f64 {
    let mut bench = Bench::boot(elf);
    while bench.machine().chip.dac.pin() != Some(MID) {
        let end = bench.machine().chip.now + from_seconds(0.01);
        assert_eq!(bench.machine().step(end).expect("the run is modelled"), None);
    }
    to_seconds(bench.machine().chip.now)
}

#[test]
fn facts_of_the_firmware_stay_within_their_bounds() {
    let Some(elf) = elf() else { return };
    let (owned, owned_bytes) = symbol(elf, "sampling::OWNED");
    assert!(owned > RAM && owned_bytes > 0);
    let top = symbol(elf, "_stack_start").0;
    let mut table = String::from(
        "| run | edge to valve code, us | jitter of the entry, cycles | to the code: instructions | estimate, cycles | without \
         cache | whole interrupt: estimate | without cache | load, interrupt | load, all | stack, B |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    let mut broken = Vec::new();
    for (words, tick_hz, law, simulated, seconds) in [
        ("1 kHz, paper's law", 1_000.0, 0.0, false, 1.0),
        ("1 kHz, positioning law", 1_000.0, 1.0, false, 1.0),
        ("1 kHz, bench mode", 1_000.0, 0.0, true, 1.0),
        ("10 kHz, paper's law", 10_000.0, 0.0, false, 0.3),
        ("10 kHz, positioning law", 10_000.0, 1.0, false, 0.3),
        ("10 kHz, bench mode", 10_000.0, 0.0, true, 0.3),
    ] {
        let mut bench = moving(elf, tick_hz, law, simulated);
        let facts = watch(&mut bench, seconds);
        let micro = |cycles: u64| cycles as f64 / CORE_HZ * 1e6;
        let Facts { entry, write, instructions, cycles, uncached, whole, whole_uncached, .. } = facts;
        let stack = top - facts.lowest_stack;
        let _ = writeln!(
            table,
            "| {words} | {:.1} to {:.1} | {} | {} to {} | {} to {} | {} | {} | {} | {:.1} % | {:.1} % | {stack} |",
            micro(write.0),
            micro(write.1),
            entry.1 - entry.0,
            instructions.0,
            instructions.1,
            cycles.0,
            cycles.1,
            uncached.1,
            whole.1,
            whole_uncached.1,
            100.0 * facts.control_load,
            100.0 * facts.load,
        );
        let tick_cycles = (CORE_HZ / f64::from(tick_hz)) as u64;
        // A tenth of the tick at 1 kHz; at 10 kHz the code is written before the next edge.
        let latest = if tick_hz > 2_000.0 { tick_cycles } else { tick_cycles / 5 };
        for (what, value, bound) in [
            ("cycles from the edge to the valve code", write.1, latest),
            ("cycles of jitter at the entry", entry.1 - entry.0, 400),
            ("cycles of the whole interrupt", whole.1, latest),
            ("bytes of stack", u64::from(stack), 28 << 10),
        ] {
            if value > bound {
                broken.push(format!("{words}: {value} {what}, more than {bound}"));
            }
        }
    }
    let safe_s = reset_to_safe_output(elf);
    let _ = writeln!(
        table,
        "\nFrom reset to a valve output driven to mid: {:.1} ms. Until then the pin is high impedance, which the output stage holds at mid.",
        1e3 * safe_s
    );
    println!("{table}");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/emulator.md");
        let page = std::fs::read_to_string(&path).expect("the page");
        let (head, rest) = page.split_once("<!-- Facts: -->\n").expect("where the table begins");
        let (_, tail) = rest.split_once("<!-- End of the facts. -->").expect("where the table ends");
        let text = format!("{head}<!-- Facts: -->\n{table}\n<!-- End of the facts. -->{tail}");
        std::fs::write(&path, text).expect("the page can be written");
    }
    assert!(safe_s < 5e-3, "{safe_s} s from reset to mid");
    assert!(broken.is_empty(), "{broken:#?}");
}
