//! How much has been computed so far, counted in samples and not in seconds: so a search that has to end does so at the
//! same place on every machine.

use crate::data::channel::{Channel, Channels};
use core::sync::atomic::{AtomicUsize, Ordering};
use plant_model::{Plant, Side};

/// Samples of balances evaluated, in those of a chamber whose valve is at the cylinder.
#[derive(Debug, Default)]
pub(crate) struct Effort {
    halves: AtomicUsize,
}

impl Effort {
    /// The balances of some channels of a plant have run over so many samples each. A force balance takes the time of three chambers,
    /// a chamber behind a hose that of two, one whose air has a temperature of its own one and a half more, a supply next to none.
    pub(crate) fn add(&self, samples: usize, channels: Channels, plant: &Plant<f64>) {
        let air = [(Channel::PressureA, Side::A), (Channel::PressureB, Side::B)];
        let chamber = |side: Side| {
            let hose = if plant.orifices(side).hose.is_some() { 2 } else { 0 };
            let warmth = if plant.added().wall_heat.law.is_some() { 3 } else { 0 };
            2 + hose + warmth
        };
        let wanted = |channel: Channel| channels & channel.bit() != 0;
        let air: usize = air.into_iter().filter(|(channel, _)| wanted(*channel)).map(|(_, side)| chamber(side)).sum();
        let halves = air + if wanted(Channel::Position) { 6 } else { 0 };
        self.halves.fetch_add(samples * halves, Ordering::Relaxed);
    }

    /// The balances of some chambers have been linearised by the opening, for so many parameters: that takes three predictions, and
    /// a third of one for each parameter.
    pub(crate) fn add_linearised(&self, samples: usize, chambers: Channels, plant: &Plant<f64>, parameters: usize) {
        self.add(samples * (9 + parameters) / 3, chambers, plant);
    }

    /// Millions of samples so far. To be asked only where no evaluation is under way.
    pub(crate) fn millions(&self) -> f64 {
        self.halves.load(Ordering::Relaxed) as f64 * 0.5e-6
    }
}
