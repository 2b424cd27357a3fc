//! The scalar of the model: `f64` on the desktop, `f32` on the microcontroller, one source for both.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number the plant can be computed in.
///
/// Transcendental functions come from `libm` on every platform, never from the platform's own library, so that the
/// desktop and the microcontroller compute the same bits for the same scalar type. With the feature `micromath`, which the
/// firmware's loop switches on wherever it runs, sine and cosine in `f32` come from there, within 1.1e-3.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + SubAssign
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// One half.
    const HALF: Self;
    /// The circle constant.
    const PI: Self;
    /// The nearest representable value to `value`.
    fn of(value: f64) -> Self;
    /// The value widened to `f64`.
    fn to_f64(self) -> f64;
    /// Absolute value.
    fn abs(self) -> Self;
    /// `e` to the power of the value.
    fn exp(self) -> Self;
    /// Arc tangent, in radians.
    fn atan(self) -> Self;
    /// Sine of a value in radians.
    fn sin(self) -> Self;
    /// Cosine of a value in radians.
    fn cos(self) -> Self;
    /// Square root; NaN for negative values.
    fn sqrt(self) -> Self;
    /// Cube root.
    fn cbrt(self) -> Self {
        Self::of(libm::cbrt(self.to_f64()))
    }
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// −1, 0 or +1; unlike the IEEE function, zero has the sign 0.
    #[inline]
    fn sign(self) -> Self {
        if self > Self::ZERO {
            Self::ONE
        } else if self < Self::ZERO {
            -Self::ONE
        } else {
            Self::ZERO
        }
    }
    /// The larger of two values (the second if the first is NaN).
    #[inline]
    fn at_least(self, low: Self) -> Self {
        if self > low { self } else { low }
    }
    /// The smaller of two values (the second if the first is NaN).
    #[inline]
    fn at_most(self, high: Self) -> Self {
        if self < high { self } else { high }
    }
    /// The value limited to `low..=high`.
    #[inline]
    fn limit(self, low: Self, high: Self) -> Self {
        self.at_least(low).at_most(high)
    }
}

/// `e^x`, within 2 units in the last place for `|x| <= 700`; the caller stays within.
///
/// Called in every evaluation of the Stribeck curve, where `libm::exp` (a division, branches, a call to scale) took a
/// third of the time of a slow motion. Plain arithmetic: the same bits on every platform.
#[inline(never)]
fn exponential(x: f64) -> f64 {
    // Adding and subtracting 1.5 * 2^52 rounds to an integer, which then stands in the low bits of the sum.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    // ln 2 in two parts, the first short enough that its multiples are exact.
    const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
    const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
    let shifted = x * core::f64::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = x - n * LN_2_HIGH - n * LN_2_LOW;
    // Taylor's series to r^12 for |r| <= ln(2)/2, summed pairwise so that the terms do not wait for each other.
    let (r2, r4) = (r * r, (r * r) * (r * r));
    let low = (1.0 + r) + r2 * (1.0 / 2.0 + r * (1.0 / 6.0));
    let middle = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0));
    let high = (1.0 / 40_320.0 + r * (1.0 / 362_880.0)) + r2 * (1.0 / 3_628_800.0 + r * (1.0 / 39_916_800.0));
    let series = low + r4 * (middle + r4 * (high + r4 * (1.0 / 479_001_600.0)));
    let exponent = (shifted.to_bits() << 52).wrapping_add(1023 << 52);
    series * f64::from_bits(exponent)
}

/// The cube root, within 2e-14 of its size.
///
/// Called in every evaluation of a flow behind a hose, where `libm::cbrt` took an eighth of the time of a diagnosis: it rounds
/// correctly, with fused multiplications that most processors are not told to have. Plain arithmetic: the same bits on every platform.
#[inline]
fn cube_root(x: f64) -> f64 {
    // A third of the exponent, as in the C library of FreeBSD: within 3.4 %.
    const BIAS: u64 = 715_094_163 << 32;
    if !(f64::MIN_POSITIVE..=f64::MAX).contains(&x) {
        return libm::cbrt(x);
    }
    let mut root = f64::from_bits(x.to_bits() / 3 + BIAS);
    // Each of Halley's steps leaves two thirds of the relative error's cube.
    for _ in 0..2 {
        let cube = root * root * root;
        root *= (x + x + cube) / (x + cube + cube);
    }
    root
}

macro_rules! impl_real {
    ($scalar:ident, $exp:path, $atan:path, $sin:path, $cos:path, $sqrt:path, $cbrt:path) => {
        impl Real for $scalar {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const HALF: Self = 0.5;
            const PI: Self = core::$scalar::consts::PI;
            #[inline]
            fn of(value: f64) -> Self {
                value as $scalar
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn abs(self) -> Self {
                $scalar::abs(self)
            }
            #[inline]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline]
            fn atan(self) -> Self {
                $atan(self)
            }
            #[inline]
            fn sin(self) -> Self {
                $sin(self)
            }
            #[inline]
            fn cos(self) -> Self {
                $cos(self)
            }
            #[inline]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline]
            fn cbrt(self) -> Self {
                $cbrt(self)
            }
            #[inline]
            fn is_finite(self) -> bool {
                $scalar::is_finite(self)
            }
        }
    };
}

impl_real!(f64, exponential, libm::atan, libm::sin, libm::cos, libm::sqrt, cube_root);
#[cfg(not(feature = "micromath"))]
impl_real!(f32, libm::expf, libm::atanf, libm::sinf, libm::cosf, libm::sqrtf, libm::cbrtf);
// libm's sine computes in `f64`, which the Cortex-M4F has no instructions for.
#[cfg(feature = "micromath")]
impl_real!(f32, libm::expf, libm::atanf, micromath::F32Ext::sin, micromath::F32Ext::cos, libm::sqrtf, libm::cbrtf);
