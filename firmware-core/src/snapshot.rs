//! What the background may read of the control interrupt at any time, without locks.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use control::{ExternalFaults, Learned, Mode, QUANTITIES};

use crate::control_loop::ControlLoop;
use crate::record::{Record, micrometres, mode_from_number};

/// Written by the control interrupt, read by anybody. Each value is whole; two values may be a tick apart.
#[derive(Debug, Default)]
pub struct Snapshot {
    ticks: AtomicU32,
    position_and_a: AtomicU32,
    b_and_supply: AtomicU32,
    mode_and_dac: AtomicU32,
    reference_bits: AtomicU32,
    overruns: AtomicU32,
    late_ticks: AtomicU32,
    missed_ticks: AtomicU32,
    disagreements: AtomicU32,
    records_lost: AtomicU32,
    worst_cycles: AtomicU32,
    bench: AtomicU32,
    /// Whether `learned` holds nothing, what a run would begin with, or what a run has learned.
    learning: AtomicU32,
    learned: [AtomicU32; QUANTITIES],
}

/// A copy of everything in a [`Snapshot`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnapshotValues {
    /// Ticks since start.
    pub ticks: u32,
    /// Position, p_a, p_b, p_sup.
    pub codes: [u16; 4],
    /// Mode after the last tick.
    pub mode: Mode,
    /// Valve code of the control law.
    pub dac: u16,
    /// Setpoint in force, micrometres.
    pub setpoint_um: i32,
    /// Ticks whose samples may be mixed with those of the next.
    pub overruns: u32,
    /// Ticks whose valve code came too late.
    pub late_ticks: u32,
    /// Ticks that did not happen.
    pub missed_ticks: u32,
    /// Ticks in which the model monitor saw a contradiction.
    pub disagreements: u32,
    /// Telemetry records lost.
    pub records_lost: u32,
    /// Most cycles from interrupt entry to the valve code.
    pub worst_cycles: u32,
    /// Bench mode.
    pub bench: bool,
}

impl Snapshot {
    /// All zero: boot.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            ticks: AtomicU32::new(0),
            position_and_a: AtomicU32::new(0),
            b_and_supply: AtomicU32::new(0),
            mode_and_dac: AtomicU32::new(0),
            reference_bits: AtomicU32::new(0),
            overruns: AtomicU32::new(0),
            late_ticks: AtomicU32::new(0),
            missed_ticks: AtomicU32::new(0),
            disagreements: AtomicU32::new(0),
            records_lost: AtomicU32::new(0),
            worst_cycles: AtomicU32::new(0),
            bench: AtomicU32::new(0),
            learning: AtomicU32::new(0),
            learned: [const { AtomicU32::new(0) }; QUANTITIES],
        }
    }

    /// Publishes a tick of the loop. For the control interrupt alone: its counters are plain loads and stores.
    #[inline]
    pub fn publish(&self, record: &Record, control_loop: &ControlLoop) {
        let learning = match control_loop.learned() {
            None => 0,
            Some(learned) => {
                for (place, bits) in self.learned.iter().zip(learned.bits) {
                    place.store(bits as u32, Relaxed);
                }
                1 + u32::from(control_loop.state().servo().has_learned())
            }
        };
        self.learning.store(learning, Relaxed);
        let [position, a, b, supply] = record.codes.map(u32::from);
        self.position_and_a.store(position << 16 | a, Relaxed);
        self.b_and_supply.store(b << 16 | supply, Relaxed);
        self.mode_and_dac.store(u32::from(record.mode) << 16 | u32::from(record.dac), Relaxed);
        self.reference_bits.store(record.reference_bits as u32, Relaxed);
        self.bench.store(u32::from(control_loop.bench()), Relaxed);
        self.ticks.store(record.tick, Relaxed);
    }

    /// Counts what a tick found wrong with its time: as the loop judges it, so that counters and reasons agree.
    #[inline]
    pub fn count_faults(&self, faults: &ExternalFaults) {
        let add = |counter: &AtomicU32, count: u32| {
            if count > 0 {
                counter.store(counter.load(Relaxed).wrapping_add(count), Relaxed);
            }
        };
        add(&self.missed_ticks, faults.missed_ticks.into());
        add(&self.late_ticks, faults.late_tick.into());
        add(&self.overruns, faults.overrun.into());
    }

    /// Counts a tick in which the model monitor saw a contradiction.
    #[inline]
    pub fn count_disagreement(&self) {
        self.disagreements.store(self.disagreements.load(Relaxed).wrapping_add(1), Relaxed);
    }

    /// Counts a telemetry record that found the queue full.
    #[inline]
    pub fn count_lost(&self) {
        self.records_lost.store(self.records_lost.load(Relaxed).wrapping_add(1), Relaxed);
    }

    /// Keeps the largest duration.
    #[inline]
    pub fn note_cycles(&self, cycles: u32) {
        if cycles > self.worst_cycles.load(Relaxed) {
            self.worst_cycles.store(cycles, Relaxed);
        }
    }

    /// Ticks since start.
    #[must_use]
    pub fn ticks(&self) -> u32 {
        self.ticks.load(Relaxed)
    }

    /// The mode after the last tick.
    #[must_use]
    pub fn mode(&self) -> Mode {
        mode_from_number((self.mode_and_dac.load(Relaxed) >> 16) as u16).unwrap_or(Mode::Boot)
    }

    /// Telemetry records lost so far.
    #[must_use]
    pub fn records_lost(&self) -> u32 {
        self.records_lost.load(Relaxed)
    }

    /// What the positioning law has learned, or will begin with. `None` under the paper's law.
    #[must_use]
    pub fn learned(&self) -> Option<Learned> {
        let mut learned = Learned::default();
        for (bits, place) in learned.bits.iter_mut().zip(&self.learned) {
            *bits = place.load(Relaxed) as i32;
        }
        (self.learning.load(Relaxed) > 0).then_some(learned)
    }

    /// Whether the positioning law has run since the start, or since what it knew was of no use any more.
    #[must_use]
    pub fn has_learned(&self) -> bool {
        self.learning.load(Relaxed) > 1
    }

    /// Whether the simulated plant stands in.
    #[must_use]
    pub fn bench(&self) -> bool {
        self.bench.load(Relaxed) != 0
    }

    /// Everything but what was learned.
    #[must_use]
    pub fn read(&self) -> SnapshotValues {
        let (first, second) = (self.position_and_a.load(Relaxed), self.b_and_supply.load(Relaxed));
        let mode_and_dac = self.mode_and_dac.load(Relaxed);
        let halves = |word: u32| [(word >> 16) as u16, word as u16];
        let ([position, a], [b, supply]) = (halves(first), halves(second));
        SnapshotValues {
            ticks: self.ticks(),
            codes: [position, a, b, supply],
            mode: self.mode(),
            dac: mode_and_dac as u16,
            setpoint_um: micrometres(control::Position::from_bits(self.reference_bits.load(Relaxed) as i32)),
            overruns: self.overruns.load(Relaxed),
            late_ticks: self.late_ticks.load(Relaxed),
            missed_ticks: self.missed_ticks.load(Relaxed),
            disagreements: self.disagreements.load(Relaxed),
            records_lost: self.records_lost(),
            worst_cycles: self.worst_cycles.load(Relaxed),
            bench: self.bench(),
        }
    }
}
