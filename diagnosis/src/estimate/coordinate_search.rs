//! Coordinate search and profile likelihood for parameters with a non-smooth cost, where a derivative says little about
//! the cost a few steps away.

use super::compensation::moved;
use super::problem::{Fit, Problem};
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use rayon::prelude::*;

/// Nominal values with a non-smooth cost.
const NON_SMOOTH_KEYS: [&str; 2] = ["friction.coulomb_n", "friction.static_n"];

/// Whether the cost is non-smooth in a parameter.
fn is_non_smooth(parameter: &Parameter) -> bool {
    match parameter.slot {
        // Where the piston sticks, each breakaway that moves to another moment is a step in the cost.
        Slot::Effect(..) | Slot::Stated(..) => parameter.channels & Channel::Position.bit() != 0,
        Slot::Nominal(key) => NON_SMOOTH_KEYS.contains(&key.path),
        Slot::Term(_) | Slot::Opening(_) | Slot::Rounding | Slot::SupplySensor => false,
    }
}

impl Problem<'_> {
    /// Coordinate search around a solution, over the parameters with a non-smooth cost that act on `changed` channels.
    /// `None` if it finds nothing of lower cost.
    pub(crate) fn coordinate_search(&self, fit: &Fit, changed: Channels) -> Option<Hypothesis> {
        let h = &fit.hypothesis;
        let mut values = h.values.clone();
        let mut cost = fit.cost(self);
        let mut found = false;
        let companions = self.companions(h);
        for (index, parameter) in
            h.parameters.iter().enumerate().filter(|(_, p)| is_non_smooth(p) && p.channels & changed != 0)
        {
            let touched = parameter.channels;
            let in_others = fit.cost_in(self, !touched);
            let mut step = constants::coordinate_step() * parameter.scale;
            for _ in 0..constants::coordinate_trials() {
                let trial = |step: f64| {
                    let trial = moved(h, &values, (index, step), &companions[index]);
                    let residuals = self.evaluate(h, &trial, touched)?;
                    Some((in_others + self.total(&residuals, h, &trial), trial))
                };
                let (up, down) = rayon::join(|| trial(step), || trial(-step));
                let best = up.into_iter().chain(down).min_by(|a, b| a.0.total_cmp(&b.0));
                match best {
                    Some((new, trial)) if new < cost - constants::same_cost() => {
                        (values, cost, found) = (trial, new, true);
                    }
                    _ => step /= 3.0,
                }
            }
        }
        found.then(|| Hypothesis { values, ..h.clone() })
    }

    /// Standard error of a parameter with a non-smooth cost, from its likelihood profile: half the distance beyond
    /// which the cost has risen on both sides. The other parameters but its companions stay fixed. `None` where the curvature can be
    /// trusted.
    pub(crate) fn width(&self, fit: &Fit, index: usize) -> Option<f64> {
        let h = &fit.hypothesis;
        let parameter = &h.parameters[index];
        if !is_non_smooth(parameter) {
            return None;
        }
        let companions = self.companions(h);
        let touched = parameter.channels;
        let cost = fit.cost_in(self, touched);
        let rest = (cost - self.noise_cost(touched)).max(0.0);
        let risen = |step: f64| {
            let trial = moved(h, &h.values, (index, step), &companions[index]);
            self.cost_of(h, &trial, touched)
                .is_none_or(|at| at > cost + constants::profile_rise() + constants::profile_rise_of_rest() * rest)
        };
        let steps: Vec<f64> = (0..constants::profile_widths() as i32)
            .map(|k| constants::profile_narrowest() * 1.5f64.powi(k) * parameter.scale)
            .collect();
        let low = steps.par_iter().filter(|step| !(risen(**step) && risen(-**step))).max_by(|a, b| a.total_cmp(b));
        Some(0.5 * 1.5 * low.copied().unwrap_or(constants::profile_narrowest() * parameter.scale))
    }
}
