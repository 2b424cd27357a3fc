//! What an addition to a fit would gain, predicted without fitting it.

use crate::constants;
use crate::estimate::derivatives::{DifferenceStep, Jacobian, Normal, regularised};
use crate::estimate::likelihood::Residuals;
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;
use rayon::prelude::*;

/// A candidate at its starting values.
struct Started {
    /// Residuals there; `None` where the start changes nothing.
    residuals: Option<Residuals>,
    /// What the start gains as it is.
    gained: f64,
}

impl Problem<'_> {
    /// What extending a fit to each of some hypotheses would gain: exact at their starting values, to first order from
    /// there. The candidates hold the fit's parameters first, then those they add.
    pub(crate) fn scores(&self, fit: &Fit, slopes: &Jacobian, candidates: &[Hypothesis]) -> Vec<f64> {
        let values = &fit.hypothesis.values;
        let base = &slopes.base;
        let own: Vec<&Residuals> = slopes.columns.iter().collect();
        let at_base = self.normal(&fit.hypothesis, values, base, &own, None);
        let without = linear_gain(&at_base);
        let cost = self.total(base, &fit.hypothesis, values);
        let started: Vec<Option<Started>> =
            candidates.par_iter().map(|extended| self.start(extended, values.len(), base, cost)).collect();
        let differentiated = differentiated(candidates, &started);
        (candidates.par_iter().zip(&started).zip(differentiated))
            .map(|((extended, started), differentiated)| {
                let Some(started) = started else { return 0.0 };
                match differentiated {
                    Start::Differentiated => {}
                    Start::AsItIs => return started.gained.max(0.0),
                    Start::OnASlope => return 0.0,
                }
                let at_start = started.residuals.as_ref().unwrap_or(base);
                let added: Vec<Residuals> = (values.len()..extended.parameters.len())
                    .map(|index| {
                        let smoothless =
                            matches!(extended.parameters[index].slot, Slot::Effect(e, _) if !e.identification().smooth_at_neutral);
                        let step = if smoothless {
                            DifferenceStep { rough: constants::step_overcoming(), smooth: constants::step_overcoming() }
                        } else {
                            DifferenceStep::of_fits()
                        };
                        self.jacobian_column(extended, &extended.values, at_start, index, &step)
                    })
                    .collect();
                let columns: Vec<&Residuals> = own.iter().copied().chain(&added).collect();
                // Weights change with the residuals.
                let known = started.residuals.is_none().then_some(&at_base);
                let all = self.normal(extended, &extended.values, at_start, &columns, known);
                (started.gained + linear_gain(&all) - without).max(0.0)
            })
            .collect()
    }

    /// A candidate whose parameters from `own` on are new, judged at its starting values.
    fn start(&self, extended: &Hypothesis, own: usize, base: &Residuals, cost: f64) -> Option<Started> {
        let added = || extended.parameters.iter().zip(&extended.values).skip(own);
        if added().all(|(p, v)| p.neutral == *v || *v == 0.0) {
            return Some(Started { residuals: None, gained: 0.0 });
        }
        let touched = added().fold(0, |all, (p, _)| all | p.channels);
        let moved = self.evaluate(extended, &extended.values, touched)?;
        let mut residuals = base.clone();
        for (to, from) in residuals.channels.iter_mut().zip(moved.channels) {
            if !from.is_empty() {
                *to = from;
            }
        }
        let gained = cost - self.total(&residuals, extended, &extended.values);
        Some(Started { residuals: Some(residuals), gained })
    }
}

/// What becomes of a start.
#[derive(Clone, Copy)]
enum Start {
    /// It is worth taking slopes there.
    Differentiated,
    /// What it gains as it is tells enough.
    AsItIs,
    /// A neighbour on the same grid lies lower: it leads into the same valley.
    OnASlope,
}

/// Which candidates are worth taking slopes: all neutral starts, and of each effect's others the best. Breakaway forces form
/// a grid over several valleys; of each valley the lowest point counts.
fn differentiated(candidates: &[Hypothesis], started: &[Option<Started>]) -> Vec<Start> {
    let last = |place: usize| candidates[place].effects.last();
    let moved = |place: usize| started[place].as_ref().filter(|s| s.residuals.is_some()).map(|s| s.gained);
    let on_a_slope = |place: usize, gained: f64| {
        let neighbours = [place.wrapping_sub(1), place + 1].into_iter().filter(|other| *other < candidates.len());
        let mut same = neighbours.filter(|other| last(*other) == last(place));
        last(place).is_some_and(|e| e.identification().starts_form_a_grid)
            && same.any(|other| moved(other).is_some_and(|g| g > gained))
    };
    let starts: Vec<Start> = (0..candidates.len())
        .map(|place| match moved(place) {
            Some(gained) if on_a_slope(place, gained) => Start::OnASlope,
            _ => Start::Differentiated,
        })
        .collect();
    (0..candidates.len())
        .map(|place| {
            let (Some(gained), Start::Differentiated) = (moved(place), starts[place]) else { return starts[place] };
            let rivals = (0..candidates.len()).filter(|other| *other != place && last(*other) == last(place));
            let better = |other: &usize| {
                matches!(starts[*other], Start::Differentiated) && moved(*other).is_some_and(|g| g > gained)
            };
            if rivals.filter(better).count() < constants::starts_sloped() {
                Start::Differentiated
            } else {
                Start::AsItIs
            }
        })
        .collect()
}

/// What a full step to the minimum of the quadratic would gain.
fn linear_gain((matrix, gradient): &Normal) -> f64 {
    regularised(matrix, 1.0e-14).cholesky().map_or(0.0, |c| 0.5 * gradient.dot(&c.solve(gradient)))
}
