//! A sensor that follows its quantity with a lag of first order: what the lags of position and pressures share.

use super::terms::Term;
use crate::real::Real;

/// A lag of first order, `tau x_m' + x_m = x`, of a position in m or a pressure in Pa.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FirstOrderLag<R> {
    /// Time constant `tau`, s; 0 for none.
    pub time_constant_s: R,
}

impl<R: Real> Term<R> for FirstOrderLag<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.time_constant_s > R::ZERO
    }
}

impl<R: Real> FirstOrderLag<R> {
    /// Rate per second of the signal behind the lag, zero where there is none.
    #[inline(always)]
    pub(crate) fn rate(&self, ahead: R, sensed: R) -> R {
        if self.is_present() { (ahead - sensed) / self.time_constant_s } else { R::ZERO }
    }

    /// Negative derivative of the rate by the signal behind the lag, 1/s.
    #[inline(always)]
    pub(crate) fn inverse_s(&self) -> R {
        if self.is_present() { R::ONE / self.time_constant_s } else { R::ZERO }
    }

    /// A signal in front of the lag, from that behind it and its slope per second.
    #[inline(always)]
    #[must_use]
    pub fn ahead(&self, sensed: R, slope_per_s: R) -> R {
        sensed + self.time_constant_s * slope_per_s
    }

    /// The signal behind the lag after `dt_s` in which that in front went from the first to the second of `ends` on a straight
    /// line. `rest` is `exp(-dt / tau)`, which the caller takes from the exponential of its platform.
    #[inline]
    #[must_use]
    pub fn over(&self, sensed: R, ends: [R; 2], dt_s: R, rest: R) -> R {
        let behind = self.time_constant_s * ((ends[1] - ends[0]) / dt_s);
        after_transient(sensed, ends.map(|end| end - behind), rest)
    }

    /// The same for a signal whose slope changes evenly, from the first to the second of `slopes_per_s`.
    #[inline]
    #[must_use]
    pub fn over_bend(&self, sensed: R, ends: [R; 2], slopes_per_s: [R; 2], dt_s: R, rest: R) -> R {
        let tau = self.time_constant_s;
        let bend = (slopes_per_s[1] - slopes_per_s[0]) / dt_s;
        let mean = (ends[1] - ends[0]) / dt_s;
        let half = R::HALF * bend * dt_s;
        // What is left of `tau s' + s = x` once its transient is gone: s = x - tau x' + tau^2 x''.
        let settled = |x: R, slope: R| x - tau * slope + tau * tau * bend;
        after_transient(sensed, [settled(ends[0], mean - half), settled(ends[1], mean + half)], rest)
    }
}

/// What a lag shows at the end of an interval, from what it would show at both ends without a transient, of which `rest` is left.
#[inline(always)]
fn after_transient<R: Real>(sensed: R, settled: [R; 2], rest: R) -> R {
    settled[1] + (sensed - settled[0]) * rest
}
