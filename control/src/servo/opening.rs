//! The valve's opening over its effective voltage: the paper's arc tangent, or straight lines between points of a table.
//!
//! The table names voltages at fixed openings, close together where the valve has just begun to open: there a positioner works, and there
//! a proportional valve's curve bends most. Both directions are one search and one product; slopes are computed with the parameters.

use super::Angle;
use super::angle::{angle, effective_voltage};
use super::factor::Factor;
use crate::arithmetic::{fixed, multiply};
use crate::config_error::{ConfigError, demand};
use crate::parameters::{Key, Parameters};
use crate::quantities::Voltage;

/// Openings at which a table names the effective voltage, relative to the widest.
pub const OPENING_KNOTS: [f64; 10] = [1.0 / 64.0, 1.0 / 32.0, 0.0625, 0.125, 0.25, 0.375, 0.5, 0.75, 0.875, 1.0];
/// Least distance of two voltages of a table, V: less than a code of a 12-bit output over ±5 V.
pub const OPENING_STEP_V: f64 = 1.0e-3;

/// One straight line of the table: where it begins, and its slope both ways.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    w: Voltage,
    theta: Angle,
    slope: Factor<Voltage, Angle>,
    per_slope: Factor<Angle, Voltage>,
}

/// How far the valve is open. A full opening counts as π/2, as of the arc tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Opening {
    lines: Option<[Line; OPENING_KNOTS.len()]>,
    most: Voltage,
}

/// The last line whose beginning is reached, or the first.
#[inline]
fn last_line(lines: &[Line; OPENING_KNOTS.len()], is_reached: impl Fn(&Line) -> bool) -> &Line {
    lines.iter().rev().find(|line| is_reached(line)).unwrap_or(&lines[0])
}

impl Opening {
    /// By the table of the parameters, or by the arc tangent.
    ///
    /// # Errors
    /// A table of which points are missing, or which does not rise.
    pub(crate) fn from_parameters(p: &Parameters) -> Result<Self, ConfigError> {
        let points: [(Option<f32>, Key); OPENING_KNOTS.len()] = [
            (p.servo_opening_1_v, Key::servo_opening_1_v),
            (p.servo_opening_2_v, Key::servo_opening_2_v),
            (p.servo_opening_3_v, Key::servo_opening_3_v),
            (p.servo_opening_4_v, Key::servo_opening_4_v),
            (p.servo_opening_5_v, Key::servo_opening_5_v),
            (p.servo_opening_6_v, Key::servo_opening_6_v),
            (p.servo_opening_7_v, Key::servo_opening_7_v),
            (p.servo_opening_8_v, Key::servo_opening_8_v),
            (p.servo_opening_9_v, Key::servo_opening_9_v),
            (p.servo_opening_10_v, Key::servo_opening_10_v),
        ];
        if points.iter().all(|(volts, _)| volts.is_none()) {
            return Ok(Self::of(None));
        }
        let mut last = 0.0;
        for (volts, key) in points {
            let volts = f64::from(volts.unwrap_or(0.0));
            // Half a step: the voltages are rounded to f32.
            let rises = volts >= last + 0.5 * OPENING_STEP_V;
            demand(
                rises,
                key,
                volts,
                "be given as the other voltages of openings are, and above the one before (volts)",
            )?;
            last = volts;
        }
        Ok(Self::of(Some(points.map(|(volts, _)| f64::from(volts.unwrap_or(0.0))))))
    }

    /// By the arc tangent, or by the voltages of a table, which rise.
    pub(crate) fn of(table: Option<[f64; OPENING_KNOTS.len()]>) -> Self {
        let Some(volts) = table else { return Self { lines: None, most: Voltage::MAX } };
        let (mut from, mut most) = ([0.0, 0.0], Voltage::MAX);
        let mut at = 0;
        let lines = volts.map(|w| {
            let theta = core::f64::consts::FRAC_PI_2 * OPENING_KNOTS[at];
            let slope = (theta - from[1]) / (w - from[0]);
            let line = Line {
                w: fixed(from[0]),
                theta: fixed(from[1]),
                slope: Factor::new(slope),
                per_slope: Factor::new(1.0 / slope),
            };
            (from, at) = ([w, theta], at + 1);
            most = fixed(w);
            line
        });
        Self { lines: Some(lines), most }
    }

    /// The angle of an effective voltage.
    #[inline]
    pub(crate) fn angle(&self, w: Voltage) -> Angle {
        let Some(lines) = &self.lines else { return angle(w) };
        let size = w.saturating_abs().min(self.most);
        let line = last_line(lines, |line| size >= line.w);
        let theta = line.theta.saturating_add(line.slope.of(size - line.w));
        if w < 0 { -theta } else { theta }
    }

    /// The effective voltage of an angle.
    #[inline]
    pub(crate) fn voltage(&self, theta: Angle) -> Voltage {
        let Some(lines) = &self.lines else { return effective_voltage(theta) };
        let size = theta.saturating_abs();
        let line = last_line(lines, |line| size >= line.theta);
        let w = line.w.saturating_add(line.per_slope.of(size - line.theta)).min(self.most);
        if theta < 0 { -w } else { w }
    }

    /// The change of voltage that makes up a small change of angle, in rad with 24 fractional bits, at an effective voltage.
    #[inline]
    pub(crate) fn volts_of(&self, w: Voltage, radians_q24: i32) -> Voltage {
        let Some(lines) = &self.lines else {
            // dw = dθ (1 + 4 w²) / 2
            let half = 1 << 23;
            let stretch = half + multiply(w.to_bits(), w.to_bits(), 23);
            return Voltage::from_bits(multiply(radians_q24, stretch, 24));
        };
        let size = w.saturating_abs();
        let line = last_line(lines, |line| size >= line.w);
        line.per_slope.of(Angle::from_bits(radians_q24.saturating_mul(16)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VOLTS: [f64; 10] = [0.44, 0.71, 0.94, 1.25, 1.65, 2.05, 2.54, 3.5, 4.07, 5.0];

    #[test]
    fn the_table_passes_through_its_points_and_its_inverse_leads_back() {
        let opening = Opening::of(Some(VOLTS));
        for (volts, part) in VOLTS.into_iter().zip(OPENING_KNOTS) {
            for side in [1.0, -1.0] {
                let theta = opening.angle(Voltage::from_num(side * volts)).to_num::<f64>();
                let exact = side * part * core::f64::consts::FRAC_PI_2;
                assert!((theta - exact).abs() < 1e-6, "{volts} V: {theta} against {exact}");
            }
        }
        for step in -5000..=5000 {
            let w = Voltage::from_num(f64::from(step) * 1e-3);
            let back = opening.voltage(opening.angle(w));
            assert!((back - w).abs() < 1e-5, "{w}: {back}");
        }
        assert_eq!(opening.angle(Voltage::MAX), opening.angle(Voltage::from_num(5)));
        assert_eq!(opening.voltage(Angle::MAX), Voltage::from_num(5));
    }
}
