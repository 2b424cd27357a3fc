//! Nominal values corrected within their tolerance: adjustments, not causes.

use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::parameter::Slot;
use crate::outcome::Calibration;

/// The nominal values that a fit corrects by a significant and visible amount.
pub(crate) fn calibration(problem: &Problem<'_>, fit: &Fit) -> Vec<Calibration> {
    let h = &fit.hypothesis;
    let mut out = Vec::new();
    for (place, (parameter, value)) in h.parameters.iter().zip(&h.values).enumerate() {
        let (Slot::Nominal(key), Some(tolerance)) = (parameter.slot, parameter.tolerance) else { continue };
        let variance = fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)]);
        let std_error = if variance.is_finite() { variance.max(0.0).sqrt() } else { tolerance };
        let moved = (value - parameter.neutral).abs();
        if moved > constants::calibrated_sigmas() * std_error && moved > 0.1 * tolerance {
            out.push(Calibration {
                name: key.path.to_string(),
                nominal: key.get(&problem.rig.rig),
                value: *value,
                std_error,
                tolerance,
            });
        }
    }
    out
}
