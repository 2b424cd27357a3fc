//! From the log's columns to a record: usable samples, uninterrupted stretches, the part held back, noise levels,
//! smoothed signals, masks.

use super::masks;
use super::noise::{self, ChannelNoise};
use super::quality::{Available, Quality};
use super::record::Record;
use super::smoothing::{Smoothed, parabola, slopes};
use super::split::{self, Stretch};
use crate::constants;
use core::ops::Range;
use plant_model::Plant;
use rig_files::{Log, RigFile};

/// Makes a log ready, for a rig as its file states it.
pub(crate) fn prepare(log: &Log, rig: &RigFile) -> Record {
    let columns = [&log.u_v, &log.p_a_pa, &log.p_b_pa, &log.p_sup_pa, &log.f_ext_n];
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
        p_b_pa: pick_optional(&log.p_b_pa),
        p_sup_pa: pick_optional(&log.p_sup_pa),
        f_ext_n: pick_optional(&log.f_ext_n),
        available: Available {
            command: log.u_v.is_some(),
            pressure_a: log.p_a_pa.is_some(),
            pressure_b: log.p_b_pa.is_some(),
            supply: log.p_sup_pa.is_some(),
            force: log.f_ext_n.is_some(),
        },
        ..Record::default()
    };
    record.quality.samples = record.t_s.len();
    record.quality.blank_rows = log.t_s.len() - usable.len();
    record.stretches = split::stretches(&record.t_s, &mut record.quality);
    estimate_noise(&mut record);
    smooth(&mut record);
    record.valve_known_s = masks::valve_known_s(&record);
    record.observer_rad_per_s = bandwidth_rad_per_s(&record.quality, rig);
    record.end_stops_m = masks::end_stops_m(&record, &rig.rig);
    [record.weight_a_per_pa, record.weight_b_per_pa] = masks::weights_per_pa(&record, rig);
    record.at_end = masks::at_end(&record, rig);
    record
}

/// A part of a recording with another position and other chamber pressures in the place of the measured ones.
pub(crate) fn replaced(record: &Record, range: Range<usize>, [y_m, p_a_pa, p_b_pa]: [Vec<f64>; 3]) -> Record {
    let part = |signal: &[f64]| if signal.is_empty() { Vec::new() } else { signal[range.clone()].to_vec() };
    let mut out = Record {
        t_s: part(&record.t_s),
        u_v: part(&record.u_v),
        f_ext_n: part(&record.f_ext_n),
        p_sup_pa: part(&record.p_sup_pa),
        y_m,
        p_a_pa,
        p_b_pa,
        stretches: vec![Stretch { start: 0, end: range.len(), held_back: true }],
        available: record.available,
        quality: record.quality.clone(),
        observer_rad_per_s: record.observer_rad_per_s,
        ..Record::default()
    };
    smooth(&mut out);
    out
}

fn estimate_noise(record: &mut Record) {
    let noise = |signal: &[f64]| {
        if signal.is_empty() {
            return ChannelNoise::default();
        }
        noise::estimate(record.stretches.iter().map(|s| &signal[s.range()]))
    };
    let (position, pressure_a) = (noise(&record.y_m), noise(&record.p_a_pa));
    let (pressure_b, supply) = (noise(&record.p_b_pa), noise(&record.p_sup_pa));
    let quality = &mut record.quality;
    (quality.position, quality.pressure_a, quality.pressure_b, quality.supply) =
        (position, pressure_a, pressure_b, supply);
}

fn smooth(record: &mut Record) {
    // Smoothing never reaches across an interruption or into the part held back.
    let pieces = split::pieces(&record.stretches, record.t_s.len());
    let smoothed = |signal: &[f64], reach: usize| {
        let mut out = Smoothed::default();
        if !signal.is_empty() {
            for piece in &pieces {
                parabola(&record.t_s[piece.clone()], &signal[piece.clone()], reach, &mut out);
            }
        }
        out
    };
    let (y_smooth, motion) =
        (smoothed(&record.y_m, constants::volume_reach()), smoothed(&record.y_m, constants::velocity_reach()));
    // The slope is the derivative of the smoothed pressure itself, so that p + tau p' undoes a lag without a bias.
    let twice = |signal: &[f64]| {
        let value = smoothed(&smoothed(signal, constants::pressure_reach()).value, constants::pressure_reach()).value;
        let slope = pieces.iter().flat_map(|piece| slopes(&record.t_s, &value, piece.clone())).collect();
        Smoothed { value, slope }
    };
    let both = [&record.p_a_pa, &record.p_b_pa].map(|p| if p.is_empty() { Smoothed::default() } else { twice(p) });
    let [p_a, p_b] = both;
    let p_sup = smoothed(&record.p_sup_pa, constants::volume_reach());
    (record.y_smooth, record.motion, record.p_a_smooth, record.p_b_smooth, record.p_sup_smooth) =
        (y_smooth, motion, p_a, p_b, p_sup);
}

/// Bandwidth of the position observer, rad/s: where sensor noise and force noise contribute equally, for the rig as its
/// file states it. It is the same for all hypotheses: otherwise one with a larger mass would follow the measurement
/// less and seem noisier.
fn bandwidth_rad_per_s(quality: &Quality, rig: &RigFile) -> f64 {
    let mass_kg = Plant::new(&rig.rig, &rig.effects).map_or(rig.rig.load.mass_kg, |plant| plant.coefficients().mass_kg);
    let pressure = quality.pressure_a.standard_deviation.hypot(quality.pressure_b.standard_deviation).max(50.0);
    let acceleration = rig.rig.cylinder.mean_area_m2() * pressure / mass_kg;
    let position = quality.position.standard_deviation.max(1.0e-6);
    (acceleration / position).sqrt().clamp(15.0, 80.0)
}
