//! Boots an ELF file and says how far it came: `cargo run --release -p stm32-emulator --example boot -- ELF [milliseconds]`.

use std::time::Instant;

use stm32_emulator::analog::{Analog, share_of};
use stm32_emulator::machine::Machine;
use stm32_emulator::peripherals::adc::Conversion;
use stm32_emulator::time::{Time, from_seconds, to_seconds};

/// A piston that stands still.
struct Still;

impl Analog for Still {
    fn convert(&mut self, conversion: &Conversion) -> u16 {
        share_of(30_000, conversion)
    }
    fn output(&mut self, at: Time, code: Option<u16>) {
        println!("{:>9.6} s: valve {code:?}", to_seconds(at));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("usage: boot ELF [milliseconds]")?;
    let milliseconds: f64 = arguments.next().map_or(Ok(1000.0), |text| text.parse())?;
    let mut machine = Machine::new(&std::fs::read(path)?, Still)?;
    let started = Instant::now();
    let end = from_seconds(milliseconds / 1000.0);
    while let Some(cause) = machine.run_until(end)? {
        println!("{:>9.6} s: reset by {cause:?}", to_seconds(machine.chip.now));
        machine = machine.reset(cause)?;
    }
    let (wall, simulated) = (started.elapsed().as_secs_f64(), to_seconds(machine.chip.now));
    let instructions = machine.core.instructions;
    println!(
        "{simulated:.3} s in {wall:.3} s ({:.1} times real time), {instructions} instructions ({:.0} million a second), \
         {} conversion sequences, {} codes written, asleep {:.1} %",
        simulated / wall,
        instructions as f64 / wall / 1e6,
        machine.chip.adc1.sequences,
        machine.chip.dac.writes,
        100.0 * to_seconds(machine.idle) / simulated
    );
    Ok(())
}
