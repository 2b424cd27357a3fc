//! All balances of a model run over a log.

use super::added::Added;
use super::compression::{Geometry, Stroke, compression};
use super::correction::{Correction, correction};
use super::linearised::{Linearised, SIDE_BY_SIDE};
use super::shared::Signals;
use super::{chamber, force, momentum, motion, opening, supply, valve};
use crate::data::channel::{Channel, Channels};
use crate::data::record::Record;
use crate::data::split::Stretch;
use plant_model::{Plant, Side};
use rayon::prelude::*;
use std::sync::Arc;

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
    /// Sums of the logarithms of the units that errors are told in over the sensors' noise.
    pub(crate) log_widths: [f64; 4],
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
    let mechanical = || {
        let timing = force::Timing::of(plant);
        let forces = signals.forces.of((timing, stretches.to_vec()), || force::forces(record, &timing, stretches));
        let judged = match mechanics {
            Mechanics::Predicted => motion::innovations,
            Mechanics::Momentum => momentum::momentum,
        };
        judged(record, plant, &forces, &added.force_n, stretches)
    };
    let air = || of_air(record, signals, plant, added, stretches, wanted);
    // Side by side: a single fit evaluates one model after the other.
    if wanted & Channel::Position.bit() == 0 {
        return air();
    }
    let (mut out, errors) = rayon::join(air, mechanical);
    out.channels[Channel::Position as usize] = errors;
    out
}

/// What drives the chambers' balances.
struct Air {
    openings: opening::Openings,
    supply: supply::SupplyPressure,
    /// Of the wanted chambers.
    sides: [Option<Judged>; 2],
}

/// What the piston's motion does in a chamber, and how its prediction is judged and corrected.
type Judged = (Arc<Vec<Stroke>>, Arc<Correction>);

impl Air {
    fn of(
        record: &Record,
        signals: &Signals,
        plant: &Plant<f64>,
        added: &Added,
        stretches: &[Stretch],
        wanted: Channels,
    ) -> Self {
        let parts = (!remembers(plant)).then(|| stretches.to_vec());
        let openings = openings(record, signals, plant, parts.as_deref());
        let supply = supply::pressures(record, plant, &openings, added.supply_sensor_pa);
        let side = |(channel, side): (Channel, Side)| {
            let geometry = Geometry::of(plant, side);
            let key = || stretches.to_vec();
            (wanted & channel.bit() != 0).then(|| {
                let strokes = || compression(record, plant, &geometry, stretches);
                let lag = plant.added().position_lag;
                let corrections = || correction(record, side, &lag, stretches);
                (
                    signals.compression.of((geometry, key()), strokes),
                    signals.corrections.of((side, lag, key()), corrections),
                )
            })
        };
        Self { openings, supply, sides: CHAMBERS.map(side) }
    }

    fn drives<'a>(&'a self, added: &'a Added) -> [Option<chamber::Drive<'a>>; 2] {
        let drive = |(side, (compression, correction)): (Side, &Judged)| chamber::Drive {
            side,
            compression: Arc::clone(compression),
            correction: Arc::clone(correction),
            air: chamber::Air {
                openings: self.openings.of(side),
                supply_pa: &self.supply.at_valve,
                added_kg_per_s: if side == Side::A { &added.flow_a_kg_per_s } else { &added.flow_b_kg_per_s },
            },
        };
        let [a, b] = &self.sides;
        [(Side::A, a), (Side::B, b)].map(|(side, of)| of.as_ref().map(|of| drive((side, of))))
    }
}

const CHAMBERS: [(Channel, Side); 2] = [(Channel::PressureA, Side::A), (Channel::PressureB, Side::B)];

/// The way of the valve's spool as a chamber feels it, in some stretches if there are any.
fn way(
    record: &Record,
    signals: &Signals,
    (plant, side): (&Plant<f64>, Side),
    parts: Option<&[Stretch]>,
) -> Arc<valve::Way> {
    let key = (valve::Travel::of(plant, side), parts.map(<[Stretch]>::to_vec));
    signals.ways.of(key, || valve::way(record, plant, side, parts))
}

/// The valve's openings, in some stretches if there are any.
fn openings(record: &Record, signals: &Signals, plant: &Plant<f64>, parts: Option<&[Stretch]>) -> opening::Openings {
    let of = |side: Side| {
        let make = || opening::openings_along(&way(record, signals, (plant, side), parts), record, (plant, side));
        signals.openings.of((opening::Path::of(plant, side), parts.map(<[Stretch]>::to_vec)), make)
    };
    opening::Openings::of_plant(plant, of)
}

/// Whether the air remembers, from between stretches, what the valve did there: a drooping supply and warm walls do.
fn remembers(plant: &Plant<f64>) -> bool {
    plant.added().supply_droop.droop_pa_s_per_kg > 0.0 || plant.added().wall_heat.law.is_some()
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
        let air = Air::of(record, signals, plant, added, stretches, wanted);
        let drives = air.drives(added);
        let [a, b] = chamber::innovations(record, plant, stretches, drives.each_ref().map(Option::as_ref));
        out.channels[Channel::PressureA as usize] = a;
        out.channels[Channel::PressureB as usize] = b;
        for (drive, (channel, _)) in drives.iter().zip(CHAMBERS) {
            out.log_widths[channel as usize] = drive.as_ref().map_or(0.0, |drive| drive.correction.log_widths);
        }
        if wanted & Channel::Supply.bit() != 0 {
            let (errors, log_widths) =
                supply::innovations(record, plant, stretches, &air.supply.predicted, added.supply_sensor_pa);
            out.channels[Channel::Supply as usize] = errors;
            out.log_widths[Channel::Supply as usize] = log_widths;
        }
    }
    out
}

/// What small changes of the opening make of the errors of the wanted chambers: for each of some plants that differ from one
/// [in the opening only](Plant::differs_in_opening_only), the change of the errors to first order. The plant's supply must not
/// droop, which opening a valve would change.
pub(crate) fn by_openings(
    record: &Record,
    signals: &Signals,
    (plant, others): (&Plant<f64>, &[Plant<f64>]),
    added: &Added,
    stretches: &[Stretch],
    wanted: Channels,
) -> Vec<Innovations> {
    let air = Air::of(record, signals, plant, added, stretches, wanted);
    let drives = air.drives(added);
    let linearised = |place: usize| drives[place].as_ref().map(|d| Linearised::of(record, plant, stretches, d));
    let (a, b) = rayon::join(|| linearised(0), || linearised(1));
    let parts = (!remembers(plant)).then_some(stretches);
    let along = opening::Along::of(plant, |side| way(record, signals, (plant, side), parts), record);
    let changes = |other: &Plant<f64>| {
        let all = || opening::changes([&air.openings, &openings(record, signals, other, parts)]);
        along.as_ref().and_then(|along| along.changes_to(other)).unwrap_or_else(all)
    };
    let together = |others: &[Plant<f64>]| -> Vec<Innovations> {
        let changes: Vec<opening::Openings> = others.iter().map(changes).collect();
        let mut out = vec![Innovations::default(); others.len()];
        for (of_side, (channel, side)) in [&a, &b].into_iter().zip(CHAMBERS) {
            let Some(of_side) = of_side else { continue };
            let side_by_side = core::array::from_fn(|lane| changes.get(lane).unwrap_or(&changes[0]).of(side));
            for (out, errors) in out.iter_mut().zip(of_side.errors_by(side_by_side)) {
                out.channels[channel as usize] = errors;
            }
        }
        out
    };
    others.par_chunks(SIDE_BY_SIDE).flat_map_iter(together).collect()
}
