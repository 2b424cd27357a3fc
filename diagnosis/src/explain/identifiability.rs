//! What the log says nothing about.

use crate::estimate::problem::{Fit, Problem};
use crate::select::visibility;
use plant_model::Effect;

/// Rig keys that the log does not determine, and effects that would not show in it.
pub(crate) fn not_identifiable(problem: &Problem<'_>, fit: &Fit) -> Vec<String> {
    let record = problem.record;
    let mut out = Vec::new();
    let friction = &problem.rig.rig.friction;
    let presliding = friction.coulomb_n / friction.stiffness_n_per_m;
    let position = &record.quality.position;
    // The bristles' whole range must stand out of the sensor's noise to be seen.
    if position.standard_deviation.max(position.resolution) > 0.1 * presliding {
        for key in ["stiffness_n_per_m", "damping_n_s_per_m", "breakaway_m"] {
            out.push(format!("friction.{key}"));
        }
    }
    let resolution = record.velocity_error_m_per_s();
    if resolution > 0.2 * friction.stribeck_velocity_m_per_s {
        out.push("friction.stribeck_velocity_m_per_s".to_string());
    }
    for (place, parameter) in fit.hypothesis.parameters.iter().enumerate() {
        if let (Some(key), Some(tolerance)) = (parameter.slot.stated_key(), parameter.tolerance) {
            let variance = fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)]);
            if !variance.is_finite() || variance.max(0.0).sqrt() > 0.7 * tolerance {
                out.push(key.to_string());
            }
        }
    }
    let able = visibility::candidates(problem);
    let visible = visibility::visible(problem, fit, &able);
    out.extend(Effect::ALL.into_iter().filter(|e| !visible.contains(e)).map(|e| e.id().to_string()));
    out
}
