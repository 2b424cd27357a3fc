//! The noise of sensors as predictions tell it. Between distant samples a signal's own motion is in the differences that
//! noise is estimated from; a prediction knows the motion. A sensor is no noisier than a prediction of it errs.

use super::problem::{Fit, Problem};
use crate::constants;
use crate::data::record::Record;
use crate::statistics::{MEDIAN_OF_NORMAL, median};

/// What a fit's errors say of each sensor's noise, over what the log's differences said; no more than one.
fn told(problem: &Problem<'_>, fit: &Fit) -> [f64; 4] {
    let Some(innovations) = problem.innovations(fit) else { return [1.0; 4] };
    innovations.channels.map(|errors| {
        let mut sizes: Vec<f64> = errors.into_iter().filter(|e| !e.is_nan() && *e != 0.0).map(f64::abs).collect();
        if sizes.len() < constants::least_errors() {
            return 1.0;
        }
        let part = median(&mut sizes).map(|size| size / MEDIAN_OF_NORMAL);
        part.map_or(1.0, |part| part.clamp(constants::least_quieter(), 1.0))
    })
}

/// The record with the noise that a fit tells, if that is plainly less and rows are so far apart that it may be.
pub(crate) fn quieter(problem: &Problem<'_>, fit: &Fit) -> Option<Record> {
    if problem.record.averaged() > 1 {
        return None;
    }
    let told = told(problem, fit);
    if told.iter().all(|part| *part > constants::plainly_quieter()) {
        return None;
    }
    let mut record = problem.record.clone();
    let [a, b, y, _] = told;
    record.weight_a_per_pa.iter_mut().for_each(|weight| *weight /= a);
    record.weight_b_per_pa.iter_mut().for_each(|weight| *weight /= b);
    let quality = &mut record.quality;
    for (channel, part) in [(&mut quality.pressure_a, a), (&mut quality.pressure_b, b), (&mut quality.position, y)] {
        channel.standard_deviation *= part;
    }
    Some(record)
}
