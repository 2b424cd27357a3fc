//! Records → defmt over RTT. Never blocks: with no host attached, or a slow one, records are lost and counted.
//!
//! The lines are read by people (`cargo flash-g4` prints them) and by `plant-sim record`; their words are the format.
//! A record's `seq` rises by one: a gap means loss, wherever it happened (queue, RTT buffer, probe).

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};

use embassy_sync::blocking_mutex::ThreadModeMutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Ticker};
use firmware_core::{Recent, Record, Scales, send_learned, send_record};

use crate::ring::Reader;
use crate::sampling::{RECORDS, SNAPSHOT};

/// Rounds of this task; wraps.
pub(crate) static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// How often the task looks at the queue.
const ROUND: Duration = Duration::from_millis(2);
/// Rounds between two repetitions of the scales, and of what was learned: a host that attaches late knows them within a second.
const SCALE_ROUNDS: u32 = 500;

/// Ranges and rates from now on, for records not yet sent.
pub(crate) static NEW_SCALES: Signal<CriticalSectionRawMutex, Scales> = Signal::new();

/// For a host that asks over the serial line. Both tasks run in the thread executor, so no interrupt has to wait.
pub(crate) static RECENT: ThreadModeMutex<RefCell<Recent>> = ThreadModeMutex::new(RefCell::new(Recent::new()));

/// Moves records from the queue to defmt.
#[embassy_executor::task]
pub(crate) async fn telemetry_task(mut records: Reader<Record, RECORDS>, mut scales: Scales) -> ! {
    let mut round = Ticker::every(ROUND);
    loop {
        let rounds = ROUNDS.load(Ordering::Relaxed);
        ROUNDS.store(rounds.wrapping_add(1), Ordering::Relaxed);
        let changed = NEW_SCALES.try_take().map(|new| scales = new).is_some();
        if changed || rounds.is_multiple_of(SCALE_ROUNDS) {
            scales.send();
            if let Some(learned) = SNAPSHOT.learned() {
                send_learned(&learned, SNAPSHOT.ticks(), scales.tick_hz);
            }
        }
        while let Some(record) = records.dequeue() {
            send_record(&record, SNAPSHOT.records_lost());
            RECENT.lock(|recent| recent.borrow_mut().push(&record));
        }
        round.next().await;
    }
}
