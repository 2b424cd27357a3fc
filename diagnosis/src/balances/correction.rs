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
    let noisier = record.position_variance_ahead(position_lag) - 1.0;
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
            // What the position's noise is of the variance of an error, and of how much of that variance the lag leaves one.
            let by_position = (1.0 - (weights[k] / by_pressure).powi(2)).max(0.0);
            let left = 1.0 / (1.0 + by_position * noisier);
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
