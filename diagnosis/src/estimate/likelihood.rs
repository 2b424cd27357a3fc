//! Minus the log-likelihood of innovations: robust loss, averages of neighbours, long-run variance.

use crate::balances::observers::Innovations;
use crate::constants;

/// Mean robust cost of one bundled, unit-variance, normal innovation.
pub(crate) const COST_OF_NOISE: f64 = 0.466;

/// Bundled innovations of one evaluation, with the channel offsets.
#[derive(Clone, Default)]
pub(crate) struct Residuals {
    pub(crate) channels: [Vec<f64>; 4],
}

/// Averages neighbours.
pub(crate) fn average_neighbours(innovations: &Innovations) -> Residuals {
    let mut out = Residuals::default();
    let root = (constants::averaged() as f64).sqrt();
    for (to, from) in out.channels.iter_mut().zip(&innovations.channels) {
        to.extend(from.chunks(constants::averaged()).map(|chunk| {
            let sum: f64 = chunk.iter().sum();
            // A NaN anywhere in the bundle leaves it out: it counts as no deviation for every model alike.
            if sum.is_nan() || chunk.len() < constants::averaged() { 0.0 } else { sum / root }
        }));
    }
    out
}

/// Mean cost of a channel's innovations over that of white noise, the worst part left out.
pub(crate) fn trimmed_misfit(innovations: &[f64], left_out: f64) -> f64 {
    let mut costs: Vec<f64> = innovations
        .chunks_exact(constants::averaged())
        .map(|chunk| chunk.iter().sum::<f64>() / (constants::averaged() as f64).sqrt())
        .filter(|e| !e.is_nan())
        .map(loss)
        .collect();
    costs.sort_unstable_by(f64::total_cmp);
    costs.truncate((costs.len() as f64 * (1.0 - left_out)).ceil() as usize);
    costs.iter().sum::<f64>() / (COST_OF_NOISE * costs.len().max(1) as f64)
}

/// The pseudo-Huber loss: half the square for small errors, proportional to large ones.
pub(crate) fn loss(e: f64) -> f64 {
    let x = e / constants::robust_knee();
    constants::robust_knee() * constants::robust_knee() * ((1.0 + x * x).sqrt() - 1.0)
}

/// The weight of an error in iteratively reweighted least squares: the slope of the loss over the error.
pub(crate) fn weight(e: f64) -> f64 {
    let x = e / constants::robust_knee();
    1.0 / (1.0 + x * x).sqrt()
}

/// Long-run variance of innovations that should be white with unit variance: that of means over some 50 samples,
/// robustly; no less than 1. What is not settled is left out.
pub(crate) fn dispersion(innovations: &[f64]) -> f64 {
    let root = (constants::dispersion_span() as f64).sqrt();
    let e: Vec<f64> = innovations.iter().copied().filter(|e| !e.is_nan()).collect();
    let mut sums: Vec<f64> =
        e.chunks_exact(constants::dispersion_span()).map(|chunk| (chunk.iter().sum::<f64>() / root).abs()).collect();
    if sums.len() < constants::least_spans() {
        return 1.0;
    }
    let middle = sums.len() / 2;
    let median = *sums.select_nth_unstable_by(middle, f64::total_cmp).1;
    (median / 0.6745).powi(2).max(1.0)
}
