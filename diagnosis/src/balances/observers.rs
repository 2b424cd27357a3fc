//! All balances of a model run over a log.

use super::added::Added;
use super::compression::{Geometry, compression};
use super::correction::correction;
use super::shared::Signals;
use super::{chamber, momentum, piston, supply, valve};
use crate::data::channel::{Channel, Channels};
use crate::data::record::Record;
use crate::data::split::Stretch;
use plant_model::{Plant, Side};

/// Which balances the log allows.
pub(crate) fn judgeable(record: &Record) -> Channels {
    let has = record.available;
    let mut channels = 0;
    if has.command && has.pressure_a {
        channels |= Channel::PressureA.bit();
    }
    if has.command && has.pressure_b && !has.vented_b {
        channels |= Channel::PressureB.bit();
    }
    if has.pressure_a && has.pressure_b && piston::moves(record) {
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
    /// Sum of the logarithms of the units that errors are told in over the sensors' noise.
    pub(crate) log_widths: f64,
}

/// How mechanics are judged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Mechanics {
    /// By predictions of the position.
    #[default]
    Predicted,
    /// By the momentum of a sliding piston.
    Momentum,
}

/// Runs the wanted balances of a model, with some terms added, over some stretches of the log.
pub(crate) fn innovations(
    record: &Record,
    signals: &Signals,
    plant: &Plant<f64>,
    added: &Added,
    stretches: &[Stretch],
    wanted: Channels,
    mechanics: Mechanics,
) -> Innovations {
    let force = || {
        let timing = piston::Timing::of(plant);
        let forces = signals.forces.of((timing, stretches.to_vec()), || piston::forces(record, &timing, stretches));
        let judged = match mechanics {
            Mechanics::Predicted => piston::innovations,
            Mechanics::Momentum => momentum::momentum,
        };
        judged(record, plant, &forces, &added.force_n, stretches)
    };
    let air = || of_air(record, signals, plant, added, stretches, wanted);
    // Side by side: a single fit evaluates one model after the other.
    if wanted & Channel::Position.bit() == 0 {
        return air();
    }
    let (mut out, errors) = rayon::join(air, force);
    out.channels[Channel::Position as usize] = errors;
    out
}

/// The wanted balances of the air.
fn of_air(
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
        // What a drooping supply and warm walls remember from between the stretches, the openings there decide.
        let remembers = plant.added().supply_droop.droop_pa_s_per_kg > 0.0 || plant.added().wall_heat.law.is_some();
        let parts = (!remembers).then(|| stretches.to_vec());
        let places = || valve::places(record, plant, parts.as_deref());
        let make = || {
            let places = signals.places.of((valve::Travel::of(plant), parts.clone()), places);
            valve::openings_at(&places, record, plant)
        };
        let openings = signals.openings.of((valve::Path::of(plant), parts.clone()), make);
        let supply = supply::pressures(record, plant, &openings, added.supply_sensor_pa);
        let drive = |(channel, side): (Channel, Side)| {
            let geometry = Geometry::of(plant, side);
            let key = || stretches.to_vec();
            (wanted & channel.bit() != 0).then(|| chamber::Drive {
                side,
                compression: signals
                    .compression
                    .of((geometry, key()), || compression(record, plant, &geometry, stretches)),
                correction: signals.corrections.of((side, key()), || correction(record, side, stretches)),
                air: chamber::Air {
                    openings: &openings,
                    supply_pa: &supply.at_valve,
                    added_kg_per_s: if side == Side::A { &added.flow_a_kg_per_s } else { &added.flow_b_kg_per_s },
                },
            })
        };
        let drives = [(Channel::PressureA, Side::A), (Channel::PressureB, Side::B)].map(drive);
        let [a, b] = chamber::innovations(record, plant, stretches, drives.each_ref().map(Option::as_ref));
        out.channels[Channel::PressureA as usize] = a;
        out.channels[Channel::PressureB as usize] = b;
        out.log_widths = drives.iter().flatten().map(|drive| drive.correction.log_widths).sum();
        if wanted & Channel::Supply.bit() != 0 {
            out.channels[Channel::Supply as usize] =
                supply::innovations(record, stretches, &supply.predicted, added.supply_sensor_pa);
        }
    }
    out
}
