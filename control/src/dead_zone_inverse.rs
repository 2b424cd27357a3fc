//! The inverse of the valve's dead zone: which voltage `u` makes the valve act as if `w` were applied without dead zone.
//!
//! The valve (3.1) delivers `w = m_d (u − z_md)` right of the dead zone, `w = m_e (u − z_me)` left of it, and nothing in
//! between. Its inverse is
//!
//! ```text
//! u = z_md + w / m_d                       w ≥  ε        u │        ╱
//! u = c + w (z_md − c + ε / m_d) / ε    0 ≤ w <  ε    z_md ┤      ╱
//! u = c + w (c − z_me + ε / m_e) / ε   −ε < w <  0         │     │
//! u = z_me + w / m_e                       w ≤ −ε     ─────┼─────┼──────► w
//!                          c = (z_md + z_me) / 2           │   −ε│ε
//! ```
//!
//! The exact inverse jumps by the whole width of the dead zone at `w = 0`; with any noise on the position the valve would
//! then be thrown from one side to the other every tick. The band `±ε` replaces the jump by two straight lines through
//! the middle of the dead zone: continuous, strictly monotone, and at `w = 0` both chambers are blocked.
//!
//! **Choosing ε** (`dead_zone_blend_v`). Inside the band the valve hardly opens, so the piston may rest within `±ε / K_p`
//! of its target: small is precise. Noise of the position, times `K_p`, should stay well inside the band, or the noise opens
//! the valve: large is quiet. By default ε is one code of the output (2.4 mV for 12 bits over ±5 V), below which the output
//! could not resolve `w` anyway, and at 4 V/m three times the four-sigma noise of a 0.05 mm sensor. A band narrower than
//! one position code times `K_p` is refused: with it, a single code of noise could cross the dead zone.
//! With the default and a dead zone of ±0.42 V, one position code (15 µm of 1 m) moves `u` by 10 mV inside the dead zone,
//! where no air flows, and by 0.06 mV outside.

use crate::arithmetic::{limit, saturate};
use crate::quantities::Voltage;
use fixed::types::I16F16;

/// Break-points, precomputed slopes and the limits of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadZoneInverse {
    /// Right break-point `z_md`.
    pub(crate) right: Voltage,
    /// Left break-point `z_me`.
    pub(crate) left: Voltage,
    /// Middle of the dead zone `c`.
    pub(crate) centre: Voltage,
    /// Half-width of the band `ε`, in `w`.
    pub(crate) blend: Voltage,
    /// `1 / m_d`.
    pub(crate) per_slope_right: I16F16,
    /// `1 / m_e`.
    pub(crate) per_slope_left: I16F16,
    /// Slope in the band for `w ≥ 0`.
    pub(crate) blend_slope_right: I16F16,
    /// Slope in the band for `w < 0`.
    pub(crate) blend_slope_left: I16F16,
    /// Lowest voltage commanded.
    pub(crate) lowest: Voltage,
    /// Highest voltage commanded.
    pub(crate) highest: Voltage,
}

impl DeadZoneInverse {
    /// The valve voltage for the effective voltage `w`, saturated at the valve's limits.
    #[inline]
    #[must_use]
    pub fn valve_voltage(&self, w: Voltage) -> Voltage {
        let (from, slope) = if w >= self.blend {
            (self.right, self.per_slope_right)
        } else if w <= -self.blend {
            (self.left, self.per_slope_left)
        } else if w >= 0 {
            (self.centre, self.blend_slope_right)
        } else {
            (self.centre, self.blend_slope_left)
        };
        // |w · slope| <= 2^62: saturated only after the break-point has been added.
        let above = (i64::from(w.to_bits()) * i64::from(slope.to_bits()) + (1 << 15)) >> I16F16::FRAC_NBITS;
        let u = i64::from(from.to_bits()) + above;
        limit(Voltage::from_bits(saturate(u)), self.lowest, self.highest)
    }

    /// The middle of the dead zone: both chambers blocked.
    #[must_use]
    pub fn centre(&self) -> Voltage {
        self.centre
    }
}
