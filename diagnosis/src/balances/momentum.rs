//! The force balance as an equation error, `m dv = F dt` over windows of sliding: smooth in all parameters, and blind to breakaways.

use super::force::{Forces, Timing, added_at, driving};
use super::judged::judged;
use super::piston::at_rest_ahead_m_per_s;
use crate::constants;
use crate::data::record::Record;
use crate::data::split::{Stretch, samples};
use plant_model::{Plant, State};

/// Errors of the momentum balance over windows in which the piston slides one way, in units of the sensor's noise: an equation
/// error by modulating functions (Shinbrot 1957), smooth in all parameters, where the prediction of the position steps with
/// every breakaway. NaN where the piston does not slide. Each window's error is spread over its rows, so that their squares add
/// up to its own.
///
/// Viscous friction takes the way under the weight, not the smoothed velocity: that cuts peaks by 20 mm/s in a short stroke,
/// which is as much force as an offset of a pressure sensor.
pub(crate) fn momentum(
    record: &Record,
    plant: &Plant<f64>,
    forces: &Forces,
    added_n: &[f64],
    stretches: &[Stretch],
) -> Vec<f64> {
    let lag = plant.added().position_lag;
    let slides = 2.0 * at_rest_ahead_m_per_s(record, &lag);
    let sigma = record.quality.position.standard_deviation.max(constants::numerical_error_m());
    let timing = Timing::of(plant);
    let zero = plant.true_position_m(0.0);
    let c = plant.coefficients();
    let half = (0.5 * constants::sliding_window_s() / record.step_s.max(1.0e-6)).round().max(4.0) as usize;
    let mut out = Vec::with_capacity(samples(stretches));
    let mut places = 0;
    for stretch in stretches {
        let first = places;
        places += stretch.range().len();
        // The force that accelerates a sliding piston, N; NaN at rest or at an end.
        let force_n = |k: usize| {
            let shown = record.motion_ahead(k, &lag);
            if record.at_end[k] || shown[1].abs() < slides {
                return f64::NAN;
            }
            let added = added_at(record, &timing, added_n, stretch, k);
            let drive = driving(plant, forces, first + k - stretch.start, shown, added);
            let v = plant.true_position_m(shown[1]) - zero;
            let (p_a_pa, p_b_pa) = (drive.p_a_pa, drive.p_b_pa);
            let state =
                State { y_m: plant.true_position_m(shown[0]), v_m_per_s: v, p_a_pa, p_b_pa, ..State::default() };
            drive.force_n - plant.friction_level(&state).force_n * v.signum()
        };
        let force: Vec<f64> = stretch.range().map(force_n).collect();
        let mut start = stretch.start;
        while start < stretch.end {
            let next = (start + half).min(stretch.end);
            let end = start + 2 * half;
            let rows = record.rows_in(start..next).len();
            let within = |k: usize| k - stretch.start;
            let error = if end < stretch.end
                && force[within(start)..=within(end)].iter().all(|f| !f.is_nan())
                && (start..=end).all(|k| record.motion.slope[k] * record.motion.slope[start] > 0.0)
            {
                let (t0, duration) = (record.t_s[start], record.t_s[end] - record.t_s[start]);
                let rate = core::f64::consts::TAU / duration;
                let (mut impulse, mut gained, mut way, mut noise) = (0.0, 0.0, 0.0, 0.0);
                let line = (record.y_m[end] - record.y_m[start]) / duration;
                for k in start..=end {
                    let since = record.t_s[k] - t0;
                    let dt = 0.5 * (record.t_s[(k + 1).min(end)] - record.t_s[k.saturating_sub(1).max(start)]);
                    let cosine = (rate * since).cos();
                    impulse += 0.5 * (1.0 - cosine) * force[within(k)] * dt;
                    // A lag is undone in the signal, `y = y_m + tau y_m'`: by parts, one more derivative of the weight.
                    let sine = (rate * since).sin();
                    let curved = 0.5 * rate * rate * (cosine + lag.time_constant_s * rate * sine) * dt;
                    let off_line = record.y_m[k] - record.y_m[start] - line * since;
                    gained += curved * off_line;
                    way += (0.5 * (1.0 - cosine) * line
                        - 0.5 * rate * (sine - lag.time_constant_s * rate * cosine) * off_line)
                        * dt;
                    noise += curved * curved;
                }
                let gained = plant.true_position_m(gained) - zero;
                let impulse = impulse - c.viscous * (plant.true_position_m(way) - zero);
                judged((gained - impulse / c.mass_kg) / (sigma * noise.sqrt())) / (rows.max(1) as f64).sqrt()
            } else {
                f64::NAN
            };
            out.extend((0..rows).map(|_| error));
            start = next;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::force::forces;
    use crate::balances::simulated::simulated;
    use crate::data::prepare::prepare;
    use rig_files::RigFile;

    #[test]
    fn the_momentum_of_a_sliding_piston_tells_friction_and_mass_and_sees_no_breakaway() {
        let file = RigFile::paper_a();
        let log = simulated(&file, &file.effects, 8000, |t_s| 0.9 * (2.0 * t_s).sin() + 0.8 * (11.0 * t_s).sin());
        let record = prepare(&log, &file);
        let cost = |change: &dyn Fn(&mut RigFile)| {
            let mut file = file.clone();
            change(&mut file);
            let plant = Plant::new(&file.rig, &file.effects).expect("a sound rig");
            let forces = forces(&record, &Timing::of(&plant), &record.stretches);
            let errors = momentum(&record, &plant, &forces, &[], &record.stretches);
            assert_eq!(errors.len(), record.len());
            let judged: Vec<f64> = errors.into_iter().filter(|e| !e.is_nan()).collect();
            assert!(judged.len() > 1000, "{}", judged.len());
            judged.iter().map(|e| e * e).sum::<f64>()
        };
        let right = cost(&|_| {});
        for (what, wrong) in [
            ("Coulomb friction", cost(&|file| file.rig.friction.coulomb_n *= 0.9)),
            ("viscous friction", cost(&|file| file.rig.friction.viscous_n_s_per_m *= 0.9)),
            ("mass", cost(&|file| file.rig.load.mass_kg *= 1.1)),
        ] {
            assert!(wrong > 5.0 * right, "{what}: {wrong} {right}");
        }
    }
}
