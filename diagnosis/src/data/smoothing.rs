//! Local polynomial smoothing of a sampled signal, at its own sampling times.

use core::ops::Range;

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

/// Intervals that differ by less, relatively, count as one: a time in a log has about as many digits.
const SAME_INTERVAL: f64 = 1.0e-6;

/// A signal smoothed twice, as pressures are. The slope is the derivative of what is smoothed, so that `p + tau p'` undoes a lag
/// without a bias.
pub(crate) fn twice(t_s: &[f64], signal: &[f64], reach: Reach) -> Smoothed {
    let once = |signal: &[f64]| -> Vec<f64> {
        let mut out = Vec::with_capacity(signal.len());
        each_window(t_s, reach, |k, window, near| out.push(window.value(signal, k, near)));
        out
    };
    let value = once(&once(signal));
    let slope = slopes(t_s, &value, 0..value.len()).collect();
    Smoothed { value, slope }
}

/// Fits a parabola to the samples within reach on either side of each one (fewer near the ends of the stretch).
///
/// Zero phase; passes signals slower than about one over the whole window and keeps the mean of a kink.
pub(crate) fn parabola(t_s: &[f64], signal: &[f64], reach: Reach) -> Smoothed {
    let mut out = Smoothed::default();
    each_window(t_s, reach, |k, window, near| {
        out.value.push(window.value(signal, k, near.clone()));
        out.slope.push(window.slope(signal, k, near));
    });
    out
}

/// Calls for each sample `with` its number, the parabola of the samples near it, and which these are.
fn each_window(t_s: &[f64], reach: Reach, mut with: impl FnMut(usize, &LocalParabola, Range<usize>)) {
    let (mut first, mut end) = (0, 0);
    // The intervals from sample `equal_from` on are the same up to `end`.
    let (mut equal_from, mut seen, mut interval_s) = (0, 0, 0.0);
    let mut window = LocalParabola::default();
    let mut made_for = None;
    for k in 0..t_s.len() {
        while t_s[first] < t_s[k] - reach.seconds {
            first += 1;
        }
        while end < t_s.len() && t_s[end] <= t_s[k] + reach.seconds {
            end += 1;
        }
        let low = first.min(k.saturating_sub(reach.least));
        let high = end.max(k + reach.least + 1).min(t_s.len());
        while seen + 1 < high {
            let next_s = t_s[seen + 1] - t_s[seen];
            if (next_s - interval_s).abs() > SAME_INTERVAL * interval_s {
                (equal_from, interval_s) = (seen, next_s);
            }
            seen += 1;
        }
        // The same places relative to the sample have the same parabola.
        let places = (low >= equal_from).then_some((k - low, high - low, equal_from));
        if places.is_none() || places != made_for {
            window = LocalParabola::of(&t_s[low..high], t_s[k], window);
            made_for = places;
        }
        with(k, &window, low..high);
    }
}

/// What the samples of a window count in the value and the slope of their least-squares parabola at one time.
#[derive(Default)]
struct LocalParabola {
    value: Vec<f64>,
    slope: Vec<f64>,
}

impl LocalParabola {
    /// Of samples at the times `t_s`, at the time `at_s`; a lower degree where they do not carry one. `room` is overwritten.
    fn of(t_s: &[f64], at_s: f64, room: Self) -> Self {
        let scale_s = ((t_s[t_s.len() - 1] - t_s[0]) * 0.5).max(1.0e-12);
        let x = |t: &f64| (t - at_s) / scale_s;
        let mut s = [t_s.len() as f64, 0.0, 0.0, 0.0, 0.0];
        for x in t_s.iter().map(x) {
            let square = x * x;
            s[1] += x;
            s[2] += square;
            s[3] += square * x;
            s[4] += square * square;
        }
        let [of_value, of_slope] = coefficients(&s);
        let fill = |mut counts: Vec<f64>, c: [f64; 3], unit: f64| {
            counts.clear();
            counts.extend(t_s.iter().map(x).map(|x| (c[0] + x * (c[1] + x * c[2])) * unit));
            counts
        };
        Self { value: fill(room.value, of_value, 1.0), slope: fill(room.slope, of_slope, 1.0 / scale_s) }
    }

    /// The value at sample `k`, from samples `near` it.
    fn value(&self, signal: &[f64], k: usize, near: Range<usize>) -> f64 {
        signal[k] + weighted(&self.value, &signal[near], signal[k])
    }

    /// The slope there, per second.
    fn slope(&self, signal: &[f64], k: usize, near: Range<usize>) -> f64 {
        weighted(&self.slope, &signal[near], signal[k])
    }
}

/// The weighted sum of what samples differ from their centre, which keeps it well conditioned. Four sums side by side: a processor
/// adds to each while it waits for the others.
fn weighted(weights: &[f64], samples: &[f64], centre: f64) -> f64 {
    const LANES: usize = 4;
    let mut sums = [0.0; LANES];
    let (weights, last_weights) = weights.as_chunks::<LANES>();
    let (samples, last_samples) = samples.as_chunks::<LANES>();
    for (w, x) in weights.iter().zip(samples) {
        for lane in 0..LANES {
            sums[lane] += w[lane] * (x[lane] - centre);
        }
    }
    let last: f64 = last_weights.iter().zip(last_samples).map(|(w, x)| w * (x - centre)).sum();
    sums.iter().sum::<f64>() + last
}

/// Central differences of a smooth signal over one piece of it, per second; one-sided at its ends.
pub(crate) fn slopes<'a>(t_s: &'a [f64], signal: &'a [f64], piece: Range<usize>) -> impl Iterator<Item = f64> + 'a {
    piece.clone().map(move |k| {
        let (low, high) = (k.saturating_sub(1).max(piece.start), (k + 1).min(piece.end - 1));
        let duration = t_s[high] - t_s[low];
        if duration > 0.0 { (signal[high] - signal[low]) / duration } else { 0.0 }
    })
}

/// How value and slope of the least-squares parabola follow from the sums of the samples times 1, x and x^2, where `s` has the sums of
/// the powers of x; a lower degree where the samples do not carry one.
fn coefficients(s: &[f64; 5]) -> [[f64; 3]; 2] {
    let m00 = s[2] * s[4] - s[3] * s[3];
    let m01 = s[1] * s[4] - s[2] * s[3];
    let m02 = s[1] * s[3] - s[2] * s[2];
    let determinant = s[0] * m00 - s[1] * m01 + s[2] * m02;
    if determinant.abs() > 1.0e-9 * s[0] * s[2] * s[4] {
        let m11 = s[0] * s[4] - s[2] * s[2];
        let m12 = s[0] * s[3] - s[1] * s[2];
        return [[m00, -m01, m02], [-m01, m11, -m12]].map(|c| c.map(|c| c / determinant));
    }
    let line = s[0] * s[2] - s[1] * s[1];
    if line.abs() > 1.0e-12 {
        return [[s[2], -s[1], 0.0], [-s[1], s[0], 0.0]].map(|c| c.map(|c| c / line));
    }
    [[if s[0] > 0.0 { 1.0 / s[0] } else { 0.0 }, 0.0, 0.0], [0.0; 3]]
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

    #[test]
    fn a_clock_that_changes_its_interval_changes_the_windows_with_it() {
        let mut t_s = vec![0.0];
        for k in 0..300 {
            t_s.push(t_s[k] + if (100..200).contains(&k) { 2.0e-3 } else { 1.0e-3 });
        }
        let parabola_at = |t: &f64| 2.0 - 5.0 * t + 30.0 * t * t;
        let x: Vec<f64> = t_s.iter().map(parabola_at).collect();
        let reach = Reach { seconds: 0.0085, least: 2 };
        let (once, twice) = (parabola(&t_s, &x, reach), twice(&t_s, &x, reach));
        for (k, t) in t_s.iter().enumerate() {
            assert!((once.value[k] - x[k]).abs() < 1.0e-9 && (twice.value[k] - x[k]).abs() < 1.0e-9, "{k}");
            assert!((once.slope[k] - (60.0 * t - 5.0)).abs() < 1.0e-6, "{k}");
        }
    }
}
