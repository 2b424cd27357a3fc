//! How fast the observer of the position is, and what noise its innovations have: both follow from the sensors' noise.

use super::quality::Quality;
use super::record::Creeping;
use super::record::Record;
use super::smoothing::{Reach, twice};
use crate::constants;
use plant_model::Plant;
use rig_files::RigFile;

/// How far the noise of the pressures accelerates the piston of the rig as its file states it, in units of the position sensor's
/// noise, 1/s2.
pub(super) fn force_noise_per_s2(quality: &Quality, rig: &RigFile) -> f64 {
    let mass_kg = Plant::new(&rig.rig, &rig.effects).map_or(rig.rig.load.mass_kg, |plant| plant.coefficients().mass_kg);
    let pressure = quality.pressure_a.standard_deviation.hypot(quality.pressure_b.standard_deviation).max(50.0);
    rig.rig.cylinder.mean_area_m2() * pressure / mass_kg / quality.position.standard_deviation.max(1.0e-6)
}

/// Where friction of the rig as its file states it falls with speed: `g = F_c + (F_s - F_c) exp(-(v/v_s)^2)` (3.11) falls the most, by
/// `sqrt(2/e) (F_s - F_c) / v_s`, at `v_s / sqrt(2)`.
pub(super) fn creeping(rig: &RigFile) -> Creeping {
    let Ok(plant) = Plant::new(&rig.rig, &rig.effects) else { return Creeping::default() };
    let c = plant.coefficients();
    let steepest = (2.0 / core::f64::consts::E).sqrt() * (c.static_n - c.coulomb_n) / c.stribeck_velocity_m_per_s;
    Creeping {
        runs_away_per_s: ((steepest - c.viscous) / c.mass_kg).max(0.0),
        fastest_m_per_s: constants::sliding() * c.stribeck_velocity_m_per_s,
    }
}

/// Bandwidth of the position observer, rad/s: that of the Kalman filter of a mass under white noise of its force and its sensor, as
/// far as the rows are close enough. It is the same for all hypotheses: otherwise one with a larger mass would follow the
/// measurement less and seem noisier.
pub(super) fn bandwidth_rad_per_s(quality: &Quality, force_noise_per_s2: f64) -> f64 {
    let fastest = constants::observer_step() / quality.interval_s.max(1.0e-6);
    force_noise_per_s2.sqrt().max(constants::slowest_observer()).min(fastest)
}

/// How the noise of one row's pressures changes the piston's velocity row by row, in units of the position sensor's noise per row:
/// `force` in all, spread over the rows that smoothing spreads it over. A bandwidth of `sqrt(force)`, times the interval, takes that up
/// but for some percent, less where the piston rests; so what is beyond it counts.
pub(super) fn pushed(w: f64, force: f64, record: &Record) -> Vec<f64> {
    let beyond = (force * force - w.powi(4)).max(0.0).sqrt();
    if beyond == 0.0 {
        return Vec::new();
    }
    let rows = |reach: Reach| (reach.seconds / record.step_s).ceil() as usize;
    let middle = 2 * rows(record.pressure_reach()) + 1;
    let mut one = vec![0.0; 2 * middle + 1];
    one[middle] = beyond;
    let t_s: Vec<f64> = (0..one.len()).map(|k| record.step_s * k as f64).collect();
    twice(&t_s, &one, record.pressure_reach()).value
}

/// Standard deviation of the position observer's innovations, so many averaged into one and scaled as white noise is,
/// when all that it sees is white noise of its sensor, of one, and noise of the force, of which that of a row changes the
/// velocity as `pushed` says; no less than one. `w` is its bandwidth times the interval.
pub(super) fn observer_noise(w: f64, pushed: &[f64], averaged: usize) -> f64 {
    let (by_position, by_velocity) = ((core::f64::consts::SQRT_2 * w).min(0.5), w * w);
    // The variance is the sum of the squared response to one sample of noise, which dies away within a few 1 / w.
    let variance = |sensed: f64, pushed: &[f64]| {
        let (mut y, mut v) = (0.0, 0.0);
        let mut response = vec![0.0; averaged - 1];
        for k in 0..pushed.len() + (20.0 / w.clamp(0.01, 1.0)) as usize {
            let e = if k == 0 { sensed } else { 0.0 } - y;
            response.push(e);
            v += by_velocity * e + pushed.get(k).copied().unwrap_or(0.0);
            y += by_position * e + v;
        }
        let sums = response.windows(averaged).map(|e| e.iter().sum::<f64>());
        sums.map(|sum| sum * sum).sum::<f64>() / averaged as f64
    };
    (variance(1.0, &[]) + variance(0.0, pushed)).sqrt().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_observer_that_follows_its_sensor_adds_to_the_noise_unless_neighbours_are_averaged() {
        for (w, averaged, variance) in [(0.05, 4, 1.0), (0.08, 1, 1.092), (0.16, 2, 1.113), (0.5, 1, 1.818)] {
            let found = observer_noise(w, &[], averaged).powi(2);
            assert!((found - variance).abs() < 0.005, "{w} {averaged}: {found}");
        }
    }

    #[test]
    fn an_observer_slower_than_its_force_s_noise_asks_shows_that_noise() {
        // Of the continuous observer: the force's density over 2 sqrt(2) w^3.
        for (w, times) in [(0.02, 3.0), (0.05, 2.0), (0.1, 4.0)] {
            let [with, without] = [&[times * w * w][..], &[]].map(|pushed| observer_noise(w, pushed, 1).powi(2));
            let continuous = times * times * w / 8.0_f64.sqrt();
            assert!(((with - without) / continuous - 1.0).abs() < 0.2, "{w}: {} of {continuous}", with - without);
        }
    }

    #[test]
    fn only_force_noise_beyond_the_bandwidth_counts_and_smoothing_spreads_it() {
        let mut record = Record { step_s: 5.0e-3, ..Record::default() };
        record.quality.interval_s = record.step_s;
        assert!(pushed(0.3, 0.09, &record).is_empty() && pushed(0.3, 0.01, &record).is_empty());
        let spread = pushed(0.3, 0.5, &record);
        let beyond = (0.25 - 0.0081_f64).sqrt();
        assert!((spread.iter().sum::<f64>() - beyond).abs() < 1.0e-9, "smoothing keeps the sum: {spread:?}");
        assert!(spread.iter().all(|part| part.abs() < 0.6 * beyond), "{spread:?}");
    }
}
