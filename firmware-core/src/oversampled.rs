//! Sums of oversampled conversions → codes.

/// Sixteen 12-bit conversions added up: the largest sum is 16 · 4095.
const LARGEST_SUM: u32 = 16 * 4095;

/// Stretches the sum of sixteen 12-bit conversions, 0..=65 520, over the whole code range 0..=65 535, to the nearest code:
/// `code = round(sum · 65 535 / 65 520) = sum + round(sum / 4368)`. Larger sums, which no converter delivers, saturate.
///
/// Without it a full-scale reading would be 0.02 % low, and the test for a code at the range's end would never see one.
#[inline(always)]
#[must_use]
pub fn code_of_sum(sum: u16) -> u16 {
    const SUMS_PER_EXTRA_CODE: u32 = LARGEST_SUM / (65_535 - LARGEST_SUM);
    let sum = (sum as u32).min(LARGEST_SUM);
    (sum + (sum + SUMS_PER_EXTRA_CODE / 2) / SUMS_PER_EXTRA_CODE) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sum_becomes_the_nearest_code_and_both_ends_are_reached() {
        for sum in 0..=65_520_u16 {
            assert_eq!(code_of_sum(sum), (f64::from(sum) / 65_520.0 * 65_535.0).round() as u16, "sum {sum}");
        }
        assert_eq!([code_of_sum(0), code_of_sum(65_520), code_of_sum(u16::MAX)], [0, 65_535, 65_535]);
    }
}
