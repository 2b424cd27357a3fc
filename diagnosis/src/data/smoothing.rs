//! Local polynomial smoothing of a sampled signal, at its own sampling times.

/// Value and slope of a signal, sample by sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct Smoothed {
    /// Smoothed signal.
    pub(crate) value: Vec<f64>,
    /// First derivative, per second.
    pub(crate) slope: Vec<f64>,
}

/// Half the window of a local parabola.
#[derive(Clone, Copy)]
pub(crate) struct Reach {
    /// On either side, s.
    pub(crate) seconds: f64,
    /// No fewer samples on either side, however far apart.
    pub(crate) least: usize,
}

impl Reach {
    /// About so many seconds of samples that usually come every `interval_s`; halfway to the next sample, so that a clock
    /// that is a little off does not change their number.
    pub(crate) fn new(seconds: f64, interval_s: f64, least: usize) -> Self {
        let interval_s = interval_s.max(1.0e-6);
        Self { seconds: ((seconds / interval_s).round() + 0.5) * interval_s, least }
    }

    /// Usual number of samples on either side.
    pub(crate) fn samples(&self, interval_s: f64) -> usize {
        ((self.seconds / interval_s.max(1.0e-6)) as usize).max(self.least)
    }
}

/// A signal smoothed twice, as pressures are. The slope is the derivative of what is smoothed, so that `p + tau p'` undoes a lag
/// without a bias.
pub(crate) fn twice(t_s: &[f64], signal: &[f64], reach: Reach) -> Smoothed {
    let value = parabola(t_s, &parabola(t_s, signal, reach).value, reach).value;
    let slope = slopes(t_s, &value, 0..value.len()).collect();
    Smoothed { value, slope }
}

/// Fits a parabola to the samples within reach on either side of each one (fewer near the ends of the stretch).
///
/// Zero phase; passes signals slower than about one over the whole window and keeps the mean of a kink.
pub(crate) fn parabola(t_s: &[f64], signal: &[f64], reach: Reach) -> Smoothed {
    let mut out = Smoothed::default();
    let (mut first, mut end) = (0, 0);
    for k in 0..signal.len() {
        while t_s[first] < t_s[k] - reach.seconds {
            first += 1;
        }
        while end < signal.len() && t_s[end] <= t_s[k] + reach.seconds {
            end += 1;
        }
        let low = first.min(k.saturating_sub(reach.least));
        let high = end.max(k + reach.least + 1).min(signal.len());
        let scale = ((t_s[high - 1] - t_s[low]) * 0.5).max(1.0e-12);
        let inverse = 1.0 / scale;
        let mut s = [(high - low) as f64, 0.0, 0.0, 0.0, 0.0];
        let mut b = [0.0f64; 3];
        for (t, value) in t_s[low..high].iter().zip(&signal[low..high]) {
            let x = (t - t_s[k]) * inverse;
            // Differences to the centre keep the sums well conditioned.
            let d = value - signal[k];
            let x2 = x * x;
            s[1] += x;
            s[2] += x2;
            s[3] += x2 * x;
            s[4] += x2 * x2;
            b[0] += d;
            b[1] += d * x;
            b[2] += d * x2;
        }
        let (value, slope) = solve(&s, &b);
        out.value.push(signal[k] + value);
        out.slope.push(slope * inverse);
    }
    out
}

/// Central differences of a smooth signal over one piece of it, per second; one-sided at its ends.
pub(crate) fn slopes<'a>(
    t_s: &'a [f64],
    signal: &'a [f64],
    piece: core::ops::Range<usize>,
) -> impl Iterator<Item = f64> + 'a {
    piece.clone().map(move |k| {
        let (low, high) = (k.saturating_sub(1).max(piece.start), (k + 1).min(piece.end - 1));
        let duration = t_s[high] - t_s[low];
        if duration > 0.0 { (signal[high] - signal[low]) / duration } else { 0.0 }
    })
}

/// The first two coefficients of the least-squares parabola; a lower degree where the samples do not carry one.
fn solve(s: &[f64; 5], b: &[f64; 3]) -> (f64, f64) {
    let m00 = s[2] * s[4] - s[3] * s[3];
    let m01 = s[1] * s[4] - s[2] * s[3];
    let m02 = s[1] * s[3] - s[2] * s[2];
    let determinant = s[0] * m00 - s[1] * m01 + s[2] * m02;
    if determinant.abs() > 1.0e-9 * s[0] * s[2] * s[4] {
        let value = (b[0] * m00 - b[1] * m01 + b[2] * m02) / determinant;
        let m11 = s[0] * s[4] - s[2] * s[2];
        let m12 = s[0] * s[3] - s[1] * s[2];
        let slope = (-b[0] * m01 + b[1] * m11 - b[2] * m12) / determinant;
        return (value, slope);
    }
    let line = s[0] * s[2] - s[1] * s[1];
    if line.abs() > 1.0e-12 {
        return ((b[0] * s[2] - b[1] * s[1]) / line, (s[0] * b[1] - s[1] * b[0]) / line);
    }
    (if s[0] > 0.0 { b[0] / s[0] } else { 0.0 }, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_passes_unchanged_even_at_irregular_times() {
        let t: Vec<f64> = (0..200).map(|k| 1.0e-3 * k as f64 + 2.0e-4 * ((k * 7) % 5) as f64).collect();
        let x: Vec<f64> = t.iter().map(|t| 1.0 + 3.0 * t - 20.0 * t * t).collect();
        let out = parabola(&t, &x, Reach { seconds: 0.01, least: 2 });
        for k in 0..t.len() {
            assert!((out.value[k] - x[k]).abs() < 1.0e-9);
            assert!((out.slope[k] - (3.0 - 40.0 * t[k])).abs() < 1.0e-6);
        }
    }
}
