//! The median, which no outlier moves, and what it is of a normal variable.

/// Half of a normal variable's magnitudes are below so many standard deviations.
pub(crate) const MEDIAN_OF_NORMAL: f64 = 0.6745;

/// The median, of an even number the upper of the two in the middle; `None` of nothing. Reorders the values.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_values_are_below_the_median() {
        assert_eq!(median(&mut [5.0, 1.0, 9.0]), Some(5.0));
        assert_eq!(median(&mut [4.0, 1.0, 9.0, 2.0]), Some(4.0));
        assert_eq!(median(&mut []), None);
    }
}
