//! The score test: the gain of a candidate in log-likelihood, predicted to first order without fitting it (Rao 1948).

use crate::estimate::derivatives::{Jacobian, Normal, regularised};
use crate::estimate::likelihood::Residuals;
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use rayon::prelude::*;

/// A candidate at its initial values.
struct Started {
    /// Residuals there; `None` if the initial values are neutral.
    residuals: Option<Residuals>,
    /// Gain of the initial values themselves.
    gained: f64,
}

impl Problem<'_> {
    /// The scores of some extensions of a fit: the exact gain of their initial values plus the first-order gain from
    /// there. The parameters of a candidate are those of the fit, followed by those it adds.
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
                    .map(|index| self.jacobian_column(extended, &extended.values, at_start, index))
                    .collect();
                let columns: Vec<&Residuals> = own.iter().copied().chain(&added).collect();
                // The weights of the robust loss depend on the residuals, so the known part holds only where these are
                // the same.
                let known = started.residuals.is_none().then_some(&at_base);
                let all = self.normal(extended, &extended.values, at_start, &columns, known);
                (started.gained + linear_gain(&all) - without).max(0.0)
            })
            .collect()
    }

    /// Evaluates a candidate, whose parameters from `own` on are new, at its initial values.
    fn start(&self, extended: &Hypothesis, own: usize, base: &Residuals, cost: f64) -> Option<Started> {
        let added = || extended.parameters.iter().zip(&extended.values).skip(own);
        if added().all(|(p, v)| p.neutral == *v || *v == 0.0) {
            return Some(Started { residuals: None, gained: 0.0 });
        }
        let touched = added().fold(0, |all, (p, _)| all | p.channels);
        let mut residuals = self.evaluate(extended, &extended.values, touched)?;
        residuals.fill_in(base);
        let gained = cost - self.total(&residuals, extended, &extended.values);
        Some(Started { residuals: Some(residuals), gained })
    }
}

/// How the score at some initial values is computed.
#[derive(Clone, Copy)]
enum Start {
    /// With derivatives there.
    Differentiated,
    /// From the gain of the initial values alone.
    AsItIs,
    /// Not at all: a neighbour on the same grid has the lower cost and leads to the same minimum.
    OnASlope,
}

/// Chooses where derivatives are taken: at all neutral initial values, and at the best of each effect's others. Where
/// initial values form a grid over several local minima (friction levels), the lowest point of each minimum counts.
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
            let mut rivals = (0..candidates.len()).filter(|other| *other != place && last(*other) == last(place));
            let better = |other: usize| {
                matches!(starts[other], Start::Differentiated) && moved(other).is_some_and(|g| g > gained)
            };
            if rivals.any(better) { Start::AsItIs } else { Start::Differentiated }
        })
        .collect()
}

/// The gain of a full Gauss-Newton step: `g' H^-1 g / 2`.
fn linear_gain((matrix, gradient): &Normal) -> f64 {
    regularised(matrix, 1.0e-14).cholesky().map_or(0.0, |c| 0.5 * gradient.dot(&c.solve(gradient)))
}
