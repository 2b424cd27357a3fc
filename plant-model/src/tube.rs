//! A tube behind a valve of the paper's linear law.
//!
//! The drop of pressure along a tube grows with the square of the flow. As a linear law in series with the valve, with its flow
//! at full drop, 1 m of 4 mm would take 40 % of what the open valve of the paper's case (a) fills with at rest, and 8 % of what it fills with
//! when open by an eighth; by ISO 6358 it is 13 % and 0.3 %. So the valve stays linear and the tube follows ISO 6358.
//!
//! With `G` the valve's coefficient times its opening, `P` the drop over both, `d` the drop along the tube, `p` the chamber's
//! pressure and `C`, `b` the tube's numbers:
//!
//! ```text
//! valve    q = G (P − d)
//! tube     q = C p_1 sqrt(1 − ((p_2/p_1 − b)/(1 − b))²)
//!          q² (1 − b)² = C² d (2 (1 − b) p_1 − d)                            p_2 = p_1 − d put in
//!                      = C² (k d + m d²)    k = 2 (1 − b) p
//!                                           m = −1 out of the chamber, p_1 = p;   1 − 2 b into it, p_1 = p + d
//! both     g² (P − d)² = k d + m d²         g = G (1 − b)/C
//! ```
//!
//! The chamber's pressure is known on either way, so this is a quadratic in `d`, and no approximation. Of its roots the smaller
//! one lies between 0 and `P`; freed of differences of numbers that are nearly equal:
//!
//! ```text
//! s = sqrt(k² + 4 g² P (k + m P))      d = 2 g² P²/(k + s + 2 g² P)      q = G P (k + s)/(k + s + 2 g² P)
//! ```
//!
//! `s` is minus the derivative by `d` of what is zero, so that at the root
//!
//! ```text
//! dq/dP = G (k + 2 m d)/s      dq/dp = 2 (1 − b) G d/s      d ln q/d ln G = (k + 2 m d)/s
//! ```
//!
//! A tube that is choked (`p_2 ≤ b p_1`) passes `C p_1`: out of the chamber `C p`, whatever the valve does; into it `C (p + d)`,
//! which with the valve is `q = G (P + p)/(1 + G/C)`. Both laws meet with equal values and slopes. The line near a pressure ratio of 1
//! that `choked-flow` needs is left out: behind the valve the slope of `q` is finite.

use crate::flow::{Connection, Flow};
use crate::real::Real;

/// A tube's numbers by ISO 6358.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tube<R> {
    /// Sonic conductance, kg/(s Pa).
    pub conductance: R,
    /// Critical pressure ratio.
    pub critical_ratio: R,
}

/// What passes valve and tube, and its derivatives.
struct Passed<R> {
    flow: R,
    /// By the drop over both, the chamber's pressure held.
    by_drop: R,
    /// By the chamber's pressure, the drop held.
    by_pressure: R,
    /// `d ln q / d ln G`.
    exponent: R,
}

impl<R: Real> Tube<R> {
    /// Flow into a chamber at pressure `p` through a valve and this tube.
    #[inline]
    pub(crate) fn inflow(&self, valve: &Connection<R>, filling: bool, p: R) -> Flow<R> {
        let drop = valve.pressure_pa - p;
        let into = drop >= R::ZERO;
        let passed = self.passed(valve.conductance, into, p, drop.abs());
        let signed = |value: R| if into { value } else { -value };
        Flow {
            mass_flow: signed(passed.flow),
            by_chamber: signed(passed.by_pressure) - passed.by_drop,
            by_supply: if filling { passed.by_drop } else { R::ZERO },
            by_distance: R::ZERO,
            opening_exponent: passed.exponent,
        }
    }

    #[inline]
    fn passed(&self, valve: R, into: bool, p: R, drop: R) -> Passed<R> {
        let (b, two) = (self.critical_ratio, R::ONE + R::ONE);
        let loss = R::ONE - b;
        let part = valve / self.conductance;
        // What the valve passes to a choked tube, over what that passes itself; `>=`, as a chamber without pressure has no other.
        if into && part * (b * drop - loss * p) >= p {
            let exponent = R::ONE / (R::ONE + part);
            let by_reservoir = valve * exponent;
            return Passed {
                flow: by_reservoir * (drop + p),
                by_drop: by_reservoir,
                by_pressure: by_reservoir,
                exponent,
            };
        }
        if !into && part * (drop - loss * p) >= p {
            let flow = self.conductance * p;
            return Passed { flow, by_drop: R::ZERO, by_pressure: self.conductance, exponent: R::ZERO };
        }
        let reduced = part * loss;
        let square = reduced * reduced;
        let (k, m) = (two * loss * p, if into { R::ONE - two * b } else { -R::ONE });
        let under_root = k * k + two * two * square * drop * (k + m * drop);
        let s = under_root.at_least(R::ZERO).sqrt();
        let valve_part = (k + s) / (k + s + two * square * drop);
        let tube_drop = two * square * drop * drop / (k + s + two * square * drop);
        let per_s = R::ONE / s;
        let exponent = (k + two * m * tube_drop) * per_s;
        Passed {
            flow: valve * drop * valve_part,
            by_drop: valve * exponent,
            by_pressure: two * loss * valve * tube_drop * per_s,
            exponent,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// Valves from nearly closed to wider than any tube, at pressures from vacuum's neighbourhood to above the supply.
    fn situations() -> Vec<(Tube<f64>, Connection<f64>, f64)> {
        let mut all = Vec::new();
        for (length_m, diameter_m) in [(1.0, 4.0e-3), (0.5, 2.6e-3), (2.0, 6.0e-3), (0.2, 8.0e-3), (20.0, 2.0e-3)] {
            let tube = Tube::hose(length_m, diameter_m, 293.15).unwrap();
            for conductance in [1.0e-13, 1.0e-10, 1.0e-9, 4.0e-9, 1.1e-8, 5.0e-8, 1.0e-6] {
                for pressure_pa in [1.0e5, 7.0e5] {
                    for p in [2.0e4, 1.02e5, 1.5e5, 3.6e5, 6.0e5, 6.95e5, 8.0e5, 3.0e6] {
                        all.push((tube, Connection { conductance, pressure_pa }, p));
                    }
                }
            }
        }
        all
    }

    /// Flow through the tube by ISO 6358, written as in the standard.
    fn iso_6358(tube: &Tube<f64>, up: f64, down: f64) -> f64 {
        let beyond = ((down / up - tube.critical_ratio) / (1.0 - tube.critical_ratio)).max(0.0);
        tube.conductance * up * (1.0 - beyond * beyond).max(0.0).sqrt()
    }

    /// The flow for which valve and tube have the same pressure between them, by bisection.
    fn searched(tube: &Tube<f64>, valve: &Connection<f64>, p: f64) -> f64 {
        let (mut near_chamber, mut near_valve) = (p, valve.pressure_pa);
        for _ in 0..200 {
            let between = 0.5 * (near_chamber + near_valve);
            let (by_valve, by_tube) = if valve.pressure_pa > p {
                (valve.conductance * (valve.pressure_pa - between), iso_6358(tube, between, p))
            } else {
                (valve.conductance * (between - valve.pressure_pa), iso_6358(tube, p, between))
            };
            if by_valve > by_tube { near_chamber = between } else { near_valve = between }
        }
        // Of the two the one whose difference of pressures is the larger errs less.
        let drop = valve.conductance * (valve.pressure_pa - near_chamber);
        let far = (valve.pressure_pa - near_chamber).abs() > 0.5 * (valve.pressure_pa - p).abs();
        let tube =
            if valve.pressure_pa > p { iso_6358(tube, near_chamber, p) } else { -iso_6358(tube, p, near_chamber) };
        if far { drop } else { tube }
    }

    #[test]
    fn the_closed_form_is_the_solution_of_valve_and_iso_6358_choked_or_not_either_way() {
        let (mut choked, mut into, mut out) = (0, 0, 0);
        for (tube, valve, p) in situations() {
            let (found, wanted) = (tube.inflow(&valve, true, p), searched(&tube, &valve, p));
            let error = (found.mass_flow - wanted).abs();
            assert!(error <= 1e-9 * wanted.abs(), "{tube:?} {valve:?} {p}: {} {wanted}", found.mass_flow);
            choked += usize::from(found.opening_exponent == 0.0);
            if wanted > 0.0 { into += 1 } else { out += 1 }
        }
        assert!(choked > 10 && into > 100 && out > 100, "{choked} {into} {out}");
    }

    #[test]
    fn single_precision_gives_the_same_flow() {
        for (tube, valve, p) in situations() {
            let small = Tube { conductance: tube.conductance as f32, critical_ratio: tube.critical_ratio as f32 };
            let (conductance, pressure_pa) = (valve.conductance as f32, valve.pressure_pa as f32);
            let exact = tube.inflow(&valve, true, p);
            let found = small.inflow(&Connection { conductance, pressure_pa }, true, p as f32);
            let near = |found: f32, wanted: f64, of: f64| (f64::from(found) - wanted).abs() <= 1e-4 * of.abs();
            assert!(
                near(found.mass_flow, exact.mass_flow, exact.mass_flow),
                "{tube:?} {valve:?} {p}: {found:?} {exact:?}"
            );
            assert!(
                near(found.by_supply, exact.by_supply, valve.conductance),
                "{tube:?} {valve:?} {p}: {found:?} {exact:?}"
            );
        }
    }

    #[test]
    fn derivatives_are_those_of_difference_quotients() {
        for (tube, valve, p) in situations() {
            let at = tube.inflow(&valve, true, p);
            let quotient = |low: Flow<f64>, high: Flow<f64>, width: f64| (high.mass_flow - low.mass_flow) / width;
            let step = 1e-6;
            let pressed = |p: f64| tube.inflow(&valve, true, p);
            let by_chamber = quotient(pressed(p - step * p), pressed(p + step * p), 2.0 * step * p);
            let fed =
                |factor: f64| tube.inflow(&Connection { pressure_pa: factor * valve.pressure_pa, ..valve }, true, p);
            let by_supply = quotient(fed(1.0 - step), fed(1.0 + step), 2.0 * step * valve.pressure_pa);
            let opened =
                |factor: f64| tube.inflow(&Connection { conductance: factor * valve.conductance, ..valve }, true, p);
            let by_log = quotient(opened(1.0 - step), opened(1.0 + step), 2.0 * step);
            // A difference quotient over 2 ppm of flows that round to 16 digits, beside a jump of the second derivative at choking.
            let size = 1e-5 * (valve.conductance + at.mass_flow.abs() / p);
            assert!(
                (at.by_chamber - by_chamber).abs() < size,
                "{tube:?} {valve:?} {p}: {} {by_chamber}",
                at.by_chamber
            );
            assert!((at.by_supply - by_supply).abs() < size, "{tube:?} {valve:?} {p}: {} {by_supply}", at.by_supply);
            let exponent = by_log / at.mass_flow;
            assert!(
                at.mass_flow == 0.0 || (at.opening_exponent - exponent).abs() < 1e-5,
                "{tube:?} {valve:?} {p}: {} {exponent}",
                at.opening_exponent
            );
            let out = tube.inflow(&valve, false, p);
            assert_eq!(Flow { by_supply: at.by_supply, ..out }, at, "atmosphere does not change");
            assert_eq!(out.by_supply, 0.0);
        }
    }

    #[test]
    fn a_tube_takes_its_part_of_the_drop_with_the_square_of_the_flow() {
        // 1 m of 4 mm behind the valve of case (a), filling at the rest pressure: C = 1.42e-8 kg/(s Pa), b = 0.354.
        let tube = Tube::hose(1.0, 4.0e-3, 293.0).unwrap();
        let taken = |opening: f64| {
            let conductance = 6.9501e-9 * opening * core::f64::consts::FRAC_PI_2;
            let valve = Connection { conductance, pressure_pa: 7.0e5 };
            1.0 - tube.inflow(&valve, true, 3.618e5).mass_flow / valve.inflow(true, 3.618e5).mass_flow
        };
        // A linear law in series would take 40 % and 8 %.
        let (wide, narrow) = (taken(1.0), taken(0.125));
        assert!((wide - 0.1315).abs() < 0.001 && (narrow - 0.0028).abs() < 1e-4, "{wide} {narrow}");
    }

    #[test]
    fn nothing_flows_through_a_closed_valve_nor_between_equal_pressures_and_no_pressure_is_no_trouble() {
        let tube = Tube::hose(1.0, 4.0e-3, 293.0).unwrap();
        let flow = |conductance, pressure_pa, p| tube.inflow(&Connection { conductance, pressure_pa }, true, p);
        assert_eq!(flow(0.0, 7.0e5, 3.0e5).mass_flow, 0.0);
        let level = flow(1.0e-8, 3.0e5, 3.0e5);
        assert_eq!(level.mass_flow, 0.0);
        // As through the valve alone.
        assert!((level.by_supply - 1.0e-8).abs() < 1e-20 && (level.by_chamber + 1.0e-8).abs() < 1e-20, "{level:?}");
        for (pressure_pa, p) in [(0.0, 0.0), (7.0e5, 0.0), (0.0, 7.0e5), (7.0e5, -1.0e3)] {
            for conductance in [0.0, 1.0e-8] {
                let found = flow(conductance, pressure_pa, p);
                let parts = [found.mass_flow, found.by_chamber, found.by_supply, found.opening_exponent];
                assert!(parts.iter().all(|part| part.is_finite()), "{pressure_pa} {p}: {found:?}");
            }
        }
    }
}
