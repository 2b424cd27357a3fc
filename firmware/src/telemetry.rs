//! Records → defmt over RTT. Never blocks: with no host attached, or a slow one, records are lost and counted.
//!
//! The lines are read by people (`cargo flash-g4` prints them) and by `plant-sim record`; their words are the format.
//! A record's `seq` rises by one: a gap means loss, wherever it happened (queue, RTT buffer, probe).

use core::sync::atomic::{AtomicU32, Ordering};

use board_link::Parameter;
use embassy_time::{Duration, Ticker};
use firmware_core::{Record, Settings};
use heapless::spsc::Consumer;

use crate::sampling;

/// Rounds of this task; wraps.
pub(crate) static ROUNDS: AtomicU32 = AtomicU32::new(0);

/// How often the task looks at the queue.
const ROUND: Duration = Duration::from_millis(2);
/// Rounds between two repetitions of the scales: a host that attaches late knows them within a second.
const SCALE_ROUNDS: u32 = 500;

/// Moves records from the queue to defmt.
#[embassy_executor::task]
pub(crate) async fn telemetry_task(mut records: Consumer<'static, Record>, settings: Settings) -> ! {
    let mut round = Ticker::every(ROUND);
    loop {
        let rounds = ROUNDS.load(Ordering::Relaxed);
        ROUNDS.store(rounds.wrapping_add(1), Ordering::Relaxed);
        if rounds.is_multiple_of(SCALE_ROUNDS) {
            send_scales(&settings);
        }
        while let Some(record) = records.dequeue() {
            send(&record);
        }
        round.next().await;
    }
}

fn send(record: &Record) {
    let [position, a, b, supply] = record.codes;
    let [sampled, controlled, written] = record.stamps;
    defmt::info!(
        "tick={=u32} seq={=u32} y={=u16} a={=u16} b={=u16} sup={=u16} dac={=u16} ref={=i32} mode={=u16} c1={=u16} c2={=u16} c3={=u16} lost={=u32}",
        record.tick,
        record.sequence,
        position,
        a,
        b,
        supply,
        record.dac,
        record.reference_bits,
        record.mode,
        sampled,
        controlled,
        written,
        sampling::SNAPSHOT.records_lost(),
    );
    if record.event {
        defmt::warn!("event tick={=u32} mode={=u16}", record.tick, record.mode);
    }
}

fn send_scales(settings: &Settings) {
    use Parameter as P;
    defmt::info!(
        "scales hz={=u32} y={=f32}..{=f32} p={=f32}..{=f32} u={=f32}..{=f32} every={=u32}",
        settings.tick_hz(),
        settings.get(P::PositionLow),
        settings.get(P::PositionHigh),
        settings.get(P::PressureLow),
        settings.get(P::PressureHigh),
        settings.get(P::ValveLow),
        settings.get(P::ValveHigh),
        settings.telemetry_every(),
    );
}
