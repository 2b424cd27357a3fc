//! The control interrupt: the only code between the converter and the valve.
//!
//! It allocates nothing, waits for nothing and logs nothing. It meets the background in three places, all lock-free: a
//! queue of orders coming in, a queue of records going out, and [`SNAPSHOT`].

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use control::ExternalFaults;
use cortex_m::peripheral::DWT;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt;
use firmware_core::{ControlLoop, Order, OutputCheck, Record, Snapshot, Timing};

use crate::board::{Sampler, Valve};
use crate::faults::memory_corrupted;
use crate::guard::{Hole, sum_around, sum_of};
use crate::ring::{Reader, Ring, Writer};

/// Records between two rounds of the telemetry task (2 ms): 20 at 10 kHz undecimated, and some for slow rounds.
pub(crate) const RECORDS: usize = 32;
/// The background sends one order and waits until it has been taken.
pub(crate) const ORDERS: usize = 1;

/// What the background may read at any time.
pub(crate) static SNAPSHOT: Snapshot = Snapshot::new();
/// Set by the command task for every request that was carried out, cleared by the interrupt.
pub(crate) static HOST_HEARD: AtomicBool = AtomicBool::new(false);
/// Conversions read; wraps.
pub(crate) static SAMPLED: AtomicU32 = AtomicU32::new(0);
/// Control steps finished; wraps.
pub(crate) static CONTROLLED: AtomicU32 = AtomicU32::new(0);

/// What the interrupt owns.
struct Owned {
    sampler: Sampler,
    valve: Valve,
    air: Output<'static>,
    control_loop: ControlLoop,
    orders: Reader<Order, ORDERS>,
    records: Writer<Record, RECORDS>,
    timing: Timing,
    output: OutputCheck,
    /// The code that the timer latches next.
    written: u16,
}

/// Sums of what the interrupt owns, see `guard.rs`. Outside of it, and its alone. In bench mode they rest: the valve is at mid
/// then, and at 10 kHz the simulated plant needs the time.
struct Sums {
    /// Of what a tick changes, taken at the end of the last one.
    changing: AtomicU32,
    /// Of what only orders change, taken behind the last one: what a code comes of, and what the monitor needs.
    ordered: AtomicU32,
    monitored: AtomicU32,
}
static SUMS: Sums = Sums { changing: AtomicU32::new(0), ordered: AtomicU32::new(0), monitored: AtomicU32::new(0) };

/// The configuration, and the program of the setpoint if there is one.
#[inline(always)]
fn sum_of_orders(control_loop: &ControlLoop) -> u32 {
    sum_of(control_loop.config()) ^ control_loop.program().map_or(0, sum_of).rotate_left(1)
}

/// The rig as the monitor knows it.
#[inline(always)]
fn sum_of_monitored(control_loop: &ControlLoop) -> u32 {
    control_loop.monitored().map_or(0, sum_of)
}

/// The rest, but for the place of the simulated plant, which is not in use while the sums are taken. Should a flip put one
/// there, bench mode is on: valve at mid, no air.
#[inline(always)]
fn sum_of_changing(owned: &Owned) -> u32 {
    let control_loop = &owned.control_loop;
    let config = Hole::at(control_loop.config());
    let holes = [Hole::at(control_loop.bench_slot()), config, control_loop.monitored().map_or(config, Hole::at)];
    sum_around(owned, holes)
}

impl Sums {
    #[inline(always)]
    fn note_order(&self, owned: &Owned) {
        self.ordered.store(sum_of_orders(&owned.control_loop), Ordering::Relaxed);
        self.monitored.store(sum_of_monitored(&owned.control_loop), Ordering::Relaxed);
    }

    #[inline(always)]
    fn note(&self, owned: &Owned) {
        if !owned.control_loop.bench() {
            self.changing.store(sum_of_changing(owned), Ordering::Relaxed);
        }
    }

    /// Whether nothing has changed since of what a code comes of.
    #[inline(always)]
    fn fit(&self, owned: &Owned) -> bool {
        owned.control_loop.bench()
            || (sum_of_changing(owned) == self.changing.load(Ordering::Relaxed)
                && sum_of_orders(&owned.control_loop) == self.ordered.load(Ordering::Relaxed))
    }

    /// Whether the monitor's rig has not changed: behind the valve code, and before the monitor needs it.
    #[inline(always)]
    fn monitored_fit(&self, owned: &Owned) -> bool {
        owned.control_loop.bench() || sum_of_monitored(&owned.control_loop) == self.monitored.load(Ordering::Relaxed)
    }
}

struct OwnedCell(UnsafeCell<Option<Owned>>);
// SAFETY: filled by `start` before the interrupt is enabled, touched by the interrupt alone afterwards.
unsafe impl Sync for OwnedCell {}
static OWNED: OwnedCell = OwnedCell(UnsafeCell::new(None));

/// The background's ends of the queues.
pub(crate) struct Background {
    /// Orders for the loop.
    pub(crate) orders: Writer<Order, ORDERS>,
    /// Records of the loop.
    pub(crate) records: Reader<Record, RECORDS>,
}

/// Starts the tick. Called once.
pub(crate) fn start(
    mut sampler: Sampler,
    mut valve: Valve,
    air: Output<'static>,
    control_loop: ControlLoop,
    tick_hz: u32,
) -> Background {
    static ORDER_QUEUE: static_cell::ConstStaticCell<Ring<Order, ORDERS>> =
        static_cell::ConstStaticCell::new(Ring::new());
    static RECORD_QUEUE: static_cell::ConstStaticCell<Ring<Record, RECORDS>> =
        static_cell::ConstStaticCell::new(Ring::new());
    let (order_in, orders) = ORDER_QUEUE.take().split();
    let (records, record_out) = RECORD_QUEUE.take().split();
    sampler.set_rate(tick_hz);
    let written = control_loop.safe_code();
    valve.set(written);
    valve.latch_with_tick();
    let timing = Timing::new(sampler.cycles_per_tick());
    // SAFETY: the interrupt is not enabled yet, see `OwnedCell`.
    let owned = unsafe { &mut *OWNED.0.get() }.insert(Owned {
        sampler,
        valve,
        air,
        control_loop,
        orders,
        records,
        timing,
        output: OutputCheck::default(),
        written,
    });
    SUMS.note_order(owned);
    SUMS.note(owned);
    owned.sampler.start();
    Background { orders: order_in, records: record_out }
}

#[interrupt]
fn ADC1_2() {
    let entry = DWT::cycle_count();
    // SAFETY: see `OwnedCell`.
    let Some(owned) = (unsafe { &mut *OWNED.0.get() }) else { return };
    // First what the next conversion would overwrite. No code comes of it before the sums are found right.
    let sequence = owned.sampler.read();
    count(&SAMPLED);
    let sampled = DWT::cycle_count();
    if !SUMS.fit(owned) {
        memory_corrupted();
    }

    let faults = owned.timing.begin(sampled, sequence.since_update, sequence.mixed);
    let valve_output = owned.output.faulty(owned.written, owned.valve.seen(), faults.late_tick);
    let faults = ExternalFaults { valve_output, ..faults };
    SNAPSHOT.count_faults(&faults);
    let host_heard = HOST_HEARD.load(Ordering::Relaxed);
    if host_heard {
        HOST_HEARD.store(false, Ordering::Relaxed);
    }
    let tick = owned.control_loop.tick(sequence.codes, faults, host_heard);
    let controlled = DWT::cycle_count();
    owned.valve.set(tick.valve);
    owned.written = tick.valve;
    let written = DWT::cycle_count();
    owned.air.set_level(owned.control_loop.air_allowed().into());
    owned.timing.end(owned.sampler.overran());
    count(&CONTROLLED);

    // Past the valve: what follows may take its time, until the next tick.
    if !SUMS.monitored_fit(owned) {
        memory_corrupted();
    }
    if owned.control_loop.conclude() {
        SNAPSHOT.count_disagreement();
    }
    SNAPSHOT.publish(&tick.record, &owned.control_loop);
    SNAPSHOT.note_cycles(written.wrapping_sub(entry));
    if tick.record_due {
        // More than 65 535 cycles do not fit a tick at any rate worth telling apart.
        let stamp = |at: u32| at.wrapping_sub(entry).min(0xFFFF) as u16;
        let record = Record { stamps: [stamp(sampled), stamp(controlled), stamp(written)], ..tick.record };
        if owned.records.enqueue(record).is_err() {
            SNAPSHOT.count_lost();
        }
    }
    // Last, for the coming tick: an order takes longer than a tick's computation, and must not make the valve code late.
    let control_loop = &mut owned.control_loop;
    if owned.orders.dequeue_with(|order| control_loop.order(order)) {
        SUMS.note_order(owned);
    }
    SUMS.note(owned);
}

/// Only the interrupt writes these: a plain load and store, cheaper than an atomic addition.
#[inline(always)]
fn count(counter: &AtomicU32) {
    counter.store(counter.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
}
