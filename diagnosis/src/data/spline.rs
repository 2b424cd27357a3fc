//! The cubic spline through samples (de Boor 1978): with a continuous second derivative. Of an oscillation of five samples a period it keeps
//! 99.5 %, a cubic whose slopes are those of chords over two intervals 97 %.

use std::ops::Range;

/// The slopes of the spline at its samples, per second, each piece by itself; straight at the ends of a piece (natural).
pub(crate) fn slopes(t_s: &[f64], x: &[f64], pieces: &[Range<usize>]) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    for piece in pieces.iter().filter(|piece| piece.len() > 1) {
        let (t, x) = (&t_s[piece.clone()], &x[piece.clone()]);
        let last = t.len() - 1;
        let inverse = |k: usize| 1.0 / (t[k + 1] - t[k]);
        let chord = |k: usize| (x[k + 1] - x[k]) * inverse(k);
        // Equation `k`: the factors of the slopes at k - 1, k and k + 1, and the right-hand side.
        let equation = |k: usize| match k {
            0 => (0.0, 2.0, 1.0, 3.0 * chord(0)),
            k if k == last => (1.0, 2.0, 0.0, 3.0 * chord(k - 1)),
            k => {
                let (a, b) = (inverse(k - 1), inverse(k));
                (a, 2.0 * (a + b), b, 3.0 * (a * chord(k - 1) + b * chord(k)))
            }
        };
        // The system is tridiagonal and diagonally dominant: elimination without pivots.
        let (mut upper, mut right) = (Vec::with_capacity(t.len()), Vec::with_capacity(t.len()));
        let (mut above, mut sum) = (0.0, 0.0);
        for k in 0..t.len() {
            let (lower, middle, next, of_sides) = equation(k);
            let pivot = middle - lower * above;
            (above, sum) = (next / pivot, (of_sides - lower * sum) / pivot);
            upper.push(above);
            right.push(sum);
        }
        let mut slope = 0.0;
        for k in (0..t.len()).rev() {
            slope = right[k] - upper[k] * slope;
            out[piece.start + k] = slope;
        }
    }
    out
}

/// Value and slope of the cubic with these values and slopes at both ends of an interval of `h` seconds, `x` of the way (Hermite).
pub(crate) fn hermite([from, to]: [f64; 2], [slope, next]: [f64; 2], h: f64, x: f64) -> [f64; 2] {
    let (a, b) = (h * slope - (to - from), (to - from) - h * next);
    let bend = (1.0 - 2.0 * x) * (a * (1.0 - x) + b * x) + x * (1.0 - x) * (b - a);
    [from + (to - from) * x + x * (1.0 - x) * (a * (1.0 - x) + b * x), (to - from + bend) / h]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillation_of_five_samples_a_period_passes_and_pieces_do_not_see_each_other() {
        let t: Vec<f64> = (0..61).map(|k| 0.02 * f64::from(k)).collect();
        let rate = std::f64::consts::TAU / 0.1;
        let x: Vec<f64> = t.iter().map(|t| (rate * t).sin()).collect();
        let whole = slopes(&t, &x, std::slice::from_ref(&(0..61)));
        for k in 10..50 {
            let middle = hermite([x[k], x[k + 1]], [whole[k], whole[k + 1]], 0.02, 0.5);
            let at = rate * (t[k] + 0.01);
            assert!((middle[0] - at.sin()).abs() < 0.02, "{middle:?} {}", at.sin());
            assert!((middle[1] / rate - at.cos()).abs() < 0.05, "{middle:?} {}", at.cos());
        }
        let mut other = x.clone();
        other[40..].iter_mut().for_each(|x| *x += 7.0);
        let [one, two] = [&x, &other].map(|x| slopes(&t, x, &[0..40, 40..61]));
        assert!(one.iter().zip(&two).all(|(a, b)| (a - b).abs() < 1.0e-9));
        // A line is one whatever the times between samples; a single sample has no slope.
        let uneven = [0.0, 0.1, 0.15, 0.4];
        assert!(
            slopes(&uneven, &uneven.map(|t| 3.0 * t), std::slice::from_ref(&(0..4)))
                .iter()
                .all(|m| (m - 3.0).abs() < 1.0e-12)
        );
        assert_eq!(slopes(&[1.0], &[5.0], std::slice::from_ref(&(0..1))), [0.0]);
    }
}
