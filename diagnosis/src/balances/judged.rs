//! An error of prediction that counts. NaN stands for samples that do not; a model that predicts no number has failed.

/// What a failed prediction counts as, in standard deviations of the noise: farther off than any sensor can read.
const FAILED: f64 = 1.0e6;

/// An error that counts, in standard deviations.
#[inline]
pub(crate) fn judged(error: f64) -> f64 {
    if error.is_finite() { error.clamp(-FAILED, FAILED) } else { FAILED }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prediction_of_no_number_is_never_a_good_fit() {
        for failed in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(judged(failed), FAILED);
        }
        assert_eq!((judged(-2.5), judged(-1.0e9)), (-2.5, -FAILED));
    }
}
