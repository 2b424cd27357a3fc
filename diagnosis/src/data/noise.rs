//! Noise and resolution of the sensors, estimated from the log itself.

use crate::statistics::MEDIAN_OF_NORMAL;
use serde::Serialize;

/// Noise and resolution of one channel.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct ChannelNoise {
    /// Standard deviation of what changes from sample to sample, in the channel's unit; quantisation included.
    pub standard_deviation: f64,
    /// Smallest step between different values, in the channel's unit; 0 where no step repeats.
    pub resolution: f64,
}

/// Noise of so many quantisation steps makes the errors of neighbouring samples independent: they are those of one code no longer.
const DITHERS: f64 = 0.35;

impl ChannelNoise {
    /// How far off a reading may be for as long as the signal stays within one code: half a step, less as noise moves it from code to
    /// code, 0 where noise does so from sample to sample. Such errors are no noise: they do not change while the signal rests.
    pub(crate) fn within_code(&self) -> f64 {
        let of_steps = self.resolution / 12.0_f64.sqrt();
        let own = (self.standard_deviation.powi(2) - of_steps.powi(2)).max(0.0).sqrt();
        (0.5 * (self.resolution - own / DITHERS)).max(0.0)
    }
}

/// Third differences remove every motion a sensor can follow and keep white noise, 20-fold in variance.
const THIRD_DIFFERENCE_GAIN: f64 = 20.0;
/// The part of the differences that is kept: jumps of the signal itself are few and large.
const KEPT: f64 = 0.95;
/// Variance of a normal variable without the 5 % of largest magnitude.
const KEPT_VARIANCE: f64 = 0.7587;
/// Of noise alone, median and mean square tell the same. Where the median tells less than this part, samples are so far
/// apart that the signal's own motion is in the differences, and the median, which rests count for, is believed.
const MOTION: f64 = 0.8;

/// Estimates noise and resolution from stretches of a signal: times in s and values.
pub(crate) fn estimate<'a>(stretches: impl Iterator<Item = (&'a [f64], &'a [f64])>) -> ChannelNoise {
    let mut differences = Vec::new();
    let mut steps = Vec::new();
    for (t_s, x) in stretches {
        let pairs = t_s.windows(4).zip(x.windows(4));
        differences.extend(pairs.map(|(t_s, x)| third_difference(t_s, x).abs()));
        steps.extend(x.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0));
    }
    if differences.is_empty() {
        return ChannelNoise::default();
    }
    let resolution = resolution(&mut steps);
    let kept = ((differences.len() as f64) * KEPT).ceil() as usize;
    let kept = kept.clamp(1, differences.len());
    differences.select_nth_unstable_by(kept - 1, f64::total_cmp);
    let mean_square = differences[..kept].iter().map(|d| d * d).sum::<f64>() / kept as f64;
    let by_mean = (mean_square / KEPT_VARIANCE / THIRD_DIFFERENCE_GAIN).sqrt();
    let by_median = middle(&mut differences, resolution) / MEDIAN_OF_NORMAL / THIRD_DIFFERENCE_GAIN.sqrt();
    let spread = if by_median < MOTION * by_mean { by_median } else { by_mean };
    // A signal that rests on one code shows no differences; its error is still that of the code.
    ChannelNoise { standard_deviation: spread.max(resolution / 12.0_f64.sqrt()), resolution }
}

/// The third divided difference of four values at four times, scaled so that it gains of white noise what that at equal distances does: it
/// removes a motion with constant acceleration however the times lie.
fn third_difference(t_s: &[f64], x: &[f64]) -> f64 {
    let inverse = |i: usize| {
        let others = (0..4).filter(|j| *j != i);
        1.0 / others.map(|j| (t_s[i] - t_s[j]) / (t_s[3] - t_s[0])).product::<f64>()
    };
    let weights: [f64; 4] = core::array::from_fn(inverse);
    let gain: f64 = weights.iter().map(|weight| weight * weight).sum();
    let sum: f64 = weights.iter().zip(x).map(|(weight, x)| weight * x).sum();
    if gain.is_finite() { sum * (THIRD_DIFFERENCE_GAIN / gain).sqrt() } else { 0.0 }
}

/// The median of differences' magnitudes. On a coarse converter they are whole steps, each of which stands for all within half a step
/// of it (the median of grouped data): else it would jump from step to step.
fn middle(sizes: &mut [f64], step: f64) -> f64 {
    let half = sizes.len() / 2;
    let median = *sizes.select_nth_unstable_by(half, f64::total_cmp).1;
    if step <= 0.0 {
        return median;
    }
    let number = (median / step).round();
    let [from, to] = [(number - 0.5).max(0.0), number + 0.5].map(|edge| edge * step);
    let below = sizes.iter().filter(|size| **size < from).count();
    let within = sizes.iter().filter(|size| (from..to).contains(*size)).count().max(1);
    from + (half as f64 - below as f64) / within as f64 * (to - from)
}

/// The smallest step, if many steps are close to whole multiples of it.
fn resolution(steps: &mut [f64]) -> f64 {
    if steps.len() < 20 {
        return 0.0;
    }
    steps.sort_unstable_by(f64::total_cmp);
    let smallest = steps[steps.len() / 100];
    let whole = |step: &&f64| {
        let multiple = **step / smallest;
        (multiple - multiple.round()).abs() < 0.02
    };
    let low = &steps[..steps.len() / 2];
    if low.iter().filter(whole).count() * 10 >= low.len() * 9 { smallest } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::rngs::Xoshiro256PlusPlus;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    fn estimated(x: &[f64]) -> ChannelNoise {
        let t_s: Vec<f64> = (0..x.len()).map(|k| 1.0e-3 * k as f64).collect();
        estimate(std::iter::once((&t_s[..], x)))
    }

    #[test]
    fn noise_is_found_on_a_moving_signal_at_uneven_times() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        // Each interval between half a millisecond and one and a half.
        let mut now_s = 0.0;
        let mut next = || {
            now_s += 0.5e-3 + 1.0e-3 * rng.random::<f64>();
            now_s
        };
        let t_s: Vec<f64> = (0..20_000).map(|_| next()).collect();
        let noise = rand_distr::Distribution::sample_iter(StandardNormal, &mut rng);
        let x: Vec<f64> = t_s.iter().zip(noise).map(|(t, e): (&f64, f64)| 0.1 * (9.0 * t).sin() + 2.0e-5 * e).collect();
        // 99 um where the times are taken for even.
        let found = estimate(std::iter::once((&t_s[..], &x[..]))).standard_deviation;
        assert!((found / 2.0e-5 - 1.0).abs() < 0.05, "{found}");
        // Two samples of one time tell nothing.
        assert_eq!(third_difference(&[0.0, 1.0, 1.0, 2.0], &[0.0, 1.0, 3.0, 2.0]), 0.0);
    }

    #[test]
    fn noise_is_found_on_a_moving_signal() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut noise = || 1.0e-3 * rng.sample::<f64, _>(StandardNormal);
        let x: Vec<f64> = (0..20_000).map(|k| (0.002 * k as f64).sin() + noise()).collect();
        let noise = estimated(&x);
        assert!((noise.standard_deviation / 1.0e-3 - 1.0).abs() < 0.05, "{noise:?}");
        assert_eq!(noise.resolution, 0.0);
    }

    #[test]
    fn noise_is_found_between_distant_samples_of_a_signal_that_rests_half_of_the_time() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(2);
        let mut noise = || 1.0e-3 * rng.sample::<f64, _>(StandardNormal);
        let moved = |k: usize| if k % 200 < 80 { (0.3 * k as f64).sin() } else { 0.0 };
        let x: Vec<f64> = (0..20_000).map(|k| moved(k) + noise()).collect();
        let noise = estimated(&x);
        assert!((1.0e-3..3.0e-3).contains(&noise.standard_deviation), "{noise:?}");
    }

    #[test]
    fn noise_below_the_step_of_a_coarse_converter_is_found_with_the_step_s_own() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        for part in [0.35, 0.5, 0.8, 1.5] {
            let step = 1.0e-3;
            let mut noise = || part * step * rng.sample::<f64, _>(StandardNormal);
            let x: Vec<f64> =
                (0..20_000).map(|k| (((0.002 * k as f64).sin() + noise()) / step).round() * step).collect();
            let found = estimated(&x).standard_deviation;
            let expected = step * (part * part + 1.0_f64 / 12.0).sqrt();
            assert!((found / expected - 1.0).abs() < 0.06, "{part}: {found} instead of {expected}");
        }
    }

    #[test]
    fn a_reading_may_be_off_within_a_code_unless_noise_moves_it_to_others() {
        let step = 1.0e-3;
        for (own, expected) in [(0.0, 0.5), (0.175, 0.25), (0.35, 0.0), (1.0, 0.0)] {
            let standard_deviation = step * f64::sqrt(own * own + 1.0 / 12.0);
            let within = ChannelNoise { standard_deviation, resolution: step }.within_code();
            assert!((within / step - expected).abs() < 1.0e-9, "{own}: {within}");
        }
        assert_eq!(ChannelNoise { standard_deviation: step, resolution: 0.0 }.within_code(), 0.0);
    }

    #[test]
    fn resolution_is_found_on_a_coarse_converter() {
        let x: Vec<f64> = (0..20_000).map(|k| ((0.002 * k as f64).sin() / 0.01).round() * 0.01).collect();
        let noise = estimated(&x);
        assert!((noise.resolution - 0.01).abs() < 1.0e-9, "{noise:?}");
    }
}
