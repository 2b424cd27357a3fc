//! Boot: valve first, then clocks, then the rest.

use core::sync::atomic::Ordering;

use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_time::{Duration, Ticker};
use static_cell::StaticCell;

use crate::board::{self, Board, SerialBuffers};
use crate::{faults, sampling};

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    board::valve_to_mid_at_once();
    let cause = board::reset_cause();
    let previous = faults::take_previous();
    static BUFFERS: StaticCell<SerialBuffers> = StaticCell::new();
    let mut board = Board::start(BUFFERS.init(SerialBuffers { transmit: [0; 256], receive: [0; 256] }));
    defmt::info!("boot {}", cause);
    if let Some(fault) = previous {
        defmt::error!("fault {} {=str} {}", fault.kind, fault.text(), fault.registers());
    }
    board.watchdog.unleash();
    sampling::start(board.sampler, board.valve, 1000);
    let mut every_5_ms = Ticker::every(Duration::from_millis(5));
    let mut seen = 0;
    loop {
        every_5_ms.next().await;
        let ticks = sampling::TICKS.load(Ordering::Relaxed);
        if ticks != seen {
            board.watchdog.pet();
        }
        seen = ticks;
        if ticks % 500 < 5 {
            board.light.toggle();
            defmt::info!("ticks {=u32} overruns {=u32}", ticks, sampling::OVERRUNS.load(Ordering::Relaxed));
        }
    }
}
