//! A hose between valve and chamber, lumped: a volume at the chamber, a resistance in series with the valve, a delay.
//!
//! ```text
//!  supply or      valve         hose                     chamber
//!  atmosphere ──( C_v, b_v )──( C_t, b_t )── pi/4 d² l + V ──   all of it later by l / c
//! ```
//!
//! - **Resistance**: sonic conductance and critical ratio of a tube, `C_t = 0.029 d² / sqrt(l / d^1.25 + 510)` in m3/(s Pa)
//!   with lengths in m, and `b_t = 474 C_t / d²` (Eckersten's fit to measured tubes; Beater, Pneumatic Drives, 2007,
//!   section 4.4).
//! - **In series** with the valve: `1/C³ = 1/C_v³ + 1/C_t³`, `1 − b = C² ((1 − b_v)/C_v² + (1 − b_t)/C_t²)` (the same
//!   section). A valve of the paper's linear law has no critical ratio, and the drop along a tube is quadratic in the flow:
//!   [`tube`](crate::tube) has both in series. Throttles stay linear beside it, `1/β = 1/β_v + 1/β_n`, and count to the valve.
//! - **Volume**: all of it counts to the chamber.
//! - **Delay**: sound takes `l / c`, `c = sqrt(γ R T)`, 2.9 ms/m (Richer and Hurmuzlu, J. Dyn. Sys. Meas. Control 122, 2000,
//!   their (37)). Both hoses count with their mean length: the command reaches both chambers late by the same time.
//!
//! Left out: waves within the hose, which die out within a few times `l / c`, and the pressure drop across the hose in
//! what a sensor at the valve would read. Sensors are taken to sit at the cylinder.

use crate::flow::Flow;
use crate::real::Real;
use crate::tube::Tube;
use crate::valve_flow::Connection;

/// Density of air at the reference atmosphere of ISO 8778 (20 °C, 1 bar, 65 % humidity), kg/m3: a sonic conductance in
/// m3/(s Pa) refers to it.
pub const REFERENCE_DENSITY_KG_PER_M3: f64 = 1.185;
/// Its temperature, K.
pub const REFERENCE_TEMPERATURE_K: f64 = 293.15;

/// Critical pressure ratio of a throttle. ISO 6358 tables give 0.2 to 0.5 for fittings and throttles; it matters only
/// beside a valve of that law, whose own ratio it changes by at most as much.
pub(crate) const THROTTLE_CRITICAL_RATIO: f64 = 0.3;

/// The resistance of a hose, or of anything else in series with the valve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hose<R> {
    /// Sonic conductance of all of it, kg/(s Pa).
    pub conductance: R,
    /// Critical pressure ratio of all of it.
    pub critical_ratio: R,
    /// What of it is a tube, for a valve of the linear law.
    pub tube: Option<Tube<R>>,
    /// What of it are throttles, for such a valve: the coefficient of a linear law that lets the same flow pass at full pressure
    /// drop, kg/(s Pa).
    pub throttle: Option<R>,
}

/// A valve's path and a hose in series, as one path.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Series<R> {
    pub(crate) conductance: R,
    pub(crate) critical_ratio: R,
    /// `d ln C / d ln C_v`.
    pub(crate) exponent: R,
    /// `d b / d ln C_v`.
    pub(crate) ratio_by_log: R,
}

/// Mass conductance in kg/(s Pa) of a sonic conductance in m3/(s Pa) at a temperature in K (ISO 6358).
pub(crate) fn mass_conductance<R: Real>(sonic: R, temperature_k: R) -> R {
    sonic * R::of(REFERENCE_DENSITY_KG_PER_M3) * (R::of(REFERENCE_TEMPERATURE_K) / temperature_k).sqrt()
}

/// Volume of a hose, m3.
pub(crate) fn volume_m3<R: Real>(length_m: R, diameter_m: R) -> R {
    R::of(core::f64::consts::FRAC_PI_4) * diameter_m * diameter_m * length_m
}

impl<R: Real> Hose<R> {
    /// `None` for a hose of no length, which is none.
    pub(crate) fn new(length_m: R, diameter_m: R, temperature_k: R) -> Option<Self> {
        let exists = length_m > R::ZERO && diameter_m > R::ZERO;
        if !exists {
            return None;
        }
        let area = diameter_m * diameter_m;
        // d^1.25
        let power = diameter_m * diameter_m.sqrt().sqrt();
        let sonic = R::of(0.029) * area / (length_m / power + R::of(510.0)).sqrt();
        let conductance = mass_conductance(sonic, temperature_k);
        let critical_ratio = R::of(474.0) * sonic / area;
        let tube = Some(Tube { conductance, critical_ratio });
        Some(Self { conductance, critical_ratio, tube, throttle: None })
    }

    /// A throttle through which passes `1/ratio` of what passes through a path that lets `open` pass: kg/(s Pa) of
    /// difference of pressure by the linear law, of pressure upstream by ISO 6358. `full_drop` is `(p_sup - p_atm) / p_sup`.
    pub(crate) fn throttle(open: R, ratio: R, iso6358: bool, full_drop: R) -> Self {
        let passes = open / ratio;
        let (coefficient, conductance) =
            if iso6358 { (passes / full_drop, passes) } else { (passes, passes * full_drop) };
        let critical_ratio = R::of(THROTTLE_CRITICAL_RATIO);
        Self { conductance, critical_ratio, tube: None, throttle: Some(coefficient) }
    }

    /// With a throttle behind it, as one.
    pub(crate) fn and(&self, throttle: &Self) -> Self {
        let Series { conductance, critical_ratio, .. } = throttle.behind(self.conductance, self.critical_ratio);
        let both = match (self.throttle, throttle.throttle) {
            (Some(one), Some(other)) => Some(one * other / (one + other)),
            (one, other) => one.or(other),
        };
        Self { conductance, critical_ratio, tube: self.tube, throttle: both }
    }

    /// Flow into a chamber at pressure `p` through a valve of the linear law and this.
    #[inline]
    pub(crate) fn inflow(&self, valve: &Connection<R>, filling: bool, p: R) -> Flow<R> {
        let share = self.throttle.map_or(R::ONE, |throttle| throttle / (throttle + valve.conductance));
        let throttled = Connection { conductance: valve.conductance * share, ..*valve };
        let flow = match &self.tube {
            Some(tube) => tube.inflow(&throttled, filling, p),
            None => throttled.inflow(filling, p),
        };
        Flow { opening_exponent: flow.opening_exponent * share, ..flow }
    }

    /// In series with a path of the valve that is not closed.
    #[inline]
    pub(crate) fn behind(&self, valve: R, valve_ratio: R) -> Series<R> {
        let part = valve / self.conductance;
        let square = part * part;
        let exponent = R::ONE / (R::ONE + square * part);
        let root = exponent.cbrt();
        let (valve_loss, hose_loss) = (R::ONE - valve_ratio, (R::ONE - self.critical_ratio) * square);
        let squared_root = root * root;
        let ratio = R::ONE - (valve_loss + hose_loss) * squared_root;
        let two = R::ONE + R::ONE;
        let ratio_by_log = two * squared_root * ((valve_loss + hose_loss) * square * part * exponent - hose_loss);
        // Much resistance in series has a ratio near 0, where the formula leads below.
        let (critical_ratio, ratio_by_log) = if ratio > R::ZERO { (ratio, ratio_by_log) } else { (R::ZERO, R::ZERO) };
        Series { conductance: valve * root, critical_ratio, exponent, ratio_by_log }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_metre_of_4_mm_tube_has_the_conductance_of_catalogues() {
        let hose = Hose::new(1.0_f64, 4.0e-3, 293.15).unwrap();
        let litres_per_s_bar = hose.conductance / REFERENCE_DENSITY_KG_PER_M3 * 1.0e8;
        assert!((litres_per_s_bar - 1.196).abs() < 0.01, "{litres_per_s_bar}");
        assert!((hose.critical_ratio - 0.354).abs() < 0.002, "{}", hose.critical_ratio);
    }

    #[test]
    fn a_hose_behind_a_nearly_closed_valve_changes_nothing_and_two_alike_let_four_fifths_pass() {
        let hose = Hose { conductance: 1.0_f64, critical_ratio: 0.3, tube: None, throttle: None };
        let small = hose.behind(1.0e-4, 0.25);
        assert!((small.conductance / 1.0e-4 - 1.0).abs() < 1e-9 && (small.critical_ratio - 0.25).abs() < 1e-6);
        let alike = hose.behind(1.0, 0.3);
        assert!((alike.conductance - 0.5_f64.cbrt()).abs() < 1e-12);
        assert!((alike.critical_ratio - (1.0 - 1.4 * 0.25_f64.cbrt())).abs() < 1e-12);
    }

    #[test]
    fn derivatives_of_the_series_are_those_of_difference_quotients() {
        let hose = Hose { conductance: 1.0_f64, critical_ratio: 0.35, tube: None, throttle: None };
        for valve in [0.05, 0.4, 0.9, 2.0] {
            let (at, step) = (hose.behind(valve, 0.3), 1e-6);
            let (less, more) = (hose.behind(valve * (1.0 - step), 0.3), hose.behind(valve * (1.0 + step), 0.3));
            let exponent = (more.conductance / less.conductance).ln() / (2.0 * step);
            let by_log = (more.critical_ratio - less.critical_ratio) / (2.0 * step);
            assert!((at.exponent - exponent).abs() < 1e-6, "{valve}: {} {exponent}", at.exponent);
            assert!((at.ratio_by_log - by_log).abs() < 1e-6, "{valve}: {} {by_log}", at.ratio_by_log);
        }
    }
}
