//! The balances: each predicts one channel from the others as measured, so that only its own physics shows.
//!
//! | balance | predicts | from | shows |
//! | --- | --- | --- | --- |
//! | mass A, mass B | chamber pressure | command, position, supply | valve and gas only: friction never shows here |
//! | force | position | both pressures, external force | mechanics only: the dead zone never shows here |
//! | supply | supply pressure | command, pressures | the air source |
//!
//! Every prediction runs as an observer: it is drawn towards the measurement with a time constant that balances sensor
//! noise against what accumulates in the prediction, so its errors (innovations) are white where the physics is right,
//! and no horizon has to be chosen for the fit.

pub(crate) mod chamber;
pub(crate) mod command;
pub(crate) mod motion;
pub(crate) mod shared;
pub(crate) mod supply;

use crate::record::{Record, Stretch};
use crate::terms::Added;
use plant_model::Plant;
use serde::{Serialize, Serializer};
use shared::Signals;

/// The predicted channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Channel {
    /// Pressure of A: the air balance of that chamber.
    PressureA,
    /// Pressure of B: the air balance of that chamber.
    PressureB,
    /// Position: the force balance of the piston.
    Position,
    /// Supply pressure: the air source.
    Supply,
}

impl Channel {
    /// All of them, in the order of arrays by channel.
    pub const ALL: [Self; 4] = [Self::PressureA, Self::PressureB, Self::Position, Self::Supply];

    pub(crate) const fn bit(self) -> u8 {
        1 << self as u8
    }

    /// The column of the log it predicts.
    #[must_use]
    pub const fn column(self) -> &'static str {
        match self {
            Self::PressureA => "p_a_pa",
            Self::PressureB => "p_b_pa",
            Self::Position => "y_m",
            Self::Supply => "p_sup_pa",
        }
    }
}

/// As the column it predicts.
impl Serialize for Channel {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.column())
    }
}

/// A set of channels, one bit each.
pub(crate) type Channels = u8;

/// Which balances the log allows.
pub(crate) fn judgeable(record: &Record) -> Channels {
    let has = record.available;
    let mut channels = 0;
    if has.command && has.pressure_a {
        channels |= Channel::PressureA.bit();
    }
    if has.command && has.pressure_b {
        channels |= Channel::PressureB.bit();
    }
    if has.pressure_a && has.pressure_b && motion::moves(record) {
        channels |= Channel::Position.bit();
    }
    if has.supply && has.command && has.pressure_a && has.pressure_b {
        channels |= Channel::Supply.bit();
    }
    channels
}

/// Prediction errors in units of the channel's noise, sample by sample over the chosen stretches; NaN where a
/// prediction is not settled yet.
#[derive(Clone, Debug, Default)]
pub(crate) struct Innovations {
    pub(crate) channels: [Vec<f64>; 4],
}

/// The samples a set of stretches covers, in order.
pub(crate) fn samples(stretches: &[Stretch]) -> impl Iterator<Item = usize> + '_ {
    stretches.iter().flat_map(Stretch::range)
}

/// Runs the wanted balances of a model, with some terms added, over some stretches of the log.
pub(crate) fn innovations(
    record: &Record,
    signals: &Signals,
    plant: &Plant<f64>,
    added: &Added,
    stretches: &[Stretch],
    wanted: Channels,
) -> Innovations {
    let mut out = Innovations::default();
    let flows = Channel::PressureA.bit() | Channel::PressureB.bit() | Channel::Supply.bit();
    if wanted & flows != 0 {
        let openings = signals.openings.of(command::Path::of(plant), || command::openings(record, plant));
        let supply = supply::pressures(record, plant, &openings);
        for (channel, side) in [(Channel::PressureA, chamber::Side::A), (Channel::PressureB, chamber::Side::B)] {
            if wanted & channel.bit() != 0 {
                let geometry = chamber::Geometry::of(plant, side);
                let strokes = signals
                    .strokes
                    .of((geometry, stretches.to_vec()), || chamber::strokes(record, &geometry, stretches));
                let drive = chamber::Drive {
                    strokes: &strokes,
                    openings: &openings,
                    supply_pa: &supply.at_valve,
                    added_kg_per_s: if side == chamber::Side::A {
                        &added.flow_a_kg_per_s
                    } else {
                        &added.flow_b_kg_per_s
                    },
                };
                out.channels[channel as usize] = chamber::innovations(record, plant, stretches, side, &drive);
            }
        }
        if wanted & Channel::Supply.bit() != 0 {
            out.channels[Channel::Supply as usize] = supply::innovations(record, stretches, &supply.predicted);
        }
    }
    if wanted & Channel::Position.bit() != 0 {
        let timing = motion::Timing::of(plant);
        let forces = signals.forces.of((timing, stretches.to_vec()), || motion::forces(record, &timing, stretches));
        out.channels[Channel::Position as usize] =
            motion::innovations(record, plant, &forces, &added.force_n, stretches);
    }
    out
}
