//! From the log's columns to a record: usable samples, uninterrupted stretches, the part held back, noise levels,
//! smoothed signals, masks.

use super::adaptive_window::Windows;
use super::chamber_pressure;
use super::grid::{Between, refined};
use super::masks;
use super::noise::{self, ChannelNoise};
use super::position_observer::{bandwidth_rad_per_s, creeping, force_noise_per_s2, observer_noise, pushed};
use super::quality::Available;
use super::record::Record;
use super::smoothing::{Smoothed, parabola, twice};
use super::split::{self, Stretch};
use crate::constants;
use core::ops::Range;
use plant_model::{Plant, Side};
use rayon::prelude::*;
use rig_files::{Log, RigFile};

/// Makes a log ready, for a rig as its file states it: rows as measured, nothing between them ([`refined`]).
pub(crate) fn prepare(log: &Log, rig: &RigFile) -> Record {
    let vented_b = rig.rig.cylinder.is_single_acting();
    let vented = || Some(vec![rig.rig.supply.atmosphere_pa; log.t_s.len()]);
    let p_b_pa = if vented_b { &vented() } else { &log.p_b_pa };
    let columns = [&log.u_v, &log.p_a_pa, p_b_pa, &log.p_sup_pa, &log.f_ext_n];
    let usable: Vec<usize> = (0..log.t_s.len())
        .filter(|&k| {
            log.y_m[k].is_finite() && columns.iter().all(|c| c.as_ref().is_none_or(|values| values[k].is_finite()))
        })
        .collect();
    let pick = |values: &[f64]| -> Vec<f64> { usable.iter().map(|&k| values[k]).collect() };
    let pick_optional = |values: &Option<Vec<f64>>| values.as_ref().map(|v| pick(v)).unwrap_or_default();
    let mut record = Record {
        t_s: pick(&log.t_s),
        y_m: pick(&log.y_m),
        u_v: pick_optional(&log.u_v),
        p_a_pa: pick_optional(&log.p_a_pa),
        p_b_pa: pick_optional(p_b_pa),
        p_sup_pa: pick_optional(&log.p_sup_pa),
        f_ext_n: pick_optional(&log.f_ext_n),
        available: Available {
            command: log.u_v.is_some(),
            pressure_a: log.p_a_pa.is_some(),
            pressure_b: p_b_pa.is_some(),
            supply: log.p_sup_pa.is_some(),
            force: log.f_ext_n.is_some(),
            vented_b,
        },
        ..Record::default()
    };
    record.quality.samples = record.t_s.len();
    record.quality.blank_rows = log.t_s.len() - usable.len();
    record.stretches = split::stretches(&record.t_s, &mut record.quality);
    record.rows = (0..record.len()).collect();
    record.step_s = record.quality.interval_s;
    let times_s = noise_times_s(&record);
    estimate_noise(&mut record, &times_s);
    // A clipped position shows no noise.
    let clipped = masks::clipped(&record);
    if clipped.contains(&true) {
        let live = |s: &Stretch| -> Vec<[Vec<f64>; 2]> {
            let runs = s.range().collect::<Vec<_>>();
            let runs = runs.chunk_by(|one, other| clipped[*one] == clipped[*other]).filter(|run| !clipped[run[0]]);
            let of = |signal: &[f64], run: &[usize]| run.iter().map(|k| signal[*k]).collect();
            runs.map(|run| [&times_s, &record.y_m].map(|signal| of(signal, run))).collect()
        };
        let parts: Vec<[Vec<f64>; 2]> = record.stretches.iter().flat_map(live).collect();
        record.quality.position = noise::estimate(parts.iter().map(|[t_s, y_m]| (&t_s[..], &y_m[..])));
    }
    smooth(&mut record, Plant::new(&rig.rig, &rig.effects).ok().as_ref());
    record.valve_known_s = masks::valve_known_s(&record);
    let force_noise_per_s2 = force_noise_per_s2(&record.quality, rig);
    record.observer_rad_per_s = bandwidth_rad_per_s(&record.quality, force_noise_per_s2);
    record.creeping = creeping(rig);
    let w = record.observer_rad_per_s * record.step_s;
    let pushed = pushed(w, force_noise_per_s2 * record.step_s.powi(2), &record);
    record.observer_noise = observer_noise(w, &pushed, record.averaged());
    record.end_stops_m = masks::end_stops_m(&record, &rig.rig);
    [record.weight_a_per_pa, record.weight_b_per_pa] = masks::weights_per_pa(&record, rig);
    record.at_end = masks::at_end(&record, rig);
    record
}

/// A part of a recording, from one row to another, with other positions and chamber pressures in its rows, those of a plant.
pub(crate) fn replaced(
    record: &Record,
    range: Range<usize>,
    [y_m, p_a_pa, p_b_pa]: [Vec<f64>; 3],
    plant: &Plant<f64>,
) -> Record {
    let rows = record.rows_in(range.clone());
    let mut out = Record {
        t_s: rows.iter().map(|k| record.t_s[*k]).collect(),
        rows: (0..rows.len()).collect(),
        y_m,
        p_a_pa,
        p_b_pa,
        stretches: vec![Stretch { start: 0, end: rows.len(), held_back: true }],
        available: record.available,
        quality: record.quality.clone(),
        observer_rad_per_s: record.observer_rad_per_s,
        creeping: record.creeping,
        observer_noise: record.observer_noise,
        ..Record::default()
    };
    smooth(&mut out, Some(plant));
    let part = |signal: &[f64]| if signal.is_empty() { Vec::new() } else { signal[range.clone()].to_vec() };
    Record {
        u_v: part(&record.u_v),
        f_ext_n: part(&record.f_ext_n),
        p_sup_pa: part(&record.p_sup_pa),
        p_sup_smooth: Smoothed { value: part(&record.p_sup_smooth.value), slope: part(&record.p_sup_smooth.slope) },
        ..refined(out, Between::Held)
    }
}

/// The times by which noise is told. Between distant rows differences hold the signals' own motion in any case, and what uneven times add to
/// it is about what predictions err by between them: there rows are taken for even.
fn noise_times_s(record: &Record) -> Vec<f64> {
    let even = |k: usize| record.quality.interval_s * k as f64;
    if record.has_distant_rows() { (0..record.len()).map(even).collect() } else { record.t_s.clone() }
}

fn estimate_noise(record: &mut Record, times_s: &[f64]) {
    let noise = |signal: &[f64]| {
        if signal.is_empty() {
            return ChannelNoise::default();
        }
        noise::estimate(record.stretches.iter().map(|s| (&times_s[s.range()], &signal[s.range()])))
    };
    let (position, pressure_a) = (noise(&record.y_m), noise(&record.p_a_pa));
    let (pressure_b, supply) = (noise(&record.p_b_pa), noise(&record.p_sup_pa));
    let quality = &mut record.quality;
    (quality.position, quality.pressure_a, quality.pressure_b, quality.supply) =
        (position, pressure_a, pressure_b, supply);
}

/// Smooths all signals; chamber pressures with the motion of the `plant`'s piston taken out.
fn smooth(record: &mut Record, plant: Option<&Plant<f64>>) {
    // Smoothing never reaches across an interruption or into the part held back.
    let pieces = split::pieces(&record.stretches, record.t_s.len());
    let interval_s = record.quality.interval_s;
    // Where the signal asks for it, shorter windows: for values alone, as the noise of a slope grows with shorter ones by far more.
    let volumes = Windows::new(record.volume_reach(), interval_s, parabola);
    let pressures = Windows::new(record.pressure_reach(), interval_s, twice);
    let chambers = [Side::A, Side::B].map(|side| {
        let (p_pa, noise_pa) = (record.chamber(side).p_pa, record.chamber(side).noise_pa);
        let by_position_pa = |plant: &Plant<f64>| {
            chamber_pressure::pa_per_m((plant, side), p_pa, &record.y_m) * record.quality.position.standard_deviation
        };
        let quiet = |plant: &&Plant<f64>| by_position_pa(plant) < constants::position_noise_in_pressure() * noise_pa;
        let tells_compression = !p_pa.is_empty() && !record.is_vented(side);
        (side, plant.filter(|_| tells_compression).filter(quiet))
    });
    // Position, its motion, the chambers' pressures and the supply's.
    let of_piece = |piece: &Range<usize>| {
        let (t_s, y_m) = (&record.t_s[piece.clone()], &record.y_m[piece.clone()]);
        let slow = |signal: &[f64], noise: ChannelNoise| {
            volumes.smooth(noise.standard_deviation, |_, reach| parabola(t_s, signal, reach))
        };
        let tells = chambers.iter().any(|(_, plant)| plant.is_some());
        let reaches = pressures.reaches().iter().filter(|_| tells);
        let twice_y: Vec<Vec<f64>> = reaches.map(|reach| twice(t_s, y_m, *reach).value).collect();
        let [p_a, p_b] = chambers.map(|(side, plant)| {
            let p_pa = record.chamber(side).p_pa.get(piece.clone())?;
            Some(pressures.smooth(record.chamber(side).noise_pa, |place, reach| match plant {
                Some(plant) => chamber_pressure::smoothed((plant, side), t_s, (p_pa, &twice_y[place]), reach),
                None => twice(t_s, p_pa, reach),
            }))
        });
        let p_sup = record.p_sup_pa.get(piece.clone()).map(|signal| slow(signal, record.quality.supply));
        let y = slow(y_m, record.quality.position);
        [Some(y), Some(parabola(t_s, y_m, record.velocity_reach())), p_a, p_b, p_sup].map(Option::unwrap_or_default)
    };
    let parts: Vec<[Smoothed; 5]> = pieces.par_iter().map(of_piece).collect();
    let mut all: [Smoothed; 5] = Default::default();
    for part in parts {
        for (to, from) in all.iter_mut().zip(part) {
            to.value.extend(from.value);
            to.slope.extend(from.slope);
        }
    }
    [record.y_smooth, record.motion, record.p_a_smooth, record.p_b_smooth, record.p_sup_smooth] = all;
}
