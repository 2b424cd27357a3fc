//! Boot: valve first, then clocks, then the note of the previous run, parameters, loop, background.

use board_link::TextWord;
use control::Reason;
use defmt_rtt as _;
use embassy_executor::Spawner;
use firmware_core::{ControlLoop, Desk, Loaded, Scales, Settings};
use static_cell::ConstStaticCell;

use crate::board::{self, ResetCause, SerialBuffers};
use crate::bootloader;
use crate::commands::{CommandTask, command_task};
use crate::faults::{self, FaultKind, PreviousFault};
use crate::sampling;
use crate::storage;
use crate::supervisor::supervisor_task;
use crate::telemetry::telemetry_task;

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    bootloader::enter_if_asked();
    // Until here the pin was high impedance, and the output stage held the valve at mid.
    board::valve_to_mid_at_once();
    board::start_watchdog();
    let cause = board::reset_cause();
    let previous = faults::take_previous(cause);

    static BUFFERS: ConstStaticCell<SerialBuffers> =
        ConstStaticCell::new(SerialBuffers { transmit: [0; 256], receive: [0; 256] });
    let board = board::start(BUFFERS.take());
    enable_cycle_counter();
    defmt::info!("boot {=str} {=str} cause={}", board::NAME, env!("CARGO_PKG_VERSION"), cause);
    if let Some(fault) = &previous {
        defmt::error!("previous run: {} {=str} {}", fault.kind, fault.text(), fault.registers());
    }

    let mut store = storage::open(board.flash);
    let loaded = match &mut store {
        Some(store) => store.load().await,
        None => {
            defmt::error!("flash has a single bank (option bit DBANK): nothing can be saved");
            Loaded::Corrupt(Settings::default())
        }
    };
    let unreadable = matches!(loaded, Loaded::Corrupt(_));
    match &loaded {
        Loaded::Stored(_) => defmt::info!("parameters from flash"),
        Loaded::Empty(_) => defmt::info!("no parameters in flash: defaults"),
        Loaded::Corrupt(_) => defmt::error!("parameters in flash are unusable: defaults"),
    }
    // Checked when loaded; should that ever be wrong, the defaults are known to fit together.
    let mut settings = loaded.settings();
    let setup = match settings.setup() {
        Ok(setup) => setup,
        Err(_) => {
            settings = Settings::default();
            defmt::unwrap!(settings.setup().ok(), "the defaults fit together")
        }
    };

    match settings.kept_fits() {
        Ok(()) if settings.kept.is_some() => defmt::info!("the law begins with what was kept"),
        Ok(()) => {}
        Err(why) => defmt::error!("what is kept is not used: {=str}", why.words()),
    }

    // Ahead of the reset's reason, whose text `last-fault` tells as well: these defaults fit another cylinder.
    let reset = unreadable.then_some(Reason::ParametersUnreadable).or(reset_reason(cause, previous.as_ref()));
    let control_loop = ControlLoop::new(setup, reset);
    let desk = Desk::new(settings.clone(), board::NAME, env!("CARGO_PKG_VERSION"), fault_text(previous.as_ref()));
    let background = sampling::start(board.sampler, board.valve, board.air, control_loop, settings.tick_hz());
    spawner.spawn(defmt::unwrap!(telemetry_task(background.records, Scales::of(&settings))));
    spawner.spawn(defmt::unwrap!(command_task(CommandTask { desk, orders: background.orders, store }, board.serial)));
    spawner.spawn(defmt::unwrap!(supervisor_task(board.light)));
}

/// What the operator has to acknowledge before the loop may leave the safe state.
fn reset_reason(cause: ResetCause, previous: Option<&PreviousFault>) -> Option<Reason> {
    match (previous.map(|fault| fault.kind), cause) {
        (Some(FaultKind::StackOverflow), _) => Some(Reason::StackOverflow),
        (Some(FaultKind::Panic | FaultKind::HardFault), _) => Some(Reason::Panic),
        (Some(FaultKind::MemoryCorrupted), _) => Some(Reason::MemoryCorrupted),
        (None, ResetCause::Watchdog) => Some(Reason::WatchdogReset),
        (None, ResetCause::PowerOrPin | ResetCause::Software | ResetCause::Other) => None,
    }
}

/// For `plant-sim board last-fault`.
fn fault_text(previous: Option<&PreviousFault>) -> TextWord {
    use core::fmt::Write;
    let mut text = TextWord::new();
    // A text that does not fit is cut; it is a diagnosis for people.
    let _ = match previous {
        None => Ok(()),
        Some(fault) if fault.kind == FaultKind::Panic => write!(text, "{}", fault.text()),
        Some(fault) => {
            let name = match fault.kind {
                FaultKind::StackOverflow => "stack overflow",
                FaultKind::MemoryCorrupted => "memory of the control interrupt changed by itself",
                FaultKind::HardFault | FaultKind::Panic => "hard fault",
            };
            let [cfsr, hfsr, bfar, sp] = fault.registers();
            write!(text, "{name}: CFSR {cfsr:#010x} HFSR {hfsr:#010x} BFAR {bfar:#010x} SP {sp:#010x}")
        }
    };
    text
}

fn enable_cycle_counter() {
    // SAFETY: nothing else uses these two debug blocks.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
}
