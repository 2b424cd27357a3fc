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
}

impl<R: Real> DeadZone<R> {
    /// The effective command `w` in V for a spool position `u` in V (3.1).
    #[inline]
    #[must_use]
    pub fn output_v(&self, u: R) -> R {
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
        if u >= self.right_v {
            self.slope_right
        } else if u <= self.left_v {
            self.slope_left
        } else {
            R::ZERO
        }
    }
}
