//! The valve's dead zone (3.1): for a range of commands the spool's overlap lets no air through.

use crate::real::Real;

/// Break-points and slopes of (3.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadZone<R> {
    /// Right break-point `z_md`, V.
    pub right_v: R,
    /// Left break-point `z_me`, V; not above the right one.
    pub left_v: R,
    /// Slope right of the dead zone `md`.
    pub slope_right: R,
    /// Slope left of the dead zone `me`.
    pub slope_left: R,
    /// How far from a break-point its rounding reaches on either side, V; 0 for the sharp corners of (3.1).
    pub rounding_v: R,
}

impl<R: Real> DeadZone<R> {
    /// The effective command `w` in V for a spool position `u` in V (3.1).
    #[inline]
    #[must_use]
    pub fn output_v(&self, u: R) -> R {
        if self.rounding_v > R::ZERO {
            return self.rounded(u).0;
        }
        if u >= self.right_v {
            self.slope_right * (u - self.right_v)
        } else if u <= self.left_v {
            self.slope_left * (u - self.left_v)
        } else {
            R::ZERO
        }
    }

    /// Derivative `dw/du`; zero inside the dead zone.
    #[inline]
    #[must_use]
    pub fn gain(&self, u: R) -> R {
        if self.rounding_v > R::ZERO {
            return self.rounded(u).1;
        }
        if u >= self.right_v {
            self.slope_right
        } else if u <= self.left_v {
            self.slope_left
        } else {
            R::ZERO
        }
    }

    /// The same zone with both break-points further out by `overlap_v`, or nearer by a negative one until they meet.
    #[must_use]
    pub fn widened(&self, overlap_v: R) -> Self {
        let half_v = (self.right_v - self.left_v) * R::HALF;
        let overlap_v = overlap_v.at_least(-half_v);
        Self { right_v: self.right_v + overlap_v, left_v: self.left_v - overlap_v, ..*self }
    }

    /// `w` and `dw/du` with rounded corners. The two sides add up, where the roundings meet.
    #[inline(never)]
    fn rounded(&self, u: R) -> (R, R) {
        let right = self.beyond_corner(u - self.right_v);
        let left = self.beyond_corner(self.left_v - u);
        (self.slope_right * right.0 - self.slope_left * left.0, self.slope_right * right.1 + self.slope_left * left.1)
    }

    /// What a corner makes of the distance beyond it in V, and the derivative: nothing before the rounding, the parabola
    /// `(x + r)² / (4 r)` in it, the distance behind it.
    #[inline]
    fn beyond_corner(&self, x: R) -> (R, R) {
        let r = self.rounding_v;
        if x <= -r {
            (R::ZERO, R::ZERO)
        } else if x >= r {
            (x, R::ONE)
        } else {
            let part = (x + r) / (r + r);
            (part * (x + r) * R::HALF, part)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHARP: DeadZone<f64> =
        DeadZone { right_v: 0.6, left_v: -0.4, slope_right: 1.2, slope_left: 0.8, rounding_v: 0.0 };

    #[test]
    fn rounded_corners_join_the_sharp_ones_and_their_gain_is_the_derivative() {
        for rounding_v in [0.05, 0.3, 0.9] {
            let round = DeadZone { rounding_v, ..SHARP };
            // Between the roundings nothing flows; wide ones leave no place for that.
            let [left, right] = [SHARP.left_v + rounding_v, SHARP.right_v - rounding_v];
            for k in -3000..=3000 {
                let u = 1.0e-3 * f64::from(k);
                let w = round.output_v(u);
                if u > SHARP.right_v.max(SHARP.left_v + rounding_v) + rounding_v
                    || u < SHARP.left_v.min(SHARP.right_v - rounding_v) - rounding_v
                {
                    assert!((w - SHARP.output_v(u)).abs() < 1e-12, "{rounding_v} {u}");
                }
                if left < u && u < right {
                    assert_eq!(w, 0.0);
                }
                let step = 1.0e-6;
                let slope = (round.output_v(u + step) - round.output_v(u - step)) / (2.0 * step);
                assert!((round.gain(u) - slope).abs() < 1e-5, "{rounding_v} {u}: {} {slope}", round.gain(u));
                assert!(round.gain(u) >= 0.0);
            }
        }
        // In the corner itself a quarter of the rounding passes.
        let round = DeadZone { rounding_v: 0.1, ..SHARP };
        assert!((round.output_v(0.6) - 1.2 * 0.025).abs() < 1e-12);
    }

    #[test]
    fn a_zone_widens_on_both_sides_and_narrows_until_it_is_closed() {
        let wide = SHARP.widened(0.1);
        assert_eq!([wide.left_v, wide.right_v], [-0.5, 0.7]);
        let none = SHARP.widened(-2.0);
        assert!((none.left_v - 0.1).abs() < 1e-12 && (none.right_v - 0.1).abs() < 1e-12);
    }
}
