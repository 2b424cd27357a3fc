//! Minus the log-likelihood of innovations: robust loss, averages of neighbours, long-run variance.

use crate::balances::observers::Innovations;
use crate::constants;
use crate::statistics::{MEDIAN_OF_NORMAL, median};

/// Mean loss of one averaged innovation that is normal with unit variance.
pub(crate) const COST_OF_NOISE: f64 = 0.466;

/// Averaged innovations of one evaluation, by channel.
#[derive(Clone, Default)]
pub(crate) struct Residuals {
    pub(crate) channels: [Vec<f64>; 4],
    /// Sums of the logarithms of their standard deviations over those of the sensors' noise: what it costs that errors may be larger.
    pub(crate) log_widths: [f64; 4],
}

impl Residuals {
    /// Those of another evaluation in the channels that this one leaves out.
    pub(crate) fn fill_in(&mut self, others: &Self) {
        for channel in 0..self.channels.len() {
            if self.channels[channel].is_empty() {
                self.channels[channel].clone_from(&others.channels[channel]);
                self.log_widths[channel] = others.log_widths[channel];
            }
        }
    }
}

/// Averages groups of so many neighbours, scaled so that white noise keeps unit variance.
pub(crate) fn average_neighbours(innovations: &Innovations, averaged: usize) -> Residuals {
    let log_widths = innovations.log_widths.map(|sum| sum / averaged as f64);
    let mut out = Residuals { log_widths, ..Residuals::default() };
    let root = (averaged as f64).sqrt();
    for (to, from) in out.channels.iter_mut().zip(&innovations.channels) {
        to.extend(from.chunks(averaged).map(|chunk| {
            let sum: f64 = chunk.iter().sum();
            // A group with a NaN counts as zero error, for every hypothesis alike.
            if sum.is_nan() || chunk.len() < averaged { 0.0 } else { sum / root }
        }));
    }
    out
}

/// Mean cost of a channel's innovations, so many averaged into one, over that of white noise. What is not settled is left out.
pub(crate) fn misfit(innovations: &[f64], averaged: usize) -> f64 {
    let means = innovations.chunks_exact(averaged).map(|chunk| chunk.iter().sum::<f64>() / (averaged as f64).sqrt());
    let (sum, count) = means.filter(|e| !e.is_nan()).fold((0.0, 0), |(sum, count), e| (sum + loss(e), count + 1));
    sum / (COST_OF_NOISE * count.max(1) as f64)
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

/// Long-run variance of innovations that should be white with unit variance: that of means over `span` samples, robustly;
/// no less than 1. What is not settled is left out.
pub(crate) fn dispersion(innovations: &[f64], span: usize) -> f64 {
    let root = (span as f64).sqrt();
    let e: Vec<f64> = innovations.iter().copied().filter(|e| !e.is_nan()).collect();
    let mut sums: Vec<f64> = e.chunks_exact(span).map(|chunk| (chunk.iter().sum::<f64>() / root).abs()).collect();
    if sums.len() < constants::least_spans() {
        return 1.0;
    }
    median(&mut sums).map_or(1.0, |usual| (usual / MEDIAN_OF_NORMAL).powi(2).max(1.0))
}

/// The misfit that white noise reaches by chance, given its cost: half of so many squares, whose mean has the variance of two over their
/// number.
pub(crate) fn by_chance(noise: f64) -> f64 {
    1.0 + constants::chance() / noise.max(1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand_distr::{Distribution, StandardNormal};

    fn white(count: usize) -> Vec<f64> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        (0..count).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    #[test]
    fn the_cost_of_noise_is_the_mean_loss_of_a_normal_variable() {
        // The integral of loss times density by the trapezoidal rule, which is exact to many digits for it.
        let step = 1.0e-3;
        let density = |e: f64| (-0.5 * e * e).exp() / core::f64::consts::TAU.sqrt();
        let mean: f64 = (-10_000..=10_000).map(|k| f64::from(k) * step).map(|e| loss(e) * density(e) * step).sum();
        assert!((mean - COST_OF_NOISE).abs() < 1.0e-3, "{mean}");
    }

    #[test]
    fn small_errors_cost_half_their_square_and_large_ones_no_more_than_in_proportion() {
        let knee = constants::robust_knee();
        for (e, expected, tolerance) in [(0.0, 0.0, 1e-12), (0.1, 0.005, 1e-5), (-0.1, 0.005, 1e-5)] {
            assert!((loss(e) - expected).abs() < tolerance, "{e}: {}", loss(e));
        }
        assert!((loss(1.0e4) - (knee * 1.0e4 - knee * knee)).abs() < 0.01);
        assert!(weight(0.0) == 1.0 && (weight(1.0e6) * 1.0e6 - knee).abs() < 1.0e-3);
    }

    #[test]
    fn averages_of_white_noise_keep_its_variance_and_a_missing_sample_leaves_its_average_out() {
        let mut e = white(40_000);
        e[9] = f64::NAN;
        let innovations = Innovations { channels: [e, Vec::new(), Vec::new(), Vec::new()], ..Innovations::default() };
        let averaged = &average_neighbours(&innovations, 4).channels[0];
        let variance = averaged.iter().map(|e| e * e).sum::<f64>() / averaged.len() as f64;
        assert!((variance - 1.0).abs() < 0.05, "{variance}");
        assert_eq!(averaged[9 / 4], 0.0);
    }

    #[test]
    fn the_long_run_variance_is_one_for_white_errors_and_grows_with_their_correlation() {
        let white = white(40_000);
        assert!(dispersion(&white, 50) < 1.25, "{}", dispersion(&white, 50));
        // An autoregression with a memory of ten samples: its long-run variance is ((1 + a) / (1 - a)) times its own.
        let mut state = 0.0;
        let correlated: Vec<f64> = (white.iter())
            .map(|e| {
                state = 0.9 * state + (1.0_f64 - 0.81).sqrt() * e;
                state
            })
            .collect();
        assert!((10.0..20.0).contains(&dispersion(&correlated, 50)), "{}", dispersion(&correlated, 50));
        assert_eq!(dispersion(&white[..100], 50), 1.0);
    }

    #[test]
    fn the_misfit_of_white_noise_is_one_and_what_is_not_settled_does_not_count() {
        let mut e = white(40_000);
        e[100..200].fill(f64::NAN);
        let plain = misfit(&e, 4);
        assert!((plain - 1.0).abs() < 0.05, "{plain}");
        e[200..300].fill(1.0e3);
        assert!(misfit(&e, 4) > 10.0);
    }
}
