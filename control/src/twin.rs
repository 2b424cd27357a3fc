//! The same law in f64, straight from the parameters: the yardstick for the fixed-point error. Never runs on the board.
//!
//! It shares no number with [`Config`](crate::Config): what the fixed-point path precomputes is computed here from the
//! parameters each time, in the order of the equations.

use crate::parameters::Parameters;

/// What the twin computes for one tick, unrounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Twin {
    /// Position behind the code, m.
    pub position_m: f64,
    /// Effective voltage `w`, V, saturated at ±128 V like the fixed-point format.
    pub w_v: f64,
    /// Valve voltage `u`, V.
    pub u_v: f64,
    /// DAC code before rounding.
    pub code: f64,
    /// `du/dw` at this point: how much the inverse dead zone amplifies an error of `w`.
    pub slope: f64,
}

/// The quantity at a code.
#[must_use]
pub fn quantity([lo, hi]: [f64; 2], bits: u8, code: u16) -> f64 {
    let max = f64::from((1_u32 << bits) - 1);
    lo + f64::from(code).min(max) / max * (hi - lo)
}

/// The ends of the position's range as calibrated, m.
#[must_use]
pub fn position_range(p: &Parameters) -> [f64; 2] {
    p.position_range_m.map(|end| f64::from(p.position_offset_m) + f64::from(p.position_gain) * f64::from(end))
}

/// Half-width of the band in which the inverse crosses the dead zone, V.
#[must_use]
pub fn blend_v(p: &Parameters) -> f64 {
    let code_of = |[lo, hi]: [f64; 2], bits: u8| (hi - lo) / f64::from((1_u32 << bits) - 1);
    let gain = if p.dead_zone_left_v < p.dead_zone_right_v { f64::from(p.gain_v_per_m) } else { 0.0 };
    let least = (gain * code_of(position_range(p), p.adc_bits)).max(5.0e-4);
    p.dead_zone_blend_v.map_or_else(|| code_of(p.valve_range_v.map(f64::from), p.dac_bits).max(2.0 * least), f64::from)
}

/// The running controller's output for a reference inside the setpoint range and a position code.
#[must_use]
pub fn output(p: &Parameters, reference_m: f64, position: u16) -> Twin {
    let position_m = quantity(position_range(p), p.adc_bits, position);
    let w = (f64::from(p.gain_v_per_m) * (reference_m - position_m)).clamp(-128.0, 128.0);
    let (right, left) = (f64::from(p.dead_zone_right_v), f64::from(p.dead_zone_left_v));
    let (per_right, per_left) = (1.0 / f64::from(p.slope_right), 1.0 / f64::from(p.slope_left));
    let (centre, blend) = ((right + left) / 2.0, blend_v(p));
    let (from, slope) = if w >= blend {
        (right, per_right)
    } else if w <= -blend {
        (left, per_left)
    } else if w >= 0.0 {
        (centre, (right - centre) / blend + per_right)
    } else {
        (centre, (centre - left) / blend + per_left)
    };
    let [lo, hi] = p.valve_range_v.map(f64::from);
    let most = f64::from(p.max_voltage_v);
    let u = (from + w * slope).clamp(lo.max(-most), hi.min(most));
    let code = (u - lo) / (hi - lo) * f64::from((1_u32 << p.dac_bits) - 1);
    Twin { position_m, w_v: w, u_v: u, code, slope }
}

#[cfg(test)]
mod tests;
