//! Wavelengths at which the friction residual ripples along the stroke: initial values for periodic friction.

use crate::constants;
use crate::data::channel::Channel;
use crate::estimate::problem::{Fit, Problem};

/// The wavelengths in m at which the odd part of the force residual is strongest; empty if the piston hardly moves.
pub(crate) fn wavelengths(problem: &Problem<'_>, fit: &Fit) -> Vec<f64> {
    let record = problem.record;
    let Some(innovations) = problem.innovations(fit) else { return Vec::new() };
    let e = &innovations.channels[Channel::Position as usize];
    if e.is_empty() {
        return Vec::new();
    }
    let moving = 5.0 * record.velocity_error_m_per_s();
    let (low, high) = record.y_m.iter().fold((f64::MAX, f64::MIN), |(a, b), y| (a.min(*y), b.max(*y)));
    let range = high - low;
    if range < 50.0 * record.quality.position.standard_deviation {
        return Vec::new();
    }
    let mut sums = vec![(0.0f64, 0.0f64); constants::ripple_places()];
    for (k, e) in record.rows_of(&problem.stretches).zip(e) {
        let v = record.motion.slope[k];
        if v.abs() > moving && !e.is_nan() {
            let y = record.y_smooth.value[k];
            let place =
                (((y - low) / range * constants::ripple_places() as f64) as usize).min(constants::ripple_places() - 1);
            sums[place].0 += (-e * v.signum()).clamp(-10.0, 10.0);
            sums[place].1 += 1.0;
        }
    }
    let total = sums.iter().fold((0.0, 0.0), |a, s| (a.0 + s.0, a.1 + s.1));
    if total.1 < 100.0 {
        return Vec::new();
    }
    let mean = total.0 / total.1;
    // The ripple belongs to the true position.
    let Some(plant) = fit.hypothesis.plant(problem.rig, &fit.hypothesis.values) else { return Vec::new() };
    let scale = plant.shown_position_m(1.0) - plant.shown_position_m(0.0);
    // The effect is a sine with its zero at mid-stroke, so only that phase is fitted.
    let middle = |place: usize| low + (place as f64 + 0.5) / constants::ripple_places() as f64 * range;
    let count = (constants::ripple_places() as f64 / constants::ripple_shortest() * 4.0) as usize;
    let mut spectrum: Vec<(f64, f64)> = (2..count)
        .map(|quarter| {
            let wave = core::f64::consts::TAU * quarter as f64 * 0.25 / range;
            let (mut projection, mut square) = (0.0, 1.0e-9);
            for (place, (sum, n)) in sums.iter().enumerate() {
                let s = (wave * middle(place)).sin();
                projection += s * (sum - mean * n);
                square += s * s * n;
            }
            (projection * projection / square, core::f64::consts::TAU / wave)
        })
        .collect();
    spectrum.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut out: Vec<f64> = Vec::new();
    for (_, wavelength) in spectrum {
        // Neighbours in the spectrum are the same ripple.
        if out.iter().all(|w| (1.0 / (w * scale) - 1.0 / wavelength).abs() > 1.0 / range) {
            out.push(wavelength / scale);
        }
        if out.len() == constants::ripple_strongest() {
            break;
        }
    }
    out
}
