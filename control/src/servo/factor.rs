//! Constants of any size, and the two operations that the law needs beyond sums and products: quotient and root.
//!
//! A constant like `w³` spans five decades over the rigs. So each keeps 31 significant bits with a shift of its own; the formats
//! it converts between are its type, and a product is one 32 × 32 → 64 bit multiplication.

use crate::arithmetic::{multiply, saturate};
use core::marker::PhantomData;
use fixed::traits::Fixed;

/// A constant factor from a quantity of format `A` to one of format `B`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Factor<A, B> {
    mantissa: i32,
    /// Less one, so that rounding needs no shift of its own; 0 to 31, for a shift across the halves of 64 bits costs twice as much.
    shift: u8,
    formats: PhantomData<(A, B)>,
}

/// A part of a factor, of which it keeps the shift.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PartOf(i32);

/// A factor between −1 and 1 in the bits of both formats, like the weight of a new value: no product saturates, and the high
/// half of it is enough. A quarter of a [`Factor`]'s instructions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Share<A, B> {
    mantissa: i32,
    /// Half of `2^shift`.
    half: u16,
    /// 0 to 15.
    shift: u8,
    formats: PhantomData<(A, B)>,
}

/// `value · 2^bits` as a mantissa of at most 31 bits and a shift of at most `most`. Once for all formats: flash is small, and
/// this runs only at start.
#[inline(never)]
fn normalised(value: f64, bits: i32, most: u8) -> (i32, u8) {
    let scale = (1_u64 << bits.unsigned_abs().min(62)) as f64;
    let mut mantissa = if bits < 0 { value / scale } else { value * scale };
    let mut shift = 0;
    while mantissa.abs() < (1_u32 << 30) as f64 && shift < most {
        mantissa *= 2.0;
        shift += 1;
    }
    let half = if mantissa < 0.0 { -0.5 } else { 0.5 };
    // A float's conversion saturates.
    ((mantissa + half) as i32, shift)
}

impl<A: Fixed<Bits = i32>, B: Fixed<Bits = i32>> Factor<A, B> {
    /// For a value in SI units; what is too large saturates.
    pub(crate) fn new(value: f64) -> Self {
        let (mantissa, shift) = normalised(value, B::FRAC_NBITS as i32 - A::FRAC_NBITS as i32 + 1, 31);
        Self { mantissa, shift, formats: PhantomData }
    }

    /// A part of the factor, at most all of it, 28 fractional bits.
    pub(crate) fn part(self, part: i32) -> PartOf {
        PartOf(multiply(self.mantissa, part, 28))
    }

    /// The product, rounded to nearest, before it is saturated.
    #[inline]
    pub(crate) fn wide(self, x: A) -> i64 {
        self.wide_part(x, PartOf(self.mantissa))
    }

    /// The same with a part of this factor.
    #[inline]
    pub(crate) fn wide_part(self, x: A, part: PartOf) -> i64 {
        // At most 2^62 in magnitude before the shift; the mask shows the compiler that the shift stays within a half.
        (((i64::from(x.to_bits()) * i64::from(part.0)) >> (self.shift & 31)) + 1) >> 1
    }

    /// The product, rounded to nearest and saturated.
    #[inline]
    pub(crate) fn of(self, x: A) -> B {
        B::from_bits(saturate(self.wide(x)))
    }
}

impl<A: Fixed<Bits = i32>, B: Fixed<Bits = i32>> Share<A, B> {
    /// For a value in SI units; what is no share saturates.
    pub(crate) fn new(value: f64) -> Self {
        let (mantissa, shift) = normalised(value, B::FRAC_NBITS as i32 - A::FRAC_NBITS as i32 + 31, 15);
        Self { mantissa, half: (1 << shift) >> 1, shift, formats: PhantomData }
    }

    /// The product, rounded to nearest; downwards where the share is more than a half.
    #[inline]
    pub(crate) fn of(self, x: A) -> B {
        let product = ((i64::from(x.to_bits()) * i64::from(self.mantissa)) >> 31) as i32;
        B::from_bits(product.saturating_add(self.half.into()) >> (self.shift & 31))
    }
}

/// `1 / d`, for one quotient or several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reciprocal {
    /// `2^62` over `d` shifted up to 32 bits.
    mantissa: i32,
    zeros: u32,
}

impl Reciprocal {
    /// With a relative error below 2^-26. A `d` of zero counts as one.
    ///
    /// One 32-bit division and a Newton step: a 64-bit division is a library call of some hundred instructions.
    #[inline]
    pub(crate) fn of(d: u32) -> Self {
        let d = d.max(1);
        let zeros = d.leading_zeros();
        let normal = d << zeros;
        // 2^48 / normal to 15 bits; the bit that is set is set anyway, and shows the compiler that the divisor is not zero.
        let first = u32::MAX / ((normal >> 16) | 0x8000);
        // (2^48 − normal · first) / 2^16, below 2^18 in magnitude: 2^32 is nothing in 32 bits.
        let error = (((u64::from(normal) * u64::from(first)) >> 16) as u32).wrapping_neg() as i32;
        // 2^17 · 2^13 at most. Where `normal` is 2^31 the sum is 2^31 − 1.
        let mantissa = ((first << 14) as i32).wrapping_add((first as i32).wrapping_mul(error >> 5) >> 13);
        Self { mantissa, zeros }
    }

    /// `n / d · 2^bits`, saturated; `bits` up to 31.
    #[inline]
    pub(crate) fn times(self, n: i32, bits: u32) -> i32 {
        let product = i64::from(n) * i64::from(self.mantissa);
        let shift = 62 - self.zeros - bits.min(31);
        if shift >= 32 { (product >> 32) as i32 >> (shift & 31) } else { saturate(product >> (shift & 31)) }
    }
}

/// `n / d · 2^bits` with a relative error below 2^-26, saturated; `bits` up to 31. A `d` of zero counts as one.
#[inline]
pub(crate) fn quotient(n: i32, d: u32, bits: u32) -> i32 {
    Reciprocal::of(d).times(n, bits)
}

/// `exp(−x)` with 28 fractional bits for an `x` with 26, to 2e-7: a 64th of it by the series, then squared six times.
#[inline]
pub(crate) fn falling_q28(x: u32) -> i32 {
    const ONE: i64 = 1 << 30;
    // With 30 fractional bits; x is below 32, a 64th of it below one half.
    let x = i64::from(x >> 2).min(ONE / 2);
    let times = |a: i64, b: i64| (a * b + ONE / 2) >> 30;
    let square = times(x, x);
    // No division: in 64 bits it is a library call.
    let (sixth, twenty_fourth) = (const { ONE / 6 }, const { ONE / 24 });
    let mut y = ONE - x + (square >> 1) - times(times(square, x), sixth) + times(times(square, square), twenty_fourth);
    for _ in 0..6 {
        y = times(y, y);
    }
    ((y + 2) >> 2) as i32
}

/// `sqrt(n · 2^26)`: the root of a number with 26 fractional bits, to 2^-15 of its last 16 bits.
///
/// A straight line within 3 %, two of Heron's steps to 16 bits, and one with the remainder for the rest.
#[inline]
pub(crate) fn root_q26(n: u32) -> u32 {
    if n == 0 {
        return 0;
    }
    let zeros = n.leading_zeros() & !1;
    let normal = n << zeros;
    // Of x = normal / 2^30, from 1 to 4: (2 + x) / 3 · 1.0294. The bit that is set shows that no divisor is zero.
    let line = 22_489 + (((normal >> 16) * 44_977) >> 16);
    let heron = |root: u32| (root + normal / (root | 1)) >> 1;
    let root = heron(heron(line)) | 1;
    let rest = normal.wrapping_sub(root.wrapping_mul(root)) as i32;
    ((root << 14).wrapping_add_signed((rest << 13) / root as i32)) >> (1 + zeros / 2)
}

/// `sqrt(a · b)` to 2^-13.
#[inline]
pub(crate) fn root_of_product(a: u32, b: u32) -> u32 {
    if a == 0 || b == 0 {
        return 0;
    }
    // Each is brought to 16 bits; together by an even number of places.
    let (mut by_a, by_b) = (16 - a.leading_zeros() as i32, 16 - b.leading_zeros() as i32);
    by_a += (by_a + by_b) & 1;
    let to = |x: u32, by: i32| if by < 0 { x << -by } else { x >> by };
    let root = (to(a, by_a) * to(b, by_b)).isqrt();
    to(root, -((by_a + by_b) / 2))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantities::{Position, Velocity};
    use proptest::prelude::*;

    #[test]
    fn a_factor_converts_between_formats_and_saturates() {
        let factor = Factor::<Position, Velocity>::new(100.0);
        assert_eq!(factor.of(Position::from_num(0.25)), Velocity::from_num(25));
        assert_eq!(Factor::<Position, Velocity>::new(-1e12).of(Position::MAX), Velocity::MIN);
        assert_eq!(Factor::<Position, Velocity>::new(1e-9).of(Position::from_num(1)), Velocity::ZERO);
    }

    #[test]
    fn a_whole_is_a_share_too() {
        let whole = Share::<Position, Position>::new(1.0);
        for x in [Position::MAX, Position::MIN, Position::ONE] {
            assert!(whole.of(x).abs_diff(x) <= Position::DELTA + Position::DELTA, "{x}");
        }
    }

    #[test]
    fn the_exponential_falls_within_its_bound() {
        for step in 0..40_000 {
            let x = f64::from(step) / 2000.0;
            let found = f64::from(falling_q28((x * f64::exp2(26.0)) as u32)) / f64::exp2(28.0);
            assert!((found - (-x).exp()).abs() < 2e-7, "{x}: {found} against {}", (-x).exp());
        }
    }

    proptest! {
        #[test]
        fn shares_are_right_to_a_bit(x in any::<i32>(), share in -1.0..1.0_f64, small in 0_i32..20) {
            let share = share * f64::from(-small).exp2();
            let found = Share::<Position, Position>::new(share).of(Position::from_bits(x)).to_bits();
            prop_assert!((f64::from(found) - f64::from(x) * share).abs() <= 1.5, "{found}");
        }

        #[test]
        fn quotients_are_right_to_a_part_in_2_to_26(n in any::<i32>(), d in 1_u32.., bits in 0_u32..=31) {
            let exact = f64::from(n) / f64::from(d) * f64::from(bits).exp2();
            let exact = exact.clamp(f64::from(i32::MIN), f64::from(i32::MAX));
            let found = f64::from(quotient(n, d, bits));
            prop_assert!((found - exact).abs() <= exact.abs() * f64::exp2(-26.0) + 1.0, "{found} against {exact}");
        }

        #[test]
        fn roots_of_products_are_right_to_a_part_in_2_to_13(a in any::<u32>(), b in any::<u32>()) {
            let exact = (f64::from(a) * f64::from(b)).sqrt();
            prop_assert!((f64::from(root_of_product(a, b)) - exact).abs() <= exact * f64::exp2(-13.0) + 1.0);
        }

        #[test]
        fn roots_are_right_to_a_part_in_2_to_15_of_their_last_16_bits(n in any::<u32>()) {
            let exact = (f64::from(n) * f64::exp2(26.0)).sqrt();
            prop_assert!((f64::from(root_q26(n)) - exact).abs() <= exact * f64::exp2(-28.0) + 1.0);
        }
    }
}
