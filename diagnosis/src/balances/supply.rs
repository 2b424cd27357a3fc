//! The supply pressure at the valve: as measured; else as the model says, constant or drooping with the flow drawn.

use super::judged::judged;
use super::opening::Openings;
use crate::data::record::Record;
use crate::data::split::{Stretch, interrupted};
use core::f64::consts::FRAC_PI_2;
use plant_model::{Plant, Side};

/// Supply pressure by sample, Pa absolute.
pub(crate) struct SupplyPressure {
    /// What the chambers are fed with: the smoothed measurement if there is one, else the prediction.
    pub(crate) at_valve: Vec<f64>,
    /// The model's prediction.
    pub(crate) predicted: Vec<f64>,
}

/// Supply pressure at every sample, with what its sensor shows too much. The flow drawn is computed with the chamber
/// pressures as measured.
pub(crate) fn pressures(record: &Record, plant: &Plant<f64>, openings: &Openings, sensor_pa: f64) -> SupplyPressure {
    let c = plant.coefficients();
    let droop = plant.added().supply_droop;
    let measured = record.available.supply;
    let mut predicted = vec![c.supply_pa; record.len()];
    if droop.droop_pa_s_per_kg > 0.0 {
        let mut p = c.supply_pa;
        for (k, predicted) in predicted.iter_mut().enumerate() {
            let filled = if openings.of(Side::B)[k] >= 0.0 { Side::A } else { Side::B };
            let smooth = record.chamber(filled).smooth;
            let chamber = smooth.value.get(k).map(|value| plant.true_pressure_pa(filled, *value, smooth.slope[k]));
            let drawn = |opening: f64, p: f64| {
                let flow =
                    |chamber| plant.orifices(filled).inflow(true, opening, chamber, p, c.atmosphere_pa).mass_flow;
                chamber.map_or(0.0, flow)
            };
            // At the beginning and after an interruption the droop is unknown: the prediction starts from the measurement, if any,
            // but lost no more than the valve draws when it is open: without a droop nothing.
            let anew = k == 0 || interrupted(&record.t_s, k, record.quality.interval_s);
            if let Some(sensed) = record.p_sup_smooth.value.get(k).filter(|_| anew) {
                let most = droop.settled_pa(c.supply_pa, drawn(FRAC_PI_2, c.supply_pa));
                p = (*sensed - sensor_pa).max(most).min(c.supply_pa);
            }
            *predicted = p;
            let drawn = drawn(openings.of(filled)[k].abs(), p);
            let settled = droop.settled_pa(c.supply_pa, drawn);
            p = settled + (p - settled) * (-record.interval_s(k) / droop.time_constant_s).exp();
            p = p.max(c.atmosphere_pa);
        }
    }
    let truly = |shown: &f64| shown - sensor_pa;
    let at_valve = if measured { record.p_sup_smooth.value.iter().map(truly).collect() } else { predicted.clone() };
    SupplyPressure { at_valve, predicted }
}

/// Measured minus predicted supply pressure in units of its noise and of what is not known of the flow drawn; second, the sum of the
/// logarithms of those units over the noise.
pub(crate) fn innovations(
    record: &Record,
    plant: &Plant<f64>,
    stretches: &[Stretch],
    predicted: &[f64],
    sensor_pa: f64,
) -> (Vec<f64>, f64) {
    let sigma = record.quality.supply.standard_deviation.max(1.0);
    let error = |k: usize| (record.p_sup_pa[k] - sensor_pa - predicted[k]) / sigma;
    let droop = plant.added().supply_droop;
    let droops = droop.droop_pa_s_per_kg > 0.0;
    if !droops || record.doubt_drawn_kg_per_s.is_empty() {
        return (record.rows_of(stretches).map(|k| judged(error(k))).collect(), 0.0);
    }
    // A Kalman filter of what the prediction is off by, with its variance in units of the noise's: it decays as a droop does, and what
    // is not known of the flow adds to it.
    let (mut off, mut variance, mut log_widths) = (0.0, 0.0, 0.0);
    let left_after = |interval_s: f64| (-interval_s / droop.time_constant_s).exp();
    let rows: Vec<usize> = record.rows_of(stretches).collect();
    let mut out = Vec::with_capacity(rows.len());
    for (place, k) in rows.iter().copied().enumerate() {
        let (error, width) = (error(k) - off, 1.0 + variance);
        out.push(judged(error / f64::sqrt(width)));
        if error.is_finite() {
            log_widths += 0.5 * f64::ln(width);
            off += variance / width * error;
            variance /= width;
        }
        let interval_s = record.to_next_row_s(k);
        let kept = left_after(interval_s);
        let grows = droop.droop_pa_s_per_kg * record.doubt_drawn_kg_per_s[k] * (1.0 - kept) / sigma;
        // Between two stretches it goes on without being seen.
        let left = left_after(rows.get(place + 1).map_or(interval_s, |next| record.t_s[*next] - record.t_s[k]));
        let intervals = if kept < 1.0 { (1.0 - left * left) / (1.0 - kept.powi(2)) } else { 0.0 };
        off *= left;
        variance = left * left * variance + grows * grows * intervals;
    }
    (out, log_widths)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::between::doubts;
    use crate::balances::opening::openings;
    use crate::balances::simulated::{add_noise, every_other, simulated, with_supply};
    use crate::data::grid::{Between, refined};
    use crate::data::prepare::prepare;
    use plant_model::{Effect, Effects};
    use rig_files::RigFile;

    #[test]
    fn what_is_not_known_of_the_command_between_rows_is_no_error_of_a_drooping_supply() {
        let file = RigFile::paper_c();
        let effects = Effects::none().with(Effect::SupplyDroop, &[3.0e7, 0.1]);
        // Another value every seven milliseconds, of which every other comes between two rows.
        let staircase = |t_s: f64| (31.0 * (t_s / 7.0e-3 + 1.0e-6).floor()).sin();
        let mut log = with_supply(&file, &effects, 8001, |t_s| 2.0 * (9.0 * t_s).sin() + staircase(t_s));
        add_noise(&mut log, 5.0e-6, 100.0);
        let plant = Plant::new(&file.rig, &effects).expect("a sound rig");
        let mut record = refined(prepare(&every_other(&log), &file), Between::Held);
        let misfit = |record: &Record| {
            let predicted = pressures(record, &plant, &openings(record, &plant), 0.0).predicted;
            let (errors, log_widths) = innovations(record, &plant, &record.stretches, &predicted, 0.0);
            (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64, log_widths)
        };
        let held = misfit(&record);
        doubts(&mut record, &plant, 1.0);
        let moved = misfit(&record);
        assert!(held.0 > 2.0 && held.1 == 0.0, "{held:?}");
        assert!(moved.0 < 0.6 * held.0 && moved.0 > 0.8 && moved.1 > 0.0, "{moved:?}");
    }

    /// The prediction with a droop, of a log whose supply stands 10 kPa below the stated pressure when it begins.
    fn predicted(droop_pa_s_per_kg: f64) -> Vec<f64> {
        let file = RigFile::paper_a();
        let mut log = simulated(&file, &Effects::none(), 500, |t_s| 2.0 * (20.0 * t_s).sin());
        log.p_sup_pa = Some(vec![file.rig.supply.pressure_pa - 1.0e4; 500]);
        let record = prepare(&log, &file);
        let effects = Effects::none().with(Effect::SupplyDroop, &[droop_pa_s_per_kg, 0.2]);
        let plant = Plant::new(&file.rig, &effects).expect("a sound rig");
        pressures(&record, &plant, &openings(&record, &plant), 0.0).predicted
    }

    #[test]
    fn a_droop_of_next_to_nothing_changes_next_to_nothing_wherever_the_log_begins() {
        let [none, little, plain] = [0.0, 1.0, 3.0e7].map(predicted);
        let most = |of: &[f64]| of.iter().zip(&none).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max);
        assert!(most(&little) < 0.1, "{}", most(&little));
        // A droop that can have taken as much begins where the sensor is.
        assert!((plain[0] - none[0] + 1.0e4).abs() < 100.0 && most(&plain) > 1.0e4, "{} {}", plain[0], most(&plain));
    }
}
