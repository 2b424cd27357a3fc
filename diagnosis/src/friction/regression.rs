//! Least squares with the recording as the unit of inference, and the limit of Student's t.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// A value with its standard error and whether the runs establish it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Finding {
    /// Value, SI.
    pub value: f64,
    /// Standard error from the scatter between runs, SI.
    pub std_error: f64,
    /// Beyond the 1 % level of Student's t; in a [`super::FrictionMap`] also better on recordings left out.
    pub established: bool,
}

/// What nothing was recorded of.
pub(super) const NOTHING: Finding = Finding { value: 0.0, std_error: f64::INFINITY, established: false };

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// Least squares of one figure per recording with an intercept, which comes first.
pub(super) fn regress(values: &[f64], by: &[&[f64]]) -> Vec<Finding> {
    let ones = vec![1.0; values.len()];
    let columns: Vec<&[f64]> = std::iter::once(ones.as_slice()).chain(by.iter().copied()).collect();
    proportional(values, &columns).0
}

/// Least squares of one figure per recording without an intercept, and the sum of squares that is left; the errors are
/// those that the scatter between the recordings shows.
pub(super) fn proportional(values: &[f64], by: &[&[f64]]) -> (Vec<Finding>, f64) {
    let (n, k) = (values.len(), by.len());
    let nothing = (vec![NOTHING; k], values.iter().map(|value| value * value).sum());
    if n == 0 {
        return nothing;
    }
    // Columns are scaled to their size: with Pa next to ones the matrix would be singular to working precision.
    let scale: Vec<f64> = by.iter().map(|c| c.iter().fold(1e-30, |m: f64, x| m.max(x.abs()))).collect();
    let x = DMatrix::from_fn(n, k, |row, column| by[column][row] / scale[column]);
    let y = DVector::from_column_slice(values);
    let Some(inverse) = (x.transpose() * &x).try_inverse() else { return nothing };
    let b = &inverse * x.transpose() * &y;
    let residual = (y - &x * &b).norm_squared();
    let free = n.saturating_sub(k);
    let variance = if free > 0 { residual / free as f64 } else { f64::INFINITY };
    let finding = |j: usize| {
        let std_error = (variance * inverse[(j, j)]).sqrt() / scale[j];
        let value = b[j] / scale[j];
        Finding { value, std_error, established: value.abs() > student_1_percent(free) * std_error }
    };
    ((0..k).map(finding).collect(), residual)
}

/// Two-sided 1 % limit of Student's t.
fn student_1_percent(degrees_of_freedom: usize) -> f64 {
    const TABLE: [f64; 10] = [63.66, 9.925, 5.841, 4.604, 4.032, 3.707, 3.499, 3.355, 3.250, 3.169];
    match degrees_of_freedom {
        0 => f64::INFINITY,
        n if n <= TABLE.len() => TABLE[n - 1],
        // Never below the true limit from here on.
        n => 2.576 + 6.0 / n as f64,
    }
}

#[cfg(test)]
mod tests {
    use super::student_1_percent;

    #[test]
    fn the_one_percent_limit_is_never_below_students_and_at_most_one_percent_above() {
        let published = [
            (1, 63.657),
            (2, 9.925),
            (5, 4.032),
            (10, 3.169),
            (11, 3.106),
            (15, 2.947),
            (30, 2.750),
            (60, 2.660),
            (120, 2.617),
        ];
        for (degrees, limit) in published {
            let found = student_1_percent(degrees);
            assert!(found > limit - 0.004 && found < 1.011 * limit, "{degrees}: {found}");
        }
    }
}
