//! The guest: setup, then tick for tick.

use control::{AdcCode, Reason};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use defmt_semihosting as _;
use embassy_executor::Spawner;
use embassy_futures::yield_now;
use firmware_core::lockstep::{
    ACCEPTED, Counts, READY, REFUSED, SETUP_BYTES, SetupMessage, TICK_BYTES, WATCHDOG_RESET, decode_tick, encode_answer,
};
use firmware_core::{ControlLoop, Record, Scales, mode_number, send_record};
use heapless::spsc::{Consumer, Queue};
use semihosting::c;
use semihosting::fs::File;
use semihosting::io::{Read, Write};

/// SysTick runs at the core clock of mps2-an386, 25 MHz: 40 ns a count. An instruction takes 64 ns at `-icount shift=6`.
const NS_PER_COUNT: u32 = 40;
const NS_PER_INSTRUCTION: u32 = 64;
const SYSTICK_MASK: u32 = 0x00FF_FFFF;

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    semihosting::eprintln!("guest: {info}");
    semihosting::process::exit(101)
}

fn must<T, E>(result: Result<T, E>, what: &str) -> T {
    match result {
        Ok(value) => value,
        Err(_) => {
            semihosting::eprintln!("guest: cannot {what}");
            semihosting::process::exit(2)
        }
    }
}

fn read_all(file: &mut File, bytes: &mut [u8]) {
    let mut filled = 0;
    while let Some(rest) = bytes.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        let count = must(file.read(rest), "read from the host");
        if count == 0 {
            semihosting::eprintln!("guest: the host has gone");
            semihosting::process::exit(3);
        }
        filled += count;
    }
}

fn write_all(file: &mut File, bytes: &[u8]) {
    must(file.write_all(bytes), "write to the host");
}

/// Counts since `start`; SysTick counts down.
fn since(start: u32) -> u32 {
    start.wrapping_sub(SYST::get_current()) & SYSTICK_MASK
}

fn instructions(counts: u32) -> u32 {
    (counts * NS_PER_COUNT + NS_PER_INSTRUCTION / 2) / NS_PER_INSTRUCTION
}

#[embassy_executor::task]
async fn telemetry(mut records: Consumer<'static, Record>) -> ! {
    loop {
        while let Some(record) = records.dequeue() {
            send_record(&record, 0);
        }
        yield_now().await;
    }
}

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let mut core = must(cortex_m::Peripherals::take().ok_or(()), "take the core's peripherals");
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(SYSTICK_MASK);
    core.SYST.clear_current();
    core.SYST.enable_counter();

    let mut input = must(File::open(c!("ticks.in")), "open ticks.in");
    let mut output = must(File::create(c!("ticks.out")), "open ticks.out");
    write_all(&mut output, &[READY]);
    let mut length = [0; 2];
    read_all(&mut input, &mut length);
    let mut buffer = [0; SETUP_BYTES];
    let message = must(buffer.get_mut(..usize::from(u16::from_le_bytes(length))).ok_or(()), "take a setup this long");
    read_all(&mut input, message);
    let setup = firmware_core::lockstep::decode_setup(message);
    let delayed = setup.as_ref().is_some_and(|setup: &SetupMessage| setup.output_delay_ticks > 0);
    let every = setup.as_ref().map_or(0, |setup: &SetupMessage| setup.every);
    if let (Some(setup), true) = (&setup, every > 0) {
        Scales::of_parameters(&setup.parameters, every).send();
    }
    let bench = setup.as_ref().filter(|setup: &&SetupMessage| setup.bench).map(SetupMessage::bench_plant);
    let Some((setup, state)) = setup.and_then(SetupMessage::into_setup) else {
        write_all(&mut output, &[REFUSED]);
        semihosting::process::exit(2)
    };
    let mut bench = match bench {
        None => None,
        Some(Some(plant)) => Some(plant),
        Some(None) => {
            write_all(&mut output, &[REFUSED]);
            semihosting::process::exit(2)
        }
    };
    write_all(&mut output, &[ACCEPTED]);

    static RECORDS: static_cell::ConstStaticCell<Queue<Record, 64>> = static_cell::ConstStaticCell::new(Queue::new());
    let (mut records, drain) = RECORDS.take().split();
    spawner.spawn(must(telemetry(drain), "start telemetry"));

    let start = SYST::get_current();
    let overhead = since(start);
    let mut control_loop = ControlLoop::in_state(setup, state);
    let mut counts = Counts::default();
    let (mut tick, mut sequence, mut last_mode) = (0_u32, 0_u32, u16::MAX);
    let mut last_dac = control_loop.safe_code();
    let mut latched = last_dac;
    loop {
        let mut message = [0; TICK_BYTES];
        read_all(&mut input, &mut message);
        if message[0] == WATCHDOG_RESET {
            control_loop.reboot(Reason::WatchdogReset);
            continue;
        }
        let Some(mut inputs) = decode_tick(&message) else { break };
        let start = SYST::get_current();
        if let Some(plant) = &mut bench {
            let [position, a, b, supply] = plant.advance(latched).map(AdcCode);
            (inputs.position, inputs.pressure_a, inputs.pressure_b) = (position, a, b);
            inputs.supply = Some(supply);
        }
        let simulated = since(start);
        let start = SYST::get_current();
        let outputs = control_loop.step(inputs);
        let law = since(start);
        control_loop.watch();
        let all = since(start);
        counts.add(
            instructions(law.saturating_sub(overhead)),
            instructions(all.saturating_sub(2 * overhead)),
            instructions(simulated.saturating_sub(overhead)),
        );
        // The valve takes a code one tick late, as on the board.
        latched = last_dac;
        write_all(&mut output, &encode_answer(outputs.dac.0, outputs.mode));

        tick = tick.wrapping_add(1);
        let mode = mode_number(outputs.mode);
        let event = mode != last_mode;
        last_mode = mode;
        if every > 0 && (event || tick.is_multiple_of(every)) {
            let record = Record {
                tick,
                sequence,
                codes: [
                    inputs.position.0,
                    inputs.pressure_a.0,
                    inputs.pressure_b.0,
                    inputs.supply.map_or(0, |code| code.0),
                ],
                dac: outputs.dac.0,
                held: if delayed { last_dac } else { outputs.dac.0 },
                reference_bits: outputs.telemetry.reference.to_bits(),
                mode,
                disagreement: false,
                event,
                stamps: [0; 3],
            };
            sequence = sequence.wrapping_add(1);
            // The telemetry task runs at the next yield: the queue cannot fill.
            let _ = records.enqueue(record);
        }
        last_dac = outputs.dac.0;
        yield_now().await;
    }
    write_all(&mut output, &counts.to_bytes());
    semihosting::process::exit(0)
}
