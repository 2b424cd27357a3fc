//! The supply pressure at the valve: as measured; else as the model says, constant or drooping with the flow drawn.

use super::judged::judged;
use super::opening::Openings;
use crate::data::record::Record;
use crate::data::split::{Stretch, interrupted};
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
            // At the beginning and after an interruption the droop is unknown: the prediction starts from the
            // measurement, if any.
            let anew = k == 0 || interrupted(&record.t_s, k, record.quality.interval_s);
            if let Some(sensed) = record.p_sup_smooth.value.get(k).filter(|_| anew) {
                p = *sensed - sensor_pa;
            }
            *predicted = p;
            let filled = if openings.of(Side::B)[k] >= 0.0 { Side::A } else { Side::B };
            let smooth = record.chamber(filled).smooth;
            let chamber = smooth.value.get(k).map(|value| plant.true_pressure_pa(filled, *value, smooth.slope[k]));
            let drawn = match chamber {
                Some(chamber) => {
                    let opening = openings.of(filled)[k].abs();
                    plant.orifices(filled).inflow(true, opening, chamber, p, c.atmosphere_pa).mass_flow
                }
                None => 0.0,
            };
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
