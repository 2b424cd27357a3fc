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

use crate::flow::{Connection, Flow};
use crate::real::Real;
use crate::tube::Tube;

/// Density of air at the reference atmosphere of ISO 8778 (20 °C, 1 bar, 65 % humidity), kg/m3: a sonic conductance in
/// m3/(s Pa) refers to it.
pub const REFERENCE_DENSITY_KG_PER_M3: f64 = 1.185;
/// Its temperature, K.
pub const REFERENCE_TEMPERATURE_K: f64 = 293.15;

/// Critical pressure ratio of a throttle. ISO 6358 tables give 0.2 to 0.5 for fittings and throttles; it matters only
/// beside a valve of that law, whose own ratio it changes by at most as much.
pub(crate) const THROTTLE_CRITICAL_RATIO: f64 = 0.3;

/// A throttle in series with the valve: the line's, or a cushion's needle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Throttle<R> {
    /// Sonic conductance, kg/(s Pa).
    pub conductance: R,
    /// Coefficient of a linear law that lets the same flow pass at full pressure drop, kg/(s Pa).
    pub coefficient: R,
}

/// All that lies in series with a path of the valve, for the law that the valve follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Resistance<R> {
    /// Beside a valve of ISO 6358: all of it as one.
    Iso6358(Tube<R>),
    /// Behind a valve of the linear law: throttles, by their coefficient in kg/(s Pa).
    Throttles(R),
    /// The same with a tube.
    Tube(Tube<R>, Option<R>),
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
#[must_use]
pub fn volume_m3<R: Real>(length_m: R, diameter_m: R) -> R {
    R::of(core::f64::consts::FRAC_PI_4) * diameter_m * diameter_m * length_m
}

impl<R: Real> Throttle<R> {
    /// A throttle through which passes `1/ratio` of what passes through a path that lets `open` pass: kg/(s Pa) of
    /// difference of pressure by the linear law, of pressure upstream by ISO 6358. `full_drop` is `(p_sup - p_atm) / p_sup`.
    pub(crate) fn new(open: R, ratio: R, iso6358: bool, full_drop: R) -> Self {
        let passes = open / ratio;
        let (coefficient, conductance) =
            if iso6358 { (passes / full_drop, passes) } else { (passes, passes * full_drop) };
        Self { conductance, coefficient }
    }

    fn iso6358(&self) -> Tube<R> {
        Tube { conductance: self.conductance, critical_ratio: R::of(THROTTLE_CRITICAL_RATIO) }
    }
}

impl<R: Real> Resistance<R> {
    /// A hose, and what throttles behind it in turn.
    pub(crate) fn of(hose: Option<Tube<R>>, throttles: &[Option<Throttle<R>>], iso6358: bool) -> Option<Self> {
        let throttles = throttles.iter().flatten();
        if iso6358 {
            let all = throttles.fold(hose, |before, throttle| {
                let throttle = throttle.iso6358();
                Some(before.map_or(throttle, |before| {
                    let Series { conductance, critical_ratio, .. } =
                        throttle.behind(before.conductance, before.critical_ratio);
                    Tube { conductance, critical_ratio }
                }))
            });
            return all.map(Self::Iso6358);
        }
        let coefficient = throttles
            .map(|throttle| throttle.coefficient)
            .reduce(|before, coefficient| before * coefficient / (before + coefficient));
        match hose {
            Some(tube) => Some(Self::Tube(tube, coefficient)),
            None => coefficient.map(Self::Throttles),
        }
    }

    /// What lies beside a valve of ISO 6358.
    #[inline]
    pub(crate) fn iso6358(&self) -> Option<&Tube<R>> {
        if let Self::Iso6358(all) = self { Some(all) } else { None }
    }

    /// Flow into a chamber at pressure `p` through a valve of the linear law and this.
    #[inline]
    pub(crate) fn inflow(&self, valve: &Connection<R>, filling: bool, p: R) -> Flow<R> {
        let (tube, throttle) = match self {
            Self::Iso6358(tube) => (Some(tube), None),
            Self::Throttles(throttle) => (None, Some(throttle)),
            Self::Tube(tube, throttle) => (Some(tube), throttle.as_ref()),
        };
        let share = throttle.map_or(R::ONE, |throttle| *throttle / (*throttle + valve.conductance));
        let behind = Connection { conductance: valve.conductance * share, ..*valve };
        let flow = tube.map_or_else(|| behind.inflow(filling, p), |tube| tube.inflow(&behind, filling, p));
        Flow { opening_exponent: flow.opening_exponent * share, ..flow }
    }
}

impl<R: Real> Tube<R> {
    /// A hose; `None` for one of no length.
    pub(crate) fn hose(length_m: R, diameter_m: R, temperature_k: R) -> Option<Self> {
        let exists = length_m > R::ZERO && diameter_m > R::ZERO;
        if !exists {
            return None;
        }
        let area = diameter_m * diameter_m;
        // d^1.25
        let power = diameter_m * diameter_m.sqrt().sqrt();
        let sonic = R::of(0.029) * area / (length_m / power + R::of(510.0)).sqrt();
        let conductance = mass_conductance(sonic, temperature_k);
        Some(Self { conductance, critical_ratio: R::of(474.0) * sonic / area })
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
        let hose = Tube::hose(1.0_f64, 4.0e-3, 293.15).unwrap();
        let litres_per_s_bar = hose.conductance / REFERENCE_DENSITY_KG_PER_M3 * 1.0e8;
        assert!((litres_per_s_bar - 1.196).abs() < 0.01, "{litres_per_s_bar}");
        assert!((hose.critical_ratio - 0.354).abs() < 0.002, "{}", hose.critical_ratio);
    }

    #[test]
    fn a_hose_behind_a_nearly_closed_valve_changes_nothing_and_two_alike_let_four_fifths_pass() {
        let hose = Tube { conductance: 1.0_f64, critical_ratio: 0.3 };
        let small = hose.behind(1.0e-4, 0.25);
        assert!((small.conductance / 1.0e-4 - 1.0).abs() < 1e-9 && (small.critical_ratio - 0.25).abs() < 1e-6);
        let alike = hose.behind(1.0, 0.3);
        assert!((alike.conductance - 0.5_f64.cbrt()).abs() < 1e-12);
        assert!((alike.critical_ratio - (1.0 - 1.4 * 0.25_f64.cbrt())).abs() < 1e-12);
    }

    #[test]
    fn derivatives_of_the_series_are_those_of_difference_quotients() {
        let hose = Tube { conductance: 1.0_f64, critical_ratio: 0.35 };
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
