//! Parameters whose cost is rugged: a slope says little about what lies a few steps away.

use super::problem::{Fit, Problem};
use crate::data::channel::{Channel, Channels};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use rayon::prelude::*;

/// Nominal values whose cost is rugged.
const RUGGED_KEYS: [&str; 2] = ["friction.coulomb_n", "friction.static_n"];
/// First step beside a solution, in plainly visible changes; it is divided by three until something is gained.
const FIRST_STEP: f64 = 0.4;
const TRIALS: usize = 4;
/// Least gain worth a move.
const LEAST_GAIN: f64 = 1.0;
/// A rise of the cost that chance does not make: this much, and this part of what the fit leaves.
const RISE: f64 = 2.0;
const RISE_OF_REST: f64 = 0.05;
/// Narrowest width told, in plainly visible changes.
const NARROWEST: f64 = 0.01;
/// Widths tried, each one and a half times the one before.
const WIDTHS: i32 = 12;

/// Whether a parameter's cost is rugged.
fn rugged(parameter: &Parameter) -> bool {
    match parameter.slot {
        // Where the piston sticks, each breakaway that moves to another moment is a step in the cost.
        Slot::Effect(..) => parameter.channels & Channel::Position.bit() != 0,
        Slot::Nominal(key) => RUGGED_KEYS.contains(&key.path),
        Slot::Term(_) => false,
    }
}

impl Problem<'_> {
    /// Looks beside the solution along parameters whose cost is rugged, where a slope says little about what lies a few
    /// steps away; `None` if nothing better is there.
    pub(crate) fn beside(&self, fit: &Fit, changed: Channels) -> Option<Hypothesis> {
        let h = &fit.hypothesis;
        let mut values = h.values.clone();
        let mut cost = fit.cost(self);
        let mut found = false;
        for (index, parameter) in
            h.parameters.iter().enumerate().filter(|(_, p)| rugged(p) && p.channels & changed != 0)
        {
            let touched = parameter.channels;
            let in_others = fit.cost_in(self, !touched);
            let mut step = FIRST_STEP * parameter.scale;
            for _ in 0..TRIALS {
                let trial = |step: f64| {
                    let mut trial = values.clone();
                    trial[index] = (trial[index] + step).clamp(parameter.min, parameter.max);
                    let residuals = self.evaluate(h, &trial, touched)?;
                    Some((in_others + self.total(&residuals, h, &trial), trial))
                };
                let (up, down) = rayon::join(|| trial(step), || trial(-step));
                let best = up.into_iter().chain(down).min_by(|a, b| a.0.total_cmp(&b.0));
                match best {
                    Some((new, trial)) if new < cost - LEAST_GAIN => {
                        (values, cost, found) = (trial, new, true);
                    }
                    _ => step /= 3.0,
                }
            }
        }
        found.then(|| Hypothesis { values, ..h.clone() })
    }

    /// Half the distance from the solution beyond which the cost of a rugged parameter stays risen on both sides: its
    /// standard error as the cost itself shows it. `None` for a parameter whose curvature can be trusted.
    pub(crate) fn width(&self, fit: &Fit, index: usize) -> Option<f64> {
        let h = &fit.hypothesis;
        let parameter = &h.parameters[index];
        if !rugged(parameter) {
            return None;
        }
        let touched = parameter.channels;
        let cost = fit.cost_in(self, touched);
        let rest = (cost - self.noise_cost(touched)).max(0.0);
        let risen = |step: f64| {
            let mut trial = h.values.clone();
            trial[index] = (trial[index] + step).clamp(parameter.min, parameter.max);
            self.cost_of(h, &trial, touched).is_none_or(|at| at > cost + RISE + RISE_OF_REST * rest)
        };
        let steps: Vec<f64> = (0..WIDTHS).map(|k| NARROWEST * 1.5f64.powi(k) * parameter.scale).collect();
        let low = steps.par_iter().filter(|step| !(risen(**step) && risen(-**step))).max_by(|a, b| a.total_cmp(b));
        Some(0.5 * 1.5 * low.copied().unwrap_or(NARROWEST * parameter.scale))
    }
}
