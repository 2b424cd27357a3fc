//! How the prediction of a chamber's pressure is judged and corrected at each sample. Of the hypothesis only the lag of the position
//! sensor counts, as undoing it makes the position noisier: so none seems less noisy by following the measurement more closely, and
//! all hypotheses with the same lag share one.

use crate::constants;
use crate::data::record::{ChamberSignals, Record};
use crate::data::split::{Stretch, samples};
use plant_model::{FirstOrderLag, Side};

/// Weights and gains at the samples of some stretches, in order.
pub(crate) struct Correction {
    /// One over the standard deviation of an error, 1/Pa; NaN where errors are not judged.
    pub(crate) weight_per_pa: Vec<f64>,
    /// The part of an error by which the prediction is corrected; 0 between rows.
    pub(crate) gain: Vec<f64>,
    /// Sum of the logarithms of the part that the sensor's noise is of what errors are told in.
    pub(crate) log_widths: f64,
}

/// Weights and gains of the predictions of a chamber's pressure.
pub(crate) fn correction(
    record: &Record,
    side: Side,
    position_lag: &FirstOrderLag<f64>,
    stretches: &[Stretch],
) -> Correction {
    let ChamberSignals { weight_per_pa: weights, noise_pa, doubt_pa, .. } = record.chamber(side);
    let count = samples(stretches);
    // Where position noise counts for more than that of the pressure everywhere, a sample is compared with the clearest one.
    let by_pressure = 1.0 / noise_pa.max(constants::numerical_error_pa());
    let clearest = weights.iter().fold(0.0_f64, |most, weight| most.max(*weight));
    let added = record.position_variance_added(position_lag);
    let usual = if clearest < constants::chamber_clear() * by_pressure { clearest } else { by_pressure };
    let mut out =
        Correction { weight_per_pa: Vec::with_capacity(count), gain: Vec::with_capacity(count), log_widths: 0.0 };
    for stretch in stretches {
        let mut settled = (record.t_s[stretch.start] + constants::settling_s()).max(record.valve_known_s);
        // Variance of the prediction by what is not known of the command.
        let mut doubt = 0.0;
        for k in stretch.range() {
            if !record.is_row(k) {
                out.weight_per_pa.push(f64::NAN);
                out.gain.push(0.0);
                continue;
            }
            if weights[k] < constants::chamber_clear() * usual {
                settled = settled.max(record.t_s[k] + constants::settling_s());
            }
            // The part of an error's variance that is the position's noise, and what is left of the precision where the lag is undone.
            let by_position = (1.0 - (weights[k] / by_pressure).powi(2)).max(0.0);
            let left = 1.0 / (1.0 + by_position * added);
            let precision = weights[k] * weights[k] * left;
            let trusted = if doubt > 0.0 { 1.0 / (1.0 + doubt * precision) } else { 1.0 };
            let judged = record.t_s[k] >= settled && weights[k] > 0.0;
            out.weight_per_pa.push(if judged { weights[k] * (left * trusted).sqrt() } else { f64::NAN });
            if judged {
                out.log_widths -= 0.5 * (left * trusted).ln();
            }
            // After settling, the pressure is known as well as an average over the time since then. So the gain
            // falls with one over that time, as a Kalman filter's would, down to the stationary gain.
            let since = record.t_s[k] - settled;
            let memory = if since < 0.0 {
                constants::chamber_settling_memory_s()
            } else {
                (constants::chamber_settling_memory_s() + since).min(constants::chamber_memory_s())
            };
            let to_next = record.to_next_row_s(k);
            let (stationary, kalman) = (to_next / (memory + to_next), 1.0 - trusted);
            let gain = stationary.max(kalman);
            doubt *= if stationary > kalman { (1.0 - gain).powi(2) } else { 1.0 - gain };
            doubt += doubt_pa.get(k).map_or(0.0, |grows| grows * grows);
            out.gain.push(gain);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use crate::balances::added::Added;
    use crate::balances::observers::innovations;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::data::channel::Channel;
    use crate::data::prepare::prepare;
    use plant_model::{Effect, Effects, Plant};
    use rig_files::RigFile;

    /// Of both chambers at lags assumed, in s: the mean square of the errors, half the sum of squares, and the latter with the cost of the
    /// errors' widths. The log has a lag of `true_s`, and a command of so many volts in two sines.
    fn told(true_s: f64, amplitude_v: f64) -> impl Fn(f64) -> [f64; 3] {
        let file = RigFile::paper_c();
        let effects = |lag_s: f64| Effects::none().with(Effect::PositionLag, &[lag_s]);
        let command = |t_s: f64| amplitude_v * ((3.0 * t_s).sin() + (11.0 * t_s).sin());
        let mut log = simulated(&file, &effects(true_s), 12_000, command);
        add_noise(&mut log, 20.0e-6, 150.0);
        let (record, signals, added) = (prepare(&log, &file), Signals::default(), Added::default());
        move |lag_s| {
            let plant = Plant::new(&file.rig, &effects(lag_s)).expect("a sound rig");
            let wanted = Channel::PressureA.bit() | Channel::PressureB.bit();
            let errors = innovations(&record, &signals, &plant, &added, &record.stretches, wanted, Default::default());
            let judged = errors.channels.iter().flatten().filter(|e| !e.is_nan());
            let (sum, count) = judged.fold((0.0, 0), |(sum, count), e| (sum + e * e, count + 1));
            [sum / f64::from(count), 0.5 * sum, 0.5 * sum + errors.log_widths.iter().sum::<f64>()]
        }
    }

    #[test]
    fn the_lag_that_predicts_pressures_best_is_the_true_one_and_leaves_errors_like_noise() {
        let told = told(0.02, 0.5);
        let costs = (0..=40).map(|k| 0.016 + 2.0e-4 * f64::from(k)).map(|lag_s| (lag_s, told(lag_s)[2]));
        let (best_s, _) = costs.min_by(|a, b| a.1.total_cmp(&b.1)).expect("many lags");
        let [misfit, ..] = told(0.02);
        assert!((best_s - 0.02).abs() < 3.0e-4, "{best_s}");
        // 0.48; 1.52 with the weights of a sensor without lag.
        assert!((0.4..1.2).contains(&misfit), "{misfit}");
    }

    #[test]
    fn no_lag_is_gained_from_errors_that_it_would_excuse() {
        let told = told(0.0, 0.0);
        let ([_, errors_without, without], [_, errors_with, with]) = (told(0.0), told(0.02));
        assert!(errors_with < errors_without && with > without);
    }
}
