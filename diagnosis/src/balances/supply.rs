//! The supply pressure at the valve: as measured; else as the model says, constant or drooping with the flow drawn.

use super::drift::{Drift, Pace, drift};
use super::judged::judged;
use super::opening::Openings;
use crate::constants;
use crate::data::record::Record;
use crate::data::split::{Stretch, interrupted};
use core::f64::consts::FRAC_PI_2;
use plant_model::{Plant, Side};

/// A droop that takes up to a third of a second has settled within this time, s; a log is some twenty times as long.
const BEGINNING_S: f64 = 1.0;

/// Supply pressure by sample, Pa absolute.
pub(crate) struct SupplyPressure {
    /// What the chambers are fed with: the smoothed measurement if there is one, else the prediction.
    pub(crate) at_valve: Vec<f64>,
    /// The model's prediction.
    pub(crate) predicted: Vec<f64>,
}

/// Supply pressure at every sample, with what its sensor shows too much. The flow drawn is computed with the pressures as measured.
pub(crate) fn pressures(record: &Record, plant: &Plant<f64>, openings: &Openings, sensor_pa: f64) -> SupplyPressure {
    let measured = record.available.supply;
    let predicted = if plant.added().supply_droop.droop_pa_s_per_kg > 0.0 {
        drooping(record, plant, openings, sensor_pa)
    } else {
        vec![plant.coefficients().supply_pa; record.len()]
    };
    let truly = |shown: &f64| shown - sensor_pa;
    let at_valve = if measured { record.p_sup_smooth.value.iter().map(truly).collect() } else { predicted.clone() };
    SupplyPressure { at_valve, predicted }
}

/// The prediction of a supply that droops, given what its sensor shows too much in Pa.
fn drooping(record: &Record, plant: &Plant<f64>, openings: &Openings, sensor_pa: f64) -> Vec<f64> {
    let (c, droop) = (plant.coefficients(), plant.added().supply_droop);
    let mut p = c.supply_pa;
    // By how much the sensor is above the prediction: the drift.
    let mut drifted_pa = 0.0;
    let sample = |k: usize| {
        let drawn = |side: Side, opening: f64, p: f64| {
            let smooth = record.chamber(side).smooth;
            let flow = |chamber| plant.orifices(side).inflow(true, opening, chamber, p, c.atmosphere_pa).mass_flow;
            let chamber = || {
                let shown = smooth.value.get(k)?;
                Some(plant.true_pressure_pa(side, *shown, smooth.slope[k]))
            };
            chamber().map_or(0.0, flow)
        };
        // Behind hoses of different lengths both may be filled at a time.
        let [into_a, into_b] = [openings.of(Side::A)[k], -openings.of(Side::B)[k]];
        let sensed = record.p_sup_smooth.value.get(k).map(|sensed| sensed - sensor_pa);
        // At the beginning and after an interruption the droop is unknown: the prediction starts from the measurement, if any, less the drift
        // as known from before, but lost no more than the valve draws when it is open: without a droop nothing.
        let anew = k == 0 || interrupted(&record.t_s, k, record.quality.interval_s);
        if let Some(sensed) = sensed.filter(|_| anew) {
            let filled = if into_b <= 0.0 { Side::A } else { Side::B };
            let most = droop.settled_pa(c.supply_pa, drawn(filled, FRAC_PI_2, c.supply_pa));
            p = (sensed - drifted_pa).max(most).min(c.supply_pa);
        }
        let predicted = p;
        drifted_pa = sensed.map_or(0.0, |sensed| sensed - p);
        // What is drawn is driven by the pressure as it is, drift and all.
        let source_pa = sensed.filter(|p| p.is_finite()).unwrap_or(p);
        let into = |side: Side, opening: f64| if opening > 0.0 { drawn(side, opening, source_pa) } else { 0.0 };
        let drawn = into(Side::A, into_a) + into(Side::B, into_b);
        let settled = droop.settled_pa(c.supply_pa, drawn);
        p = settled + (p - settled) * (-record.interval_s(k) / droop.time_constant_s).exp();
        p = p.max(c.atmosphere_pa);
        predicted
    };
    (0..record.len()).map(sample).collect()
}

/// Standard deviation of the sensor's noise, Pa.
fn sigma_pa(record: &Record) -> f64 {
    record.quality.supply.standard_deviation.max(1.0)
}

/// What a prediction is off by at each sample, in Pa, NaN where that is not known; and its slow drift. Where the log begins a drift passes
/// for a droop until that has settled.
pub(crate) fn drifting(record: &Record, plant: &Plant<f64>, supply: (&[f64], f64)) -> (Vec<f64>, Drift) {
    drifting_at(record, plant, supply, Pace::SLOW)
}

/// The same with a drift that may be faster.
fn drifting_at(
    record: &Record,
    plant: &Plant<f64>,
    (predicted, sensor_pa): (&[f64], f64),
    pace: Pace,
) -> (Vec<f64>, Drift) {
    let known_s = record.t_s.first().map_or(0.0, |first| first + BEGINNING_S);
    let mut off_pa = vec![f64::NAN; record.len()];
    for k in record.rows_of(&record.stretches).filter(|k| record.t_s[*k] >= known_s) {
        off_pa[k] = judged(record.p_sup_pa[k] - sensor_pa - predicted[k]);
    }
    let usual_pa = constants::regulator() * plant.coefficients().supply_pa;
    let fitted = record.stretches.iter().filter(|stretch| !stretch.held_back).map(Stretch::range);
    let drift = drift((&record.t_s, &off_pa), fitted, [sigma_pa(record), usual_pa], pace);
    (off_pa, drift)
}

/// What is left of a measured supply that varies by itself, in units of its noise: beside a drift as fast as vessel and compressor make it.
/// What it follows has no time for a flow that comes and goes within a second.
pub(crate) fn beside_fast_drift(
    record: &Record,
    plant: &Plant<f64>,
    stretches: &[Stretch],
    sensor_pa: f64,
) -> Vec<f64> {
    let predicted = vec![plant.coefficients().supply_pa; record.len()];
    let (off_pa, drift) = drifting_at(record, plant, (&predicted, sensor_pa), Pace::FAST);
    record.rows_of(stretches).map(|k| told(off_pa[k], (off_pa[k] - drift.off_pa[k]) / sigma_pa(record))).collect()
}

/// An error in units of its noise; NaN where it is not known by how much the prediction is off.
fn told(off_pa: f64, error: f64) -> f64 {
    if off_pa.is_nan() { f64::NAN } else { judged(error) }
}

/// Measured minus predicted supply pressure, less a slow [drift](super::drift), in units of its noise and of what is not known of the flow
/// drawn; second, what it costs that errors may be larger: the sum of the logarithms of those units over the noise, and the drift's size.
pub(crate) fn innovations(
    record: &Record,
    plant: &Plant<f64>,
    stretches: &[Stretch],
    predicted: &[f64],
    sensor_pa: f64,
) -> (Vec<f64>, f64) {
    let sigma = sigma_pa(record);
    let (off_pa, drift) = drifting(record, plant, (predicted, sensor_pa));
    let error = |k: usize| (off_pa[k] - drift.off_pa[k]) / sigma;
    // A prior is no sum over rows, which averages of neighbours shorten.
    let drifted = drift.cost * record.averaged() as f64;
    let droop = plant.added().supply_droop;
    let droops = droop.droop_pa_s_per_kg > 0.0;
    if !droops || record.doubt_drawn_kg_per_s.is_empty() {
        return (record.rows_of(stretches).map(|k| told(off_pa[k], error(k))).collect(), drifted);
    }
    // A Kalman filter of what the prediction is off by, with its variance in units of the noise's: it decays as a droop does, and what
    // is not known of the flow adds to it.
    let (mut off, mut variance, mut log_widths) = (0.0, 0.0, drifted);
    let left_after = |interval_s: f64| (-interval_s / droop.time_constant_s).exp();
    let rows: Vec<usize> = record.rows_of(stretches).collect();
    let mut out = Vec::with_capacity(rows.len());
    for (place, k) in rows.iter().copied().enumerate() {
        let (error, width) = (error(k) - off, 1.0 + variance);
        out.push(told(off_pa[k], error / f64::sqrt(width)));
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
    use crate::balances::simulated::{add_noise, every_other, simulated, with_drift, with_supply};
    use crate::data::grid::{Between, refined};
    use crate::data::prepare::prepare;
    use crate::diagnose::diagnose;
    use crate::outcome::Balance;
    use plant_model::{Effect, Effects};
    use rig_files::{RigFile, Verdict};

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
            let told: Vec<f64> = errors.into_iter().filter(|error| !error.is_nan()).collect();
            (told.iter().map(|error| error * error).sum::<f64>() / told.len() as f64, log_widths)
        };
        let held = misfit(&record);
        doubts(&mut record, &plant, 1.0);
        let moved = misfit(&record);
        assert!(held.0 > 2.0 && held.1 < 0.1, "{held:?}");
        assert!(moved.0 < 0.6 * held.0 && moved.0 > 0.8 && moved.1 > 1.0, "{moved:?}");
    }

    #[test]
    fn a_supply_that_varies_by_itself_is_no_gap_and_hides_no_droop() {
        let file = RigFile::paper_a();
        let droop = Effects::none().with(Effect::SupplyDroop, &[1.0e7, 0.15]);
        // One part in a hundred, twice a minute; or a vessel that empties and is filled again within six seconds.
        let slowly = |t_s: f64| 7.0e3 * (0.2 * t_s).sin();
        let in_turns = |t_s: f64| 2.0e3 * (t_s % 6.0).min(30.0 - 5.0 * (t_s % 6.0));
        let supplies: [(_, _, &dyn Fn(f64) -> f64); 3] = [
            (Effects::none(), None, &slowly),
            (droop, Some("supply-droop"), &slowly),
            (Effects::none(), None, &in_turns),
        ];
        for (effects, name, drift_pa) in supplies {
            let at = |t_s: f64| (0.8 * (3.0 * t_s).sin() + 0.6 * (11.0 * t_s).sin(), drift_pa(t_s));
            let mut log = with_drift(&file, &effects, 16_000, at);
            add_noise(&mut log, 2.0e-5, 300.0);
            let found = diagnose(&file, &log, &|_| {}).expect("a full log");
            let named: Vec<&str> = found.causes.iter().map(|cause| cause.id.as_str()).collect();
            assert_eq!(
                named,
                name.into_iter().collect::<Vec<_>>(),
                "{:?} {:?}",
                found.leads,
                found.balances.iter().map(|b| b.extended_misfit).collect::<Vec<_>>()
            );
            assert_eq!(found.verdict, if name.is_some() { Verdict::Explained } else { Verdict::NoGap });
            let is_fast = drift_pa(5.0) > slowly(5.0);
            assert_eq!(found.balances.iter().any(Balance::varies_by_itself), is_fast);
            for estimate in found.causes.iter().flat_map(|cause| &cause.parameters) {
                let true_value = if estimate.name == "time_constant_s" { 0.15 } else { 1.0e7 };
                assert!((estimate.value / true_value - 1.0).abs() < 0.02, "{estimate:?}");
            }
        }
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
