//! Faults below the software, each by name, while the piston moves: in which state the board is found afterwards, and how long the valve
//! was away from mid. `docs/fault-campaign.md` holds the table.

use std::fmt::Write as _;

use board_link::{Command, Generator, Reply, Shape};
use control::Reason;
use stm32_emulator::peripherals::flash::Ecc;
use stm32_emulator::peripherals::rcc::ResetCause;
use stm32_emulator::time::{Time, from_seconds, to_seconds};

use super::campaign::write_between;
use super::{Bench, CONTROL_INTERRUPT, MID, elf};

/// The pages of the parameters, as offsets into flash.
const PARAMETERS: std::ops::Range<usize> = 0x7_E000..0x8_0000;
/// Longest time with a valve away from mid behind a fault that stops the loop: the watchdog's 20 ms and some, s.
const LONGEST_S: f64 = 0.025;

struct Fault {
    name: &'static str,
    /// Brings it about on a board that runs.
    strike: fn(&mut Bench),
    /// Takes it away again, once the chip has been reset.
    repair: fn(&mut Bench),
    /// How the board is found.
    state: &'static str,
}

fn nothing(_: &mut Bench) {}

fn in_the_interrupt(bench: &mut Bench) {
    while bench.machine().chip.system.current() != CONTROL_INTERRUPT {
        let end = bench.machine().chip.now + from_seconds(0.001);
        assert_eq!(bench.machine().step(end).expect("the run is modelled"), None);
    }
}

fn faults() -> Vec<Fault> {
    let fault = |name, strike, repair, state| Fault { name, strike, repair, state };
    vec![
        fault(
            "end-of-conversion flag stuck, set",
            |bench| bench.machine().chip.adc1.flags_stuck = Some(true),
            nothing,
            "safe:watchdog-reset",
        ),
        fault(
            "end-of-conversion flag stuck, clear",
            |bench| bench.machine().chip.adc1.flags_stuck = Some(false),
            nothing,
            "safe:watchdog-reset",
        ),
        fault(
            "timer's update flag stuck",
            |bench| bench.machine().chip.tim6.update_flag_stuck = true,
            nothing,
            "safe:late-tick",
        ),
        fault(
            "serial line's interrupt stuck",
            |bench| {
                bench.machine().chip.lpuart.interrupt_stuck = true;
                bench.machine().chip.send(&[0]);
            },
            nothing,
            "safe:watchdog-reset",
        ),
        fault(
            "timer without triggers",
            |bench| bench.machine().chip.tim6.trigger_stuck = true,
            |bench| bench.machine().chip.tim6.trigger_stuck = false,
            "safe:watchdog-reset",
        ),
        fault(
            "system clock stops",
            |bench| bench.machine().chip.rcc.clock_stopped = true,
            nothing,
            "safe:watchdog-reset",
        ),
        fault("brown-out", Bench::power_cycle, nothing, "idle"),
        fault(
            "brown-out, then a clock that does not become ready",
            |bench| {
                bench.power_cycle();
                bench.machine().chip.rcc.pll_stuck = true;
            },
            |bench| bench.machine().chip.rcc.pll_stuck = false,
            "safe:watchdog-reset",
        ),
        fault(
            "brown-out, then a converter that does not become ready",
            |bench| {
                bench.power_cycle();
                bench.machine().chip.adc1.ready_stuck = true;
            },
            |bench| bench.machine().chip.adc1.ready_stuck = false,
            "safe:watchdog-reset",
        ),
        fault(
            "brown-out, then pages of rubbish among the parameters",
            |bench| {
                for (n, byte) in bench.machine().chip.flash.bytes[PARAMETERS].iter_mut().enumerate() {
                    *byte = ((n as u32).wrapping_mul(2_654_435_761) >> 24) as u8;
                }
                bench.power_cycle();
            },
            nothing,
            "safe:parameters-unreadable",
        ),
        fault(
            "valve output stuck at full scale",
            |bench| bench.machine().chip.dac.stuck_at = Some(4095),
            |bench| bench.machine().chip.dac.stuck_at = None,
            "safe:valve-output",
        ),
        fault(
            "two wrong bits in the program",
            |bench| {
                in_the_interrupt(bench);
                let at = (bench.machine().core.pc - 0x0800_0000) as usize & !7;
                bench.machine().chip.flash.damage(at, Ecc::Detected);
            },
            |bench| bench.machine().chip.flash.repair(),
            "safe:panic",
        ),
        fault(
            "a wrong bit in what the interrupt owns",
            |bench| {
                let at = bench.machine_owned();
                bench.machine().chip.ram[at + 64] ^= 4;
            },
            nothing,
            "safe:memory-corrupted",
        ),
        fault(
            "stack pointer out of RAM",
            |bench| {
                in_the_interrupt(bench);
                bench.machine().core.r[13] = 0x1FFF_FFF0;
            },
            nothing,
            "safe:stack-overflow",
        ),
        fault(
            "non-maskable interrupt out of nothing",
            |bench| bench.machine().chip.system.raise_nmi(),
            nothing,
            "safe:panic",
        ),
    ]
}

impl Bench {
    /// Where the interrupt's own memory lies in RAM.
    fn machine_owned(&self) -> usize {
        let elf = elf().expect("a firmware is running");
        (super::symbol(elf, "sampling::OWNED").0 - stm32_emulator::memory::RAM) as usize
    }
}

/// How long the valve was away from mid after `since`; `until` closes the last stretch.
fn away_s(bench: &mut Bench, since: Time, until: Time) -> f64 {
    let mut last = None;
    let mut end = since;
    for (at, code) in &bench.machine().chip.analog.outputs {
        if last.is_some_and(|code: Option<u16>| code.is_some_and(|code| code != MID)) {
            end = end.max(*at);
        }
        last = Some(*code);
    }
    if last.flatten().is_some_and(|code| code != MID) {
        end = until;
    }
    to_seconds(end - since)
}

#[test]
fn faults_below_the_software_end_in_named_safe_states() {
    let Some(elf) = elf() else { return };
    let mut moving = Bench::armed(elf);
    let shape = Shape::Sine;
    moving.done(Command::Generate(Generator::Repeat { shape, centre_um: 0, amplitude_um: 200_000, period_ms: 1_000 }));
    assert_eq!(moving.run(0.6), None);
    let mut table = String::from("| fault | found afterwards | valve away from mid for |\n| --- | --- | --- |\n");
    let mut wrong = Vec::new();
    for Fault { name, strike, repair, state } in faults() {
        let mut bench = moving.copy();
        let since = bench.machine().chip.now;
        strike(&mut bench);
        let (mut struck, mut air_s) = (None, f64::INFINITY);
        for n in 0..200 {
            struck = bench.run(0.001);
            if struck.is_some() {
                break;
            }
            if !bench.air() {
                air_s = air_s.min(0.001 * f64::from(n + 1));
            }
        }
        let mut resets = 0;
        while let Some(cause) = struck {
            repair(&mut bench);
            let reason = (cause == ResetCause::Watchdog).then_some(Reason::WatchdogReset);
            bench.reset(cause, reason);
            resets += 1;
            struck = if resets < 5 { bench.run(0.3) } else { None };
        }
        assert!(resets < 5, "{name}: the board is reset again and again");
        let until = bench.machine().chip.now;
        // Without air the analogue switch holds the valve at mid, whatever the pin shows.
        let away_s = away_s(&mut bench, since, until).min(air_s);
        bench.open_session();
        let found = bench.state();
        let _ = writeln!(
            table,
            "| {name} | `{found}`{} | {:.1} ms |",
            if resets > 0 { ", after a reset" } else { "" },
            1e3 * away_s
        );
        if found != state || away_s > LONGEST_S {
            wrong.push(format!("{name}: {found} instead of {state}, {away_s} s away from mid"));
        }
    }
    println!("{table}");
    write_between("below", &table);
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn flash_that_stays_busy_is_a_refused_save_or_a_reset_with_its_reason() {
    let Some(elf) = elf() else { return };
    let mut bench = Bench::idle(elf);
    bench.machine().chip.flash.busy_stuck = true;
    bench.send(Command::Save);
    let (mut reset, mut refused) = (None, false);
    for _ in 0..400 {
        reset = bench.run(0.001);
        if reset.is_some() {
            break;
        }
        for byte in bench.machine().chip.lpuart.take_sent() {
            if let Some(Ok(answer)) = bench.answers.push::<board_link::Response>(byte) {
                refused |= answer.result == Err(board_link::Refusal::Storage);
                assert_ne!(answer.result, Ok(Reply::Done));
            }
        }
    }
    println!("flash stays busy: refused {refused}, reset {reset:?}");
    if let Some(cause) = reset {
        assert_eq!(cause, ResetCause::Watchdog);
        bench.machine().chip.flash.busy_stuck = false;
        bench.reset(cause, Some(Reason::WatchdogReset));
        assert_eq!(bench.run(0.3), None);
        bench.open_session();
        assert_eq!(bench.state(), "safe:watchdog-reset");
    } else {
        assert!(refused);
    }
}
