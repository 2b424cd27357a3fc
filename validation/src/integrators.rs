//! Two textbook integrators with error control for autonomous systems x' = f(x) of `N` equations. They have nothing in common
//! with each other or with `plant-model`'s stepper: one is explicit, the other implicit.

/// An error scale that cannot be met: the solution grows without bound, or the rates are not numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepTooSmall;

/// Accepted error of component `i` per step: `relative * (|x_i| + scale_i)`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Accuracy<const N: usize> {
    /// Relative tolerance.
    pub(crate) relative: f64,
    /// The size of each component that counts as ordinary, in its unit.
    pub(crate) scale: [f64; N],
}

impl<const N: usize> Accuracy<N> {
    /// Largest ratio of error to accepted error; above 1 a step is repeated.
    fn excess(&self, error: &[f64; N], before: &[f64; N], after: &[f64; N]) -> f64 {
        (0..N).fold(0.0, |worst: f64, i| {
            let accepted = self.relative * (before[i].abs().max(after[i].abs()) + self.scale[i]);
            let ratio = error[i].abs() / accepted;
            // `max` would drop a NaN.
            if ratio.is_nan() { f64::INFINITY } else { worst.max(ratio) }
        })
    }
}

/// One step of size `h` from `x`: where it leads, and an estimate of its error.
pub(crate) trait OneStep<const N: usize> {
    /// The error of a step grows as `h` to this power.
    const ERROR_ORDER: i32;
    /// Largest factor by which a step may exceed the one before.
    const GROWTH: f64 = 5.0;

    /// The state after `h` and the estimated error of each component.
    fn step(f: &impl Fn(&[f64; N]) -> [f64; N], x: &[f64; N], h: f64, scale: &[f64; N]) -> ([f64; N], [f64; N]);

    /// Integrates over `duration`. `h` is the first step to try, and afterwards the one that suggests itself next.
    ///
    /// # Errors
    /// [`StepTooSmall`] where no step is accurate.
    fn advance(
        f: &impl Fn(&[f64; N]) -> [f64; N],
        x: [f64; N],
        duration: f64,
        h: &mut f64,
        accuracy: &Accuracy<N>,
    ) -> Result<[f64; N], StepTooSmall> {
        let (mut x, mut left) = (x, duration);
        while left > 0.0 {
            let last = *h >= left;
            let tried = if last { left } else { *h };
            let (next, error) = Self::step(f, &x, tried, &accuracy.scale);
            let excess = accuracy.excess(&error, &x, &next);
            let factor = (0.9 * excess.powf(-1.0 / f64::from(Self::ERROR_ORDER))).clamp(0.2, Self::GROWTH);
            if excess <= 1.0 {
                (x, left) = (next, if last { 0.0 } else { left - tried });
                // A step cut short by the end says little about the longest one that would do.
                *h = if last { h.max(tried * factor) } else { tried * factor };
            } else if tried > 1.0e-12 * duration {
                *h = tried * factor;
            } else {
                return Err(StepTooSmall);
            }
        }
        Ok(x)
    }
}

/// `x + h Σ weight_i rates_i`.
fn moved<const N: usize>(x: &[f64; N], h: f64, rates: &[[f64; N]], weights: &[f64]) -> [f64; N] {
    std::array::from_fn(|i| x[i] + h * rates.iter().zip(weights).map(|(rate, weight)| weight * rate[i]).sum::<f64>())
}

/// Explicit Runge-Kutta method of order 5 with an embedded one of order 4 (Dormand and Prince 1980; Hairer, Nørsett and Wanner,
/// *Solving Ordinary Differential Equations I*, table II.5.2).
#[derive(Clone, Copy, Debug)]
pub(crate) struct DormandPrince;

impl DormandPrince {
    /// Weights of the rates found so far for the points at which the next ones are taken; the last row is the result.
    const STAGES: [&[f64]; 6] = [
        &[1.0 / 5.0],
        &[3.0 / 40.0, 9.0 / 40.0],
        &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
        &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
        &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
        &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
    ];
    /// Order 5 minus order 4.
    const ERROR: [f64; 7] =
        [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];
}

impl<const N: usize> OneStep<N> for DormandPrince {
    const ERROR_ORDER: i32 = 5;

    fn step(f: &impl Fn(&[f64; N]) -> [f64; N], x: &[f64; N], h: f64, _scale: &[f64; N]) -> ([f64; N], [f64; N]) {
        let mut rates = [f(x); 7];
        let mut next = *x;
        for (found, weights) in Self::STAGES.iter().enumerate() {
            next = moved(x, h, &rates[..=found], weights);
            rates[found + 1] = f(&next);
        }
        (next, moved(&[0.0; N], h, &rates, &Self::ERROR))
    }
}

/// Linearly implicit Euler steps of h/1 … h/4, extrapolated to order 4 (Deuflhard 1983; Hairer and Wanner, *Solving Ordinary
/// Differential Equations II*, section IV.9). The Jacobian is taken by central differences: its error costs stability, not order. More steps would
/// raise the order, but at the kinks of the friction law a higher order trusts its own error estimate too much.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExtrapolatedEuler;

impl<const N: usize> OneStep<N> for ExtrapolatedEuler {
    const ERROR_ORDER: i32 = 4;
    const GROWTH: f64 = 2.0;

    fn step(f: &impl Fn(&[f64; N]) -> [f64; N], x: &[f64; N], h: f64, scale: &[f64; N]) -> ([f64; N], [f64; N]) {
        const COLUMNS: usize = 4;
        let jacobian = jacobian(f, x, scale);
        // The last row of the Aitken-Neville scheme so far: `row[k]` is of order k + 1.
        let mut row: Vec<[f64; N]> = Vec::with_capacity(COLUMNS);
        let mut error = [f64::INFINITY; N];
        for substeps in 1..=COLUMNS {
            let part = h / substeps as f64;
            let matrix: [[f64; N]; N] =
                std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j) - part * jacobian[i][j]));
            let Some(solver) = Factors::of(matrix) else { return (*x, error) };
            let mut end = *x;
            for _ in 0..substeps {
                let change = solver.solve(f(&end).map(|rate| part * rate));
                end = std::array::from_fn(|i| end[i] + change[i]);
            }
            let mut diagonal = end;
            for k in 1..substeps {
                let ratio = substeps as f64 / (substeps - k) as f64;
                let better = std::array::from_fn(|i| diagonal[i] + (diagonal[i] - row[k - 1][i]) / (ratio - 1.0));
                row[k - 1] = std::mem::replace(&mut diagonal, better);
            }
            if let Some(last) = row.last() {
                error = std::array::from_fn(|i| diagonal[i] - last[i]);
            }
            row.push(diagonal);
        }
        (row[COLUMNS - 1], error)
    }
}

fn jacobian<const N: usize>(f: &impl Fn(&[f64; N]) -> [f64; N], x: &[f64; N], scale: &[f64; N]) -> [[f64; N]; N] {
    let mut matrix = [[0.0; N]; N];
    for j in 0..N {
        let step = 1.0e-6 * scale[j];
        let at = |x_j: f64| {
            let mut shifted = *x;
            shifted[j] = x_j;
            f(&shifted)
        };
        let (ahead, behind) = (at(x[j] + step), at(x[j] - step));
        for i in 0..N {
            matrix[i][j] = (ahead[i] - behind[i]) / (2.0 * step);
        }
    }
    matrix
}

/// A square matrix, factored with row exchanges.
struct Factors<const N: usize> {
    matrix: [[f64; N]; N],
    rows: [usize; N],
}

impl<const N: usize> Factors<N> {
    /// Nothing where the matrix is singular.
    fn of(mut matrix: [[f64; N]; N]) -> Option<Self> {
        let mut rows = std::array::from_fn(|i| i);
        for k in 0..N {
            let pivot = (k..N).max_by(|a, b| matrix[*a][k].abs().total_cmp(&matrix[*b][k].abs()))?;
            matrix.swap(k, pivot);
            rows.swap(k, pivot);
            let divisor = matrix[k][k];
            if divisor == 0.0 || !divisor.is_finite() {
                return None;
            }
            let row = matrix[k];
            for below in &mut matrix[k + 1..] {
                let factor = below[k] / divisor;
                below[k] = factor;
                for (value, above) in below.iter_mut().zip(&row).skip(k + 1) {
                    *value -= factor * above;
                }
            }
        }
        Some(Self { matrix, rows })
    }

    fn solve(&self, right: [f64; N]) -> [f64; N] {
        let mut x: [f64; N] = self.rows.map(|row| right[row]);
        for i in 1..N {
            x[i] -= (0..i).map(|j| self.matrix[i][j] * x[j]).sum::<f64>();
        }
        for i in (0..N).rev() {
            x[i] = (x[i] - (i + 1..N).map(|j| self.matrix[i][j] * x[j]).sum::<f64>()) / self.matrix[i][i];
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kepler(x: &[f64; 4]) -> [f64; 4] {
        let cube = (x[0] * x[0] + x[1] * x[1]).powf(1.5);
        [x[2], x[3], -x[0] / cube, -x[1] / cube]
    }

    /// Kepler's orbit of eccentricity 1/2 at eccentric anomaly `e`: the time, and x, y and their rates.
    fn on_orbit(e: f64) -> (f64, [f64; 4]) {
        let (b, rate) = (0.75_f64.sqrt(), 1.0 / (1.0 - 0.5 * e.cos()));
        (e - 0.5 * e.sin(), [e.cos() - 0.5, b * e.sin(), -rate * e.sin(), b * rate * e.cos()])
    }

    fn largest<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// How far off a part of an orbit ends after `count` equal steps.
    fn orbit<M: OneStep<4>>(count: u32) -> f64 {
        let ((_, start), (duration, end)) = (on_orbit(0.0), on_orbit(2.0));
        let h = duration / f64::from(count);
        largest(&(0..count).fold(start, |x, _| M::step(&kepler, &x, h, &[1.0; 4]).0), &end)
    }

    fn order<M: OneStep<4>>(count: u32) -> f64 {
        (orbit::<M>(count) / orbit::<M>(2 * count)).log2()
    }

    #[test]
    fn halving_the_step_divides_the_error_by_two_to_the_order() {
        let (explicit, implicit) = (order::<DormandPrince>(300), order::<ExtrapolatedEuler>(200));
        assert!((explicit - 5.0).abs() < 0.3, "{explicit}");
        assert!((implicit - 4.0).abs() < 0.4, "{implicit}");
    }

    /// `exp(-k t)` beside `cos`, `sin` and a decay 1000 times as fast towards the cosine.
    fn decays(x: &[f64; 4]) -> [f64; 4] {
        [-2.0 * x[0], -x[2], x[1], 1000.0 * (x[1] - x[3]) - x[2]]
    }

    fn known_solution_is_met_within_tolerance<M: OneStep<4>>() {
        for relative in [1e-6, 1e-8, 1e-10] {
            let accuracy = Accuracy { relative, scale: [1.0; 4] };
            let (mut x, mut h) = ([1.0, 1.0, 0.0, 1.0], 1e-3);
            for second in 1..=5 {
                x = M::advance(&decays, x, 1.0, &mut h, &accuracy).expect("bounded");
                let t = f64::from(second);
                let error = largest(&x, &[(-2.0 * t).exp(), t.cos(), t.sin(), t.cos()]);
                assert!(error < 100.0 * relative, "{relative:e} at {t}: {error:e}");
            }
        }
    }

    #[test]
    fn the_explicit_method_meets_a_known_solution_within_its_tolerance() {
        known_solution_is_met_within_tolerance::<DormandPrince>();
    }

    #[test]
    fn the_implicit_method_meets_a_known_solution_within_its_tolerance() {
        known_solution_is_met_within_tolerance::<ExtrapolatedEuler>();
    }

    #[test]
    fn a_solution_that_grows_without_bound_is_an_error() {
        let square = |x: &[f64; 1]| [x[0] * x[0]];
        let accuracy = Accuracy { relative: 1e-6, scale: [1.0] };
        assert_eq!(DormandPrince::advance(&square, [1.0], 2.0, &mut 1e-3, &accuracy), Err(StepTooSmall));
        assert_eq!(ExtrapolatedEuler::advance(&square, [1.0], 2.0, &mut 1e-3, &accuracy), Err(StepTooSmall));
    }
}
