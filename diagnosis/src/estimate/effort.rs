//! How much has been computed so far, counted in samples and not in seconds: so a search that has to end does so at the
//! same place on every machine.

use crate::data::channel::{Channel, Channels};
use core::sync::atomic::{AtomicUsize, Ordering};

/// Samples of balances evaluated, in those of a chamber.
#[derive(Debug, Default)]
pub(crate) struct Effort {
    samples: AtomicUsize,
}

impl Effort {
    /// The balances of some channels have run over so many samples each. A force balance takes the time of three chambers, a
    /// chamber whose air has a temperature of its own (`is_warm`) that of two and a half, a supply next to none.
    pub(crate) fn add(&self, samples: usize, channels: Channels, is_warm: bool) {
        let chambers = (channels & (Channel::PressureA.bit() | Channel::PressureB.bit())).count_ones() as usize;
        let halves =
            chambers * if is_warm { 5 } else { 2 } + if channels & Channel::Position.bit() == 0 { 0 } else { 6 };
        self.samples.fetch_add(samples * halves / 2, Ordering::Relaxed);
    }

    /// Millions of samples so far. To be asked only where no evaluation is under way.
    pub(crate) fn millions(&self) -> f64 {
        self.samples.load(Ordering::Relaxed) as f64 * 1.0e-6
    }
}
