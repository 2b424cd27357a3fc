//! Firmware that is broken on purpose (`firmware/src/broken.rs`): the check that is meant for a fault finds it, by name, and the
//! firmware without a fault passes them all.

use std::sync::OnceLock;

use board_link::{Command, Generator, Parameter, Reply, Shape};
use stm32_emulator::memory::FLASH;

use super::{Bench, CONTROL_INTERRUPT, MILLISECOND, symbol};

fn elf() -> Option<&'static [u8]> {
    static ELF: OnceLock<Result<Vec<u8>, String>> = OnceLock::new();
    let built = ELF.get_or_init(|| {
        let path = test_stages::firmware::build_broken()?;
        Ok(std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
    });
    built.as_deref().map_err(|why| test_stages::skipped("broken firmware", why)).ok()
}

/// A board whose firmware has this fault; 0 is none.
fn boot(elf: &[u8], fault: u32) -> Bench {
    let mut bench = Bench::boot(elf);
    let at = (symbol(elf, "DELIBERATE_FAULT").0 - FLASH) as usize;
    bench.machine().chip.flash.bytes[at..at + 4].copy_from_slice(&fault.to_le_bytes());
    bench
}

/// A check: what it finds wrong.
type Check = fn(Bench) -> Result<(), String>;

const CHECKS: [(&str, Check); 5] = [
    ("a sensor is missed by its own name", sensors_have_their_names),
    ("ticks keep coming", ticks_keep_coming),
    ("every code is the host's", codes_are_the_hosts),
    ("the control interrupt gives way to nobody", the_interrupt_gives_way_to_nobody),
    ("a save with an erasure leaves the board running", a_save_leaves_the_board_running),
];

fn ran(bench: &mut Bench, seconds: f64) -> Result<(), String> {
    match bench.run(seconds) {
        None => Ok(()),
        Some(cause) => Err(format!("a reset by {cause:?}")),
    }
}

fn sensors_have_their_names(mut bench: Bench) -> Result<(), String> {
    ran(&mut bench, 0.3)?;
    bench.open_session();
    let names = ["position", "pressure-a", "pressure-b", "supply"];
    for (channel, name) in names.iter().enumerate() {
        let mut without = bench.copy();
        without.machine().chip.analog.dead_channel = Some(channel);
        ran(&mut without, 0.02)?;
        let (state, wanted) = (without.state(), format!("safe:{name}-range"));
        if state != wanted {
            return Err(format!("without the {name} sensor the state is {state}"));
        }
    }
    Ok(())
}

fn ticks_keep_coming(mut bench: Bench) -> Result<(), String> {
    ran(&mut bench, 0.3)?;
    match bench.compared {
        250..=300 => Ok(()),
        ticks => Err(format!("{ticks} ticks in 0.3 s")),
    }
}

fn codes_are_the_hosts(mut bench: Bench) -> Result<(), String> {
    ran(&mut bench, 0.3)?;
    if let Some(difference) = bench.differences.first() {
        return Err(difference.clone());
    }
    bench.open_session();
    bench.ask(Command::Arm).result.map_err(|refusal| format!("the board cannot be armed: {refusal:?}"))?;
    let shape = Shape::Sine;
    bench.ask(Command::Generate(Generator::Repeat { shape, centre_um: 0, amplitude_um: 50_000, period_ms: 1_000 }));
    ran(&mut bench, 0.3)?;
    match bench.differences.first() {
        None => Ok(()),
        Some(difference) => Err(difference.clone()),
    }
}

fn the_interrupt_gives_way_to_nobody(mut bench: Bench) -> Result<(), String> {
    ran(&mut bench, 0.3)?;
    bench.open_session();
    let mut entered_for = 0;
    for _ in 0..200 {
        // Something for the serial line's interrupt to do, at all times of a tick.
        bench.send(Command::Status);
        let machine = bench.machine();
        let end = machine.chip.now + stm32_emulator::time::from_seconds(5.037 * MILLISECOND);
        while machine.chip.now < end {
            let inside = machine.chip.system.current() == CONTROL_INTERRUPT;
            machine.step(end).map_err(|stop| stop.to_string())?;
            if !inside && machine.chip.system.current() == CONTROL_INTERRUPT {
                // Entered twice for one sequence of conversions: something else ran in between.
                if machine.chip.adc1.sequences == entered_for {
                    return Err("it was interrupted".into());
                }
                entered_for = machine.chip.adc1.sequences;
            }
        }
    }
    Ok(())
}

fn a_save_leaves_the_board_running(mut bench: Bench) -> Result<(), String> {
    ran(&mut bench, 0.3)?;
    bench.open_session();
    for save in 1..=5 {
        bench.ask(Command::Set(Parameter::TelemetryEvery, f32::from(save as u8)));
        bench.send(Command::Save);
        ran(&mut bench, 0.1).map_err(|error| format!("save {save}: {error}"))?;
        let _ = bench.machine().chip.lpuart.take_sent();
        match bench.ask(Command::Status).result {
            Ok(Reply::Status(status)) if status.state == "idle" => {}
            other => return Err(format!("save {save}: {other:?}")),
        }
    }
    if bench.machine().chip.flash.erased == 0 { Err("nothing was erased".into()) } else { Ok(()) }
}

#[test]
fn a_firmware_broken_on_purpose_is_found_by_the_check_that_is_meant_for_its_fault() {
    let Some(elf) = elf() else { return };
    for (name, check) in CHECKS {
        assert_eq!(check(boot(elf, 0)), Ok(()), "without a fault: {name}");
    }
    for (fault, (name, check)) in (1..).zip(CHECKS) {
        let found = check(boot(elf, fault));
        println!("fault {fault}: {name}: {found:?}");
        assert!(found.is_err(), "fault {fault} is not found by the check that {name}");
    }
}
