//! Nominal values corrected within their tolerance: adjustments, not causes.

use crate::constants;
use crate::data::channel::Channel;
use crate::estimate::problem::{Fit, Problem};
use crate::model::parameter::Slot;
use crate::outcome::{Calibration, OPENING};

/// The nominal values that a fit corrects by a significant and visible amount.
pub(crate) fn calibration(problem: &Problem<'_>, fit: &Fit) -> Vec<Calibration> {
    let h = &fit.hypothesis;
    let mut out = Vec::new();
    let supply = &problem.record.p_sup_pa;
    let shown_pa = supply.iter().sum::<f64>() / supply.len().max(1) as f64;
    for (place, (parameter, value)) in h.parameters.iter().zip(&h.values).enumerate() {
        let Some(tolerance) = parameter.tolerance else { continue };
        // Name, nominal and corrected value; a sensor's offset is told by the mean of its column.
        let (name, nominal, corrected) = match parameter.slot {
            Slot::SupplySensor => (Channel::Supply.column().to_string(), shown_pa, shown_pa - value),
            Slot::Opening(point) => (format!("{OPENING}[{point}]"), parameter.neutral, *value),
            slot => match slot.stated_key() {
                Some(key) => (key.to_string(), parameter.neutral, *value),
                None => continue,
            },
        };
        let variance = fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)]);
        let std_error = if variance.is_finite() { variance.max(0.0).sqrt() } else { tolerance };
        let moved = (value - parameter.neutral).abs();
        if moved > constants::calibrated_sigmas() * std_error && moved > 0.1 * tolerance {
            out.push(if parameter.slot == Slot::Rounding {
                let stated = |square: f64| parameter.slot.as_stated(square);
                let (tolerance, value) = (stated(nominal + tolerance) - stated(nominal), stated(corrected));
                Calibration { name, nominal: stated(nominal), value, std_error: 0.5 * std_error / value, tolerance }
            } else {
                Calibration { name, nominal, value: corrected, std_error, tolerance }
            });
        }
    }
    out
}
