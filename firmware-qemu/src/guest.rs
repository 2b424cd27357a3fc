//! The guest: setup, then tick for tick.

use control::Reason;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use defmt_semihosting as _;
use embassy_executor::Spawner;
use embassy_futures::yield_now;
use firmware_core::lockstep::{
    ACCEPTED, Counts, READY, REFUSED, SETUP_BYTES, SetupMessage, TICK_BYTES, WATCHDOG_RESET, decode_tick, encode_answer,
};
use firmware_core::{Order, Record, Scales, send_learned, send_record};
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
    let (every, tick_hz) =
        setup.as_ref().map_or((0, 1), |setup: &SetupMessage| (setup.every, setup.parameters.tick_hz));
    if let (Some(setup), true) = (&setup, every > 0) {
        Scales::of_parameters(&setup.parameters, every).send();
    }
    let Some(mut control_loop) = setup.and_then(SetupMessage::into_loop) else {
        write_all(&mut output, &[REFUSED]);
        semihosting::process::exit(2)
    };
    write_all(&mut output, &[ACCEPTED]);

    static RECORDS: static_cell::ConstStaticCell<Queue<Record, 64>> = static_cell::ConstStaticCell::new(Queue::new());
    let (mut records, drain) = RECORDS.take().split();
    spawner.spawn(must(telemetry(drain), "start telemetry"));

    let start = SYST::get_current();
    let overhead = since(start);
    let mut counts = Counts::default();
    loop {
        let mut message = [0; TICK_BYTES];
        read_all(&mut input, &mut message);
        if message[0] == WATCHDOG_RESET {
            control_loop.reboot(Reason::WatchdogReset);
            continue;
        }
        let Some(inputs) = decode_tick(&message) else { break };
        if let Some(command) = inputs.command {
            control_loop.order(&Order::Command(command));
        }
        control_loop.hold(inputs.reference);
        let codes = [inputs.position, inputs.pressure_a, inputs.pressure_b, inputs.supply.unwrap_or_default()];
        let start = SYST::get_current();
        let tick = control_loop.tick(codes.map(|code| code.0), inputs.faults, inputs.host_heard);
        let ticked = since(start);
        control_loop.conclude();
        let all = since(start);
        counts.add(instructions(ticked.saturating_sub(overhead)), instructions(all.saturating_sub(2 * overhead)));
        // What the law wants: in bench mode the valve itself stands at the safe code.
        write_all(&mut output, &encode_answer(tick.record.dac, tick.record.mode));
        if every > 0 && tick.record_due {
            // The telemetry task runs at the next yield: the queue cannot fill.
            let _ = records.enqueue(tick.record);
        }
        if every > 0
            && tick.record.tick.is_multiple_of(tick_hz)
            && let Some(learned) = control_loop.learned()
        {
            send_learned(&learned, tick.record.tick, tick_hz);
        }
        yield_now().await;
    }
    write_all(&mut output, &counts.to_bytes());
    semihosting::process::exit(0)
}
