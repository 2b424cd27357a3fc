//! `θ = atan(2 w)` and back: what an effective voltage opens the valve, as the paper's flow law has it.
//!
//! Odd polynomials through Chebyshev nodes, on `[0, 1]` and `[0, π/4]`; beyond, `atan x = π/2 − atan 1/x`. Error bounds:
//! 1.2e-7 rad, and 1.2e-7 relative in the voltage with one unit of its format.

use super::Angle;
use super::factor::quotient;
use crate::quantities::Voltage;

/// `π/2` and `π/4`, 28 fractional bits.
const RIGHT: i32 = 421_657_428;
const HALF_RIGHT: i32 = RIGHT / 2;

/// Of `atan(z) / z` in powers of `z²`, 28 fractional bits: error 7.5e-8.
const ARC: [i32; 8] =
    [268_435_429, -89_474_798, 53_604_508, -37_625_484, 26_591_476, -15_936_235, 6_487_062, -1_253_264];
/// Of `tan(x) / x` in powers of `x²`, 28 fractional bits: error 1.8e-8.
const TANGENT: [i32; 7] = [268_435_461, 89_477_741, 35_810_085, 14_312_746, 6_630_530, 736_447, 2_572_982];

/// `x · P(x²)` for `0 <= x <= 1` with 28 fractional bits.
#[inline]
fn odd(x: i32, coefficients: &[i32]) -> i32 {
    // All magnitudes stay below 2^29.
    let times = |a: i32, b: i32| ((i64::from(a) * i64::from(b)) >> 28) as i32;
    let square = times(x, x);
    times(x, coefficients.iter().rev().fold(0, |sum, c| times(sum, square) + c))
}

/// `atan(2 w)`.
#[inline]
pub(crate) fn angle(w: Voltage) -> Angle {
    // 2 |w| with 23 fractional bits.
    let twice = w.to_bits().unsigned_abs();
    let theta =
        if twice <= 1 << 23 { odd((twice << 5) as i32, &ARC) } else { RIGHT - odd(quotient(1 << 23, twice, 28), &ARC) };
    Angle::from_bits(if w < 0 { -theta } else { theta })
}

/// `tan(θ) / 2`, saturated at ±128 V.
#[inline]
pub(crate) fn effective_voltage(theta: Angle) -> Voltage {
    let size = theta.to_bits().unsigned_abs().min(RIGHT as u32) as i32;
    let w = if size <= HALF_RIGHT {
        odd(size, &TANGENT) >> 5
    } else {
        quotient(1 << 28, odd(RIGHT - size, &TANGENT).unsigned_abs(), 23)
    };
    Voltage::from_bits(if theta < 0 { -w } else { w })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_angle_of_a_voltage_and_its_voltage_are_within_their_bounds_everywhere() {
        for step in -200_000..=200_000 {
            // Finely around zero, up to 100 V.
            let volts = 100.0 * (f64::from(step) / 200_000.0).powi(3);
            let w = Voltage::from_num(volts);
            let exact = (2.0 * w.to_num::<f64>()).atan();
            let theta = angle(w);
            assert!((theta.to_num::<f64>() - exact).abs() < 1.2e-7, "{w} V: {theta} against {exact}");
            let back = effective_voltage(theta).to_num::<f64>();
            let exact = theta.to_num::<f64>().tan() / 2.0;
            // Near a right angle the last bit of the angle is what counts.
            let bit = 4e-9 * (1.0 + 4.0 * exact * exact);
            assert!((back - exact).abs() < 1.2e-7 * exact.abs() + 6e-8 + bit, "{theta}: {back} against {exact}");
        }
    }

    #[test]
    fn a_right_angle_saturates() {
        assert_eq!(effective_voltage(Angle::MAX), Voltage::MAX);
        assert_eq!(effective_voltage(Angle::MIN), -Voltage::MAX);
    }
}
