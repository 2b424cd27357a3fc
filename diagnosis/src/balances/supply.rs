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

/// Measured minus predicted supply pressure in units of its noise.
pub(crate) fn innovations(record: &Record, stretches: &[Stretch], predicted: &[f64], sensor_pa: f64) -> Vec<f64> {
    let sigma = record.quality.supply.standard_deviation.max(1.0);
    record.rows_of(stretches).map(|k| judged((record.p_sup_pa[k] - sensor_pa - predicted[k]) / sigma)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::opening::openings;
    use crate::balances::simulated::simulated;
    use crate::data::prepare::prepare;
    use plant_model::{Effect, Effects};
    use rig_files::RigFile;

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
