//! What the tick needs beyond `fixed`'s own operations: limits without a panic, products that round to nearest and saturate; and how
//! its constants come from floats.
//!
//! `fixed`'s `*` wraps silently in release builds and truncates; its `saturating_mul` costs 28 instructions on a
//! Cortex-M4. A 32 × 32 → 64 bit product with a shift and a clamp costs about ten.

use fixed::traits::Fixed;

/// The value within `low..=high`; `high` if they are crossed. Unlike `Ord::clamp` this cannot panic, so that no panic is linked
/// into the control interrupt on account of limits that the configuration's checks keep in order anyway.
#[inline]
pub(crate) fn limit<T: Ord>(value: T, low: T, high: T) -> T {
    value.max(low).min(high)
}

/// Clamps a 64-bit intermediate into 32 bits.
///
/// Written with the halves: the sum is zero exactly where the high half repeats the low one's sign. That takes four instructions
/// of a Cortex-M4, against twelve of two comparisons in 64 bits.
#[inline]
pub(crate) const fn saturate(value: i64) -> i32 {
    let (low, high) = (value as i32, (value >> 32) as i32);
    if high.wrapping_add((low as u32 >> 31) as i32) == 0 { low } else { (high >> 31) ^ i32::MAX }
}

/// `a · b / 2^shift`, rounded to nearest (ties up), saturated. `shift` is 1..=62.
#[inline]
pub(crate) const fn multiply(a: i32, b: i32, shift: u32) -> i32 {
    // |a·b| <= 2^62, so adding half a unit cannot overflow.
    saturate((a as i64 * b as i64 + (1 << (shift - 1))) >> shift)
}

/// `value · 2^fraction`, rounded to nearest; a float's conversion saturates.
pub(crate) const fn scaled(value: f64, fraction: u32) -> i64 {
    let scaled = value * (1_u64 << fraction) as f64;
    (if scaled < 0.0 { scaled - 0.5 } else { scaled + 0.5 }) as i64
}

/// The same in 32 bits. Once for all formats: flash is small, and outside of constants this runs only at start.
#[inline(never)]
pub(crate) const fn bits(value: f64, fraction: u32) -> i32 {
    saturate(scaled(value, fraction))
}

/// A value in SI units in its format, rounded to nearest and saturated.
pub(crate) fn fixed<T: Fixed<Bits = i32>>(value: f64) -> T {
    T::from_bits(bits(value, T::FRAC_NBITS))
}

/// A product whose shift follows from the formats, rounded to nearest, saturated. `fixed`'s own wide product with a
/// saturating conversion takes 20 to 26 instructions on a Cortex-M4, this takes 15.
#[inline]
pub(crate) fn product<A, B, C>(a: A, b: B) -> C
where
    A: Fixed<Bits = i32>,
    B: Fixed<Bits = i32>,
    C: Fixed<Bits = i32>,
{
    C::from_bits(multiply(a.to_bits(), b.to_bits(), A::FRAC_NBITS + B::FRAC_NBITS - C::FRAC_NBITS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantities::Voltage;

    #[test]
    fn what_does_not_fit_into_32_bits_is_clamped() {
        for middle in
            [0, i64::from(i32::MAX), i64::from(i32::MIN), 1 << 32, -(1 << 32), 1 << 62, i64::MIN + 3, i64::MAX - 3]
        {
            for value in (-3..=3).map(|by| middle.saturating_add(by)) {
                let clamped = value.clamp(i64::from(i32::MIN), i64::from(i32::MAX));
                assert_eq!(i64::from(saturate(value)), clamped, "{value}");
            }
        }
    }

    #[test]
    fn floats_are_rounded_to_nearest_and_saturate() {
        assert_eq!([1.49, 1.5, -1.49, -1.5].map(|value| bits(value, 0)), [1, 2, -1, -2]);
        assert_eq!([0.25, -0.25].map(fixed::<Voltage>), [Voltage::lit("0.25"), Voltage::lit("-0.25")]);
        assert_eq!([1e300, -1e300, f64::NAN].map(fixed::<Voltage>), [Voltage::MAX, Voltage::MIN, Voltage::ZERO]);
    }

    #[test]
    fn products_saturate_in_both_directions_and_round_to_nearest() {
        assert_eq!(multiply(i32::MIN, i32::MIN, 16), i32::MAX);
        assert_eq!(multiply(i32::MIN, i32::MAX, 16), i32::MIN);
        assert_eq!(multiply(i32::MIN, i32::MIN, 62), 1);
        assert_eq!((multiply(3, 1, 1), multiply(-3, 1, 1)), (2, -1));
        assert_eq!((multiply(5, 1, 2), multiply(-5, 1, 2)), (1, -1));
    }
}
