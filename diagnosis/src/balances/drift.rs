//! Slow drift of the supply, as a compressor makes it that starts and stops behind its regulator. The valve is fed with the pressure as
//! measured, so a drift is no gap of the model: it is a cubic spline with equal steps between its knots (B-splines, de Boor 1978), fitted
//! to what the prediction is off by in all of the log. Its mean over the part that is fitted is zero, as a constant is the regulator's setting.

use nalgebra::{DMatrix, DVector};
use std::ops::Range;

/// How fast a drift may be.
#[derive(Clone, Copy)]
pub(super) struct Pace {
    /// It has a knot every so many seconds. Of a period of four steps the spline keeps 99 %.
    knot_s: f64,
    /// At most so many steps between knots: a longer log has them farther apart.
    most_steps: f64,
}

impl Pace {
    /// Slow against a droop, which takes less than a second.
    pub(super) const SLOW: Self = Self { knot_s: 5.0, most_steps: 60.0 };
    /// As fast as a vessel empties, and a compressor starts and stops: beside it a droop would hide.
    pub(super) const FAST: Self = Self { knot_s: 0.5, most_steps: 300.0 };
}

/// A drift by row of a log, Pa, and what its size costs: half the sum of the squares of the spline's coefficients, in standard deviations.
pub(crate) struct Drift {
    pub(crate) off_pa: Vec<f64>,
    pub(super) cost: f64,
}

/// The four cubic B-splines that are not zero at a part of a step between knots.
fn splines(x: f64) -> [f64; 4] {
    let rest = 1.0 - x;
    let near = |x: f64| (3.0 * x - 6.0) * x * x + 4.0;
    [rest.powi(3), near(x), near(rest), x.powi(3)].map(|value| value / 6.0)
}

/// The likeliest drift: at times in s the prediction is off by so many Pa (not finite where that is not known), of which the sensor's
/// noise has a standard deviation of `noise_pa`; the drift one of `usual_pa`. Its mean is zero over the samples in `level`.
pub(super) fn drift(
    (t_s, off_pa): (&[f64], &[f64]),
    level: impl Iterator<Item = Range<usize>>,
    [noise_pa, usual_pa]: [f64; 2],
    pace: Pace,
) -> Drift {
    let none = || Drift { off_pa: vec![0.0; t_s.len()], cost: 0.0 };
    let (Some(first), Some(last)) = (t_s.first(), t_s.last()) else { return none() };
    let step_s = pace.knot_s.max((last - first) / pace.most_steps);
    let place = |t_s: &f64| {
        let steps = (t_s - first) / step_s;
        (steps as usize, splines(steps.fract()))
    };
    let count = ((last - first) / step_s) as usize + 4;
    let (mut squares, mut products) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
    let (mut sums, mut sum, mut all) = (DVector::<f64>::zeros(count), 0.0, 0.0);
    // Sums of the splines over the samples that say where zero is.
    let (mut means, mut rows) = (DVector::<f64>::zeros(count), 0.0);
    let mut is_level = vec![false; t_s.len()];
    level.for_each(|range| is_level[range].fill(true));
    for ((t_s, off_pa), is_level) in t_s.iter().zip(off_pa).zip(is_level).filter(|((_, off_pa), _)| off_pa.is_finite())
    {
        let (at, values) = place(t_s);
        for (i, value) in values.into_iter().enumerate() {
            products[at + i] += value * off_pa;
            sums[at + i] += value;
            means[at + i] += if is_level { value } else { 0.0 };
            values[..=i].iter().enumerate().for_each(|(j, other)| squares[(at + i, at + j)] += value * other);
        }
        sum += off_pa;
        all += 1.0;
        rows += if is_level { 1.0 } else { 0.0 };
    }
    if rows == 0.0 {
        return none();
    }
    means /= rows;
    // Least squares of splines less their means, with a penalty on their size; the decomposition reads the lower triangle.
    squares += &means * means.transpose() * all - &means * sums.transpose() - &sums * means.transpose();
    products -= &means * sum;
    let penalty = (noise_pa / usual_pa).powi(2);
    squares += DMatrix::from_diagonal_element(count, count, penalty);
    let Some(coefficients) = squares.cholesky().map(|factors| factors.solve(&products)) else { return none() };
    let mean_pa = means.dot(&coefficients);
    let drift_pa = |t_s: &f64| {
        let (at, values) = place(t_s);
        values.iter().zip(coefficients.iter().skip(at)).map(|(value, c)| value * c).sum::<f64>() - mean_pa
    };
    Drift { off_pa: t_s.iter().map(drift_pa).collect(), cost: 0.5 * (coefficients.norm() / usual_pa).powi(2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_AND_USUAL_PA: [f64; 2] = [300.0, 2.0e4];

    fn times_s() -> Vec<f64> {
        (0..40_000).map(|k| 1.7e9 + 1.0e-3 * f64::from(k)).collect()
    }

    #[test]
    fn a_compressor_s_cycle_is_followed_and_steps_of_a_second_are_not() {
        let t_s = times_s();
        let off = |period_s: f64| {
            let wave = |t: &f64| 7.0e3 * (core::f64::consts::TAU * (t - t_s[0]) / period_s).sin();
            let of_sensor: Vec<f64> = t_s.iter().map(wave).collect();
            let found = drift((&t_s, &of_sensor), std::iter::once(0..t_s.len()), NOISE_AND_USUAL_PA, Pace::SLOW);
            let pairs = found.off_pa.iter().zip(&of_sensor);
            (pairs.map(|(found, true_)| (found - true_).powi(2)).sum::<f64>() / 40_000.0).sqrt()
        };
        // 58 Pa of 7 kPa at 20 s; nothing of it at 1 s.
        assert!(off(20.0) < 100.0 && off(1.0) > 4.9e3, "{} {}", off(20.0), off(1.0));
    }

    #[test]
    fn a_constant_is_no_drift_and_what_is_not_known_does_not_count() {
        let t_s = times_s();
        let mut off_pa = vec![5.0e3; t_s.len()];
        off_pa[100..200].fill(f64::NAN);
        let found = drift((&t_s, &off_pa), std::iter::once(0..t_s.len()), NOISE_AND_USUAL_PA, Pace::SLOW);
        assert!(found.off_pa.iter().all(|off| off.abs() < 1.0e-3) && found.cost < 1.0e-9, "{}", found.cost);
        for (t_s, off_pa) in [(&[][..], &[][..]), (&[1.0], &[2.0]), (&[1.0, 2.0], &[f64::NAN, f64::NAN])] {
            let found = drift((t_s, off_pa), std::iter::once(0..t_s.len()), NOISE_AND_USUAL_PA, Pace::SLOW);
            assert!(found.off_pa.len() == t_s.len() && found.off_pa.iter().all(|off| *off == 0.0));
        }
    }
}
