//! The scalar of the model: `f64` on the desktop, `f32` on the microcontroller, one source for both.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number the plant can be computed in.
///
/// Transcendental functions come from `libm` on every platform, never from the platform's own library, so that the
/// desktop and the microcontroller compute the same bits for the same scalar type.
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

macro_rules! impl_real {
    ($scalar:ident, $exp:path, $atan:path, $sin:path, $cos:path, $sqrt:path) => {
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
            fn is_finite(self) -> bool {
                $scalar::is_finite(self)
            }
        }
    };
}

impl_real!(f64, libm::exp, libm::atan, libm::sin, libm::cos, libm::sqrt);
impl_real!(f32, libm::expf, libm::atanf, libm::sinf, libm::cosf, libm::sqrtf);
