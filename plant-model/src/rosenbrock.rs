//! Two Rosenbrock methods of order 3 with an embedded order 2, both L-stable (Sandu et al. 1997, "Benchmarking stiff ODE
//! solvers for atmospheric chemistry problems II"):
//!
//! | method | stages | right-hand sides | used |
//! | --- | --- | --- | --- |
//! | ROS3 | 3 | 2 | the paper's model under error control: a quarter cheaper a step |
//! | Rodas3 | 4 | 3 | under effects, and for equal steps |
//!
//! Rodas3 is stiffly accurate, and its third evaluation lies at the end of the step. So it sees a jump of the friction at
//! the reversal (`friction-asymmetry`) that ROS3 steps over, and a breakaway within a step that nobody rejects overshoots
//! less.
//!
//! With the exact Jacobian `J`, every stage solves `(1/(gamma h) - J) k = r`. For this plant `J` is an arrow pointing at
//! the velocity, so that a solution costs a few sums of products instead of a matrix factorisation. An incomplete
//! Jacobian would still integrate, but at a lower order that the error estimate does not see: a test compares with
//! finite differences.

use crate::effects::terms::Term;
use crate::effects::valve_lag::SpoolSolution;
use crate::plant::{Plant, State};
use crate::real::Real;
use crate::right_hand_side::{Drive, Jacobian, WarmthRow};

/// The linear systems of one step, `(1/(gamma h) - J) k = r`, eliminated towards the velocity: `k_v` is a weighted sum of the
/// right-hand side, everything else follows from `k_v`. All weights are computed once a step; a solution then costs
/// a few multiplications that do not wait for each other.
struct Stages<R> {
    inverse_y: R,
    /// Pressures from right-hand sides: own, cross (cross-piston leak), position, velocity.
    a_a: R,
    a_b: R,
    a_y: R,
    a_v: R,
    b_b: R,
    b_a: R,
    b_y: R,
    b_v: R,
    /// Bristle from right-hand side and pressures, position, velocity.
    z_z: R,
    z_y: R,
    z_p: R,
    z_v: R,
    /// Velocity from right-hand sides.
    v_v: R,
    v_y: R,
    v_a: R,
    v_b: R,
    v_z: R,
    extra: Extra<R>,
}

/// The additional states' part of the linear systems.
#[derive(Clone, Copy, Default)]
struct Extra<R> {
    feels_apart: bool,
    spool: SpoolSolution<R>,
    supply: R,
    supply_spool_a: R,
    supply_spool_b: R,
    filled_a: R,
    filled_b: R,
    a_spool: R,
    b_spool: R,
    a_supply: R,
    b_supply: R,
    sensed: R,
    sensed_gain: R,
    y_sensed: R,
    y_sensed_gain: R,
    /// Present where the chambers' air has a temperature of its own.
    warmths: Option<[Warmth<R>; 2]>,
}

/// A warmth is a leaf of the arrow: its equation is solved for it and put into that of the chamber's pressure, the only
/// other one in which it stands.
#[derive(Clone, Copy)]
struct Warmth<R> {
    row: WarmthRow<R>,
    inverse: R,
    /// What the warmth's right-hand side, and all that it depends on, adds to the pressure's equation.
    into_pressure: R,
}

impl<R: Real> Warmth<R> {
    fn new(row: &WarmthRow<R>, diagonal: R) -> Self {
        let inverse = R::ONE / (diagonal - row.by_warmth);
        Self { row: *row, inverse, into_pressure: row.pressure_by_warmth * inverse }
    }

    /// `own` and `other` are the chambers' pressures, `spool_v` is the spool's place as the chamber feels it.
    fn solve(&self, right: R, [own, other]: [R; 2], spool_v: R, k: &State<R>) -> R {
        let r = &self.row;
        let gas = r.by_pressure * own + r.by_other_pressure * other;
        let motion = r.by_velocity * k.v_m_per_s + r.by_position * k.y_m;
        (right + gas + motion + r.by_supply * k.p_sup_pa + r.by_spool * spool_v) * self.inverse
    }
}

/// The Jacobian with both warmths eliminated.
fn without_warmth<R: Real>(jacobian: &Jacobian<R>, [a, b]: &[Warmth<R>; 2]) -> Jacobian<R> {
    let mut j = *jacobian;
    j.a_a += a.into_pressure * a.row.by_pressure;
    j.a_b += a.into_pressure * a.row.by_other_pressure;
    j.a_v += a.into_pressure * a.row.by_velocity;
    j.a_y += a.into_pressure * a.row.by_position;
    j.a_supply += a.into_pressure * a.row.by_supply;
    j.a_spool += a.into_pressure * a.row.by_spool;
    j.b_b += b.into_pressure * b.row.by_pressure;
    j.b_a += b.into_pressure * b.row.by_other_pressure;
    j.b_v += b.into_pressure * b.row.by_velocity;
    j.b_y += b.into_pressure * b.row.by_position;
    j.b_supply += b.into_pressure * b.row.by_supply;
    j.b_spool += b.into_pressure * b.row.by_spool;
    j
}

impl<R: Real> Extra<R> {
    fn new(plant: &Plant<R>, j: &Jacobian<R>, diagonal: R) -> Self {
        let added = &plant.added;
        let supply = R::ONE / (diagonal - j.supply_supply);
        let sensed_gain = added.pressure_lag.inverse_s();
        let y_sensed_gain = added.position_lag.inverse_s();
        // Only a chamber that is being filled depends on the supply, and the supply on it.
        let (filled_a, filled_b) = (j.supply_a * supply, j.supply_b * supply);
        Self {
            feels_apart: plant.feels_apart(),
            spool: added.valve_lag.solution(diagonal),
            supply,
            supply_spool_a: j.supply_spool_a,
            supply_spool_b: j.supply_spool_b,
            filled_a,
            filled_b,
            a_spool: j.a_spool,
            b_spool: j.b_spool,
            a_supply: j.a_supply,
            b_supply: j.b_supply,
            sensed: R::ONE / (diagonal + sensed_gain),
            sensed_gain,
            y_sensed: R::ONE / (diagonal + y_sensed_gain),
            y_sensed_gain,
            warmths: None,
        }
    }
}

impl<R: Real> Stages<R> {
    /// `diagonal` is `1/(gamma h)`.
    #[inline(always)]
    fn new<const EXTENDED: bool>(plant: &Plant<R>, j: &Jacobian<R>, gamma_h: R, diagonal: R, held: bool) -> Self {
        let zero = R::ZERO;
        let inverse_y = gamma_h;
        let mut extra = Extra::default();
        let folded;
        let (mut j, mut warmths) = (j, None);
        if EXTENDED && plant.added.wall_heat.is_present() {
            let pair = [Warmth::new(&j.warmth_a, diagonal), Warmth::new(&j.warmth_b, diagonal)];
            folded = without_warmth(j, &pair);
            (j, warmths) = (&folded, Some(pair));
        }
        let (diagonal_a, diagonal_b) = (diagonal - j.a_a, diagonal - j.b_b);
        let (a_a, a_b, b_b, b_a);
        if EXTENDED {
            extra = Extra { warmths, ..Extra::new(plant, j, diagonal) };
            let (diagonal_a, diagonal_b) =
                (diagonal_a - j.a_supply * extra.filled_a, diagonal_b - j.b_supply * extra.filled_b);
            // Chambers that are filled at the same time, behind hoses of other lengths, also share the supply.
            let (by_b, by_a) = (j.a_b + j.a_supply * extra.filled_b, j.b_a + j.b_supply * extra.filled_a);
            let inverse_determinant = R::ONE / (diagonal_a * diagonal_b - by_b * by_a);
            a_a = diagonal_b * inverse_determinant;
            b_b = diagonal_a * inverse_determinant;
            a_b = by_b * inverse_determinant;
            b_a = by_a * inverse_determinant;
        } else {
            (a_a, b_b) = (R::ONE / diagonal_a, R::ONE / diagonal_b);
            (a_b, b_a) = (zero, zero);
        }
        let z_z = R::ONE / (diagonal - j.z_z);
        // Position reaches the pressures as `a_y k_y`, with `k_y = (r_y + k_v) inverse_y`.
        let (by_y_a, by_y_b) = (j.a_y * inverse_y, j.b_y * inverse_y);
        let (a_y, b_y, a_v, b_v);
        if EXTENDED {
            (a_y, b_y) = (by_y_a * a_a + by_y_b * a_b, by_y_b * b_b + by_y_a * b_a);
            (a_v, b_v) = (j.a_v * a_a + j.b_v * a_b + a_y, j.b_v * b_b + j.a_v * b_a + b_y);
        } else {
            (a_y, b_y) = (by_y_a * a_a, by_y_b * b_b);
            (a_v, b_v) = (j.a_v * a_a + a_y, j.b_v * b_b + b_y);
        }
        let (mut z_y, mut z_p, mut z_v) = (zero, zero, j.z_v * z_z);
        if EXTENDED {
            z_p = j.z_p * z_z;
            z_y = j.z_y * inverse_y * z_z + z_p * (a_y + b_y);
            z_v += j.z_y * inverse_y * z_z + z_p * (a_v + b_v);
        }
        let mut pivot = (diagonal - j.v_v) - (j.v_p * (a_v - b_v) + j.v_z * z_v);
        if EXTENDED {
            pivot = pivot - j.v_y * inverse_y - j.v_level_p * (a_v + b_v) - j.v_uneven * a_v;
        }
        let v_v = if held { zero } else { R::ONE / pivot };
        let v_p = j.v_p * v_v;
        let v_z_of = j.v_z * v_v;
        let (v_y, v_a, v_b);
        if EXTENDED {
            // What a pressure does to the velocity: directly, through the sliding force, through the bristle.
            let v_level = j.v_level_p * v_v + v_z_of * z_p;
            let (from_a, from_b) = (v_level + v_p + j.v_uneven * v_v, v_level - v_p);
            v_a = from_a * a_a + from_b * b_a;
            v_b = from_b * b_b + from_a * a_b;
            v_y = j.v_y * inverse_y * v_v + from_a * a_y + from_b * b_y + v_z_of * j.z_y * inverse_y * z_z;
        } else {
            (v_a, v_b) = (v_p * a_a, -(v_p * b_b));
            v_y = v_p * (a_y - b_y);
        }
        Self {
            inverse_y,
            a_a,
            a_b,
            a_y,
            a_v,
            b_b,
            b_a,
            b_y,
            b_v,
            z_z,
            z_y,
            z_p,
            z_v,
            v_v,
            v_y,
            v_a,
            v_b,
            v_z: v_z_of * z_z,
            extra,
        }
    }

    #[inline(always)]
    fn solve<const EXTENDED: bool>(&self, r: &State<R>) -> State<R> {
        let mut k = State::default();
        let (mut r_a, mut r_b) = (r.p_a_pa, r.p_b_pa);
        let x = &self.extra;
        let mut spool_b_v = R::ZERO;
        if EXTENDED {
            k.spool_v = r.spool_v * x.spool.w_w + r.spool_v_per_s * x.spool.w_r;
            k.spool_v_per_s = k.spool_v * x.spool.r_w + r.spool_v_per_s * x.spool.r_r;
            if x.feels_apart {
                k.spool_b_v = r.spool_b_v * x.spool.w_w + r.spool_b_v_per_s * x.spool.w_r;
                k.spool_b_v_per_s = k.spool_b_v * x.spool.r_w + r.spool_b_v_per_s * x.spool.r_r;
                spool_b_v = k.spool_b_v;
            } else {
                spool_b_v = k.spool_v;
            }
            // The supply without what the filled chamber's own change adds to it.
            k.p_sup_pa = (r.p_sup_pa + x.supply_spool_a * k.spool_v + x.supply_spool_b * spool_b_v) * x.supply;
            r_a += x.a_spool * k.spool_v + x.a_supply * k.p_sup_pa;
            r_b += x.b_spool * spool_b_v + x.b_supply * k.p_sup_pa;
            if let Some([warmth_a, warmth_b]) = &x.warmths {
                r_a += warmth_a.into_pressure * r.warmth_a;
                r_b += warmth_b.into_pressure * r.warmth_b;
            }
        }
        let v = (self.v_v * r.v_m_per_s + self.v_y * r.y_m) + (self.v_a * r_a + self.v_b * r_b) + self.v_z * r.z_m;
        k.v_m_per_s = v;
        k.y_m = (r.y_m + v) * self.inverse_y;
        let (mut a, mut b) = (self.a_a * r_a, self.b_b * r_b);
        k.z_m = self.z_z * r.z_m + self.z_v * v;
        if EXTENDED {
            a += self.a_b * r_b;
            b += self.b_a * r_a;
            k.z_m += self.z_y * r.y_m + self.z_p * (a + b);
        }
        k.p_a_pa = (a + self.a_y * r.y_m) + self.a_v * v;
        k.p_b_pa = (b + self.b_y * r.y_m) + self.b_v * v;
        if EXTENDED {
            k.p_sup_pa += x.filled_a * k.p_a_pa + x.filled_b * k.p_b_pa;
            k.p_a_sensed_pa = (r.p_a_sensed_pa + x.sensed_gain * k.p_a_pa) * x.sensed;
            k.p_b_sensed_pa = (r.p_b_sensed_pa + x.sensed_gain * k.p_b_pa) * x.sensed;
            k.y_sensed_m = (r.y_sensed_m + x.y_sensed_gain * k.y_m) * x.y_sensed;
            if let Some([warmth_a, warmth_b]) = &x.warmths {
                k.warmth_a = warmth_a.solve(r.warmth_a, [k.p_a_pa, k.p_b_pa], k.spool_v, &k);
                k.warmth_b = warmth_b.solve(r.warmth_b, [k.p_b_pa, k.p_a_pa], spool_b_v, &k);
            }
        }
        k
    }
}

impl<R: Real> State<R> {
    /// `factor self`, field by field.
    #[inline(always)]
    fn times<const EXTENDED: bool>(&self, factor: R) -> Self {
        let mut product = Self {
            y_m: factor * self.y_m,
            v_m_per_s: factor * self.v_m_per_s,
            p_a_pa: factor * self.p_a_pa,
            p_b_pa: factor * self.p_b_pa,
            z_m: factor * self.z_m,
            ..Self::default()
        };
        if EXTENDED {
            product.spool_v = factor * self.spool_v;
            product.spool_v_per_s = factor * self.spool_v_per_s;
            product.spool_b_v = factor * self.spool_b_v;
            product.spool_b_v_per_s = factor * self.spool_b_v_per_s;
            product.p_sup_pa = factor * self.p_sup_pa;
            product.p_a_sensed_pa = factor * self.p_a_sensed_pa;
            product.p_b_sensed_pa = factor * self.p_b_sensed_pa;
            product.y_sensed_m = factor * self.y_sensed_m;
            product.warmth_a = factor * self.warmth_a;
            product.warmth_b = factor * self.warmth_b;
        }
        product
    }

    /// `self + factor other`, field by field.
    #[inline(always)]
    fn plus<const EXTENDED: bool>(&self, factor: R, other: &Self) -> Self {
        let mut sum = Self {
            y_m: self.y_m + factor * other.y_m,
            v_m_per_s: self.v_m_per_s + factor * other.v_m_per_s,
            p_a_pa: self.p_a_pa + factor * other.p_a_pa,
            p_b_pa: self.p_b_pa + factor * other.p_b_pa,
            z_m: self.z_m + factor * other.z_m,
            ..Self::default()
        };
        if EXTENDED {
            sum.spool_v = self.spool_v + factor * other.spool_v;
            sum.spool_v_per_s = self.spool_v_per_s + factor * other.spool_v_per_s;
            sum.spool_b_v = self.spool_b_v + factor * other.spool_b_v;
            sum.spool_b_v_per_s = self.spool_b_v_per_s + factor * other.spool_b_v_per_s;
            sum.p_sup_pa = self.p_sup_pa + factor * other.p_sup_pa;
            sum.p_a_sensed_pa = self.p_a_sensed_pa + factor * other.p_a_sensed_pa;
            sum.p_b_sensed_pa = self.p_b_sensed_pa + factor * other.p_b_sensed_pa;
            sum.y_sensed_m = self.y_sensed_m + factor * other.y_sensed_m;
            sum.warmth_a = self.warmth_a + factor * other.warmth_a;
            sum.warmth_b = self.warmth_b + factor * other.warmth_b;
        }
        sum
    }
}

/// One step of ROS3 for a plant that uses none of the additional states: the new state and the difference to the
/// embedded second-order solution.
#[inline(always)]
pub(crate) fn ros3<R: Real>(
    plant: &Plant<R>,
    state: &State<R>,
    drive: &Drive<R>,
    held: bool,
    h: R,
) -> (State<R>, State<R>) {
    // The root of 6 g^3 - 18 g^2 + 9 g - 1 that makes the method L-stable.
    const GAMMA: f64 = 0.435_866_521_508_459;
    // How earlier stages enter the right-hand side of a later one, times h.
    const C21: f64 = -1.015_617_108_387_770_2;
    const C31: f64 = 4.075_995_645_253_77;
    const C32: f64 = 9.207_679_429_833_08;
    // Weights of the stages in the step (of the first: 1) and in the difference to the embedded solution.
    const M2: f64 = 6.169_794_704_382_824;
    const M3: f64 = -0.427_722_565_432_185_73;
    const E1: f64 = 0.5;
    const E2: f64 = -2.907_955_871_680_547;
    const E3: f64 = 0.223_540_698_978_115_7;

    let (f1, jacobian) = plant.linearise::<false>(state, drive, held);
    let inverse_h = R::ONE / h;
    let stages = Stages::new::<false>(plant, &jacobian, R::of(GAMMA) * h, R::of(1.0 / GAMMA) * inverse_h, held);
    let k1 = stages.solve::<false>(&f1);
    let first = state.plus::<false>(R::ONE, &k1);
    let f2 = plant.rates::<false>(&first, drive, held);
    let k2 = stages.solve::<false>(&f2.plus::<false>(R::of(C21) * inverse_h, &k1));
    let r3 = f2.plus::<false>(R::of(C31) * inverse_h, &k1).plus::<false>(R::of(C32) * inverse_h, &k2);
    let k3 = stages.solve::<false>(&r3);
    let next = first.plus::<false>(R::of(M2), &k2).plus::<false>(R::of(M3), &k3);
    let error = k1.times::<false>(R::of(E1)).plus::<false>(R::of(E2), &k2).plus::<false>(R::of(E3), &k3);
    (next, error)
}

/// One step of Rodas3: the new state and the difference to the embedded second-order solution.
///
/// The second stage enters only as `(k1 - k2)/h`, which is `-4/h^2` times the solution for the right-hand side `k1`.
#[inline(always)]
pub(crate) fn rodas3<R: Real, const EXTENDED: bool>(
    plant: &Plant<R>,
    state: &State<R>,
    drive: &Drive<R>,
    held: bool,
    h: R,
) -> (State<R>, State<R>) {
    let (f1, jacobian) = plant.linearise::<EXTENDED>(state, drive, held);
    let inverse_h = R::ONE / h;
    let two = R::ONE + R::ONE;
    let stages = Stages::new::<EXTENDED>(plant, &jacobian, R::HALF * h, two * inverse_h, held);
    let k1 = stages.solve::<EXTENDED>(&f1);
    let change = stages.solve::<EXTENDED>(&k1).times::<EXTENDED>(-(two + two) * inverse_h * inverse_h);
    let base = state.plus::<EXTENDED>(two, &k1);
    let f3 = plant.rates::<EXTENDED>(&base, drive, held);
    let k3 = stages.solve::<EXTENDED>(&change.plus::<EXTENDED>(R::ONE, &f3));
    let inner = base.plus::<EXTENDED>(R::ONE, &k3);
    let f4 = plant.rates::<EXTENDED>(&inner, drive, held);
    let r4 = change.plus::<EXTENDED>(R::of(-8.0 / 3.0) * inverse_h, &k3).plus::<EXTENDED>(R::ONE, &f4);
    let k4 = stages.solve::<EXTENDED>(&r4);
    (inner.plus::<EXTENDED>(R::ONE, &k4), k4)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::{Effect, Effects};
    use crate::plant::Inputs;
    use crate::rig::Rig;
    use proptest::prelude::*;
    use std::vec::Vec;

    const STATES: usize = 15;
    /// Sizes for which a change is felt, by component: for difference quotients.
    const SCALE: [f64; STATES] = [1e-2, 1e-1, 1e5, 1e5, 1e-5, 1.0, 1e5, 1e5, 1e5, 0.1, 0.1, 1e2, 1e-2, 1.0, 1e2];

    fn to_array(s: &State<f64>) -> [f64; STATES] {
        [
            s.y_m,
            s.v_m_per_s,
            s.p_a_pa,
            s.p_b_pa,
            s.z_m,
            s.spool_v,
            s.p_sup_pa,
            s.p_a_sensed_pa,
            s.p_b_sensed_pa,
            s.warmth_a,
            s.warmth_b,
            s.spool_v_per_s,
            s.y_sensed_m,
            s.spool_b_v,
            s.spool_b_v_per_s,
        ]
    }

    fn to_state(x: &[f64; STATES]) -> State<f64> {
        let [y_m, v_m_per_s, p_a_pa, p_b_pa, z_m, spool_v, p_sup_pa, rest @ ..] = *x;
        let [p_a_sensed_pa, p_b_sensed_pa, warmth_a, warmth_b, spool_v_per_s, y_sensed_m, spool_b_v, spool_b_v_per_s] =
            rest;
        State {
            y_m,
            v_m_per_s,
            p_a_pa,
            p_b_pa,
            z_m,
            spool_v,
            spool_v_per_s,
            spool_b_v,
            spool_b_v_per_s,
            p_sup_pa,
            p_a_sensed_pa,
            p_b_sensed_pa,
            y_sensed_m,
            warmth_a,
            warmth_b,
        }
    }

    /// `(2/h - J) k` by difference quotients along `k`; `None` where the right-hand side has a kink nearby.
    fn multiplied(
        rates: &dyn Fn(&State<f64>) -> State<f64>,
        at: &State<f64>,
        k: &State<f64>,
        h: f64,
    ) -> Option<[f64; STATES]> {
        let (x, direction) = (to_array(at), to_array(k));
        let length = direction.iter().zip(SCALE).map(|(d, s)| (d / s).abs()).fold(0.0, f64::max);
        let step = 1e-6 / length;
        let shifted = |factor: f64| {
            let moved: [f64; STATES] = core::array::from_fn(|i| x[i] + factor * direction[i]);
            to_array(&rates(&to_state(&moved)))
        };
        let (ahead, here, behind) = (shifted(step), shifted(0.0), shifted(-step));
        let mut product = [0.0; STATES];
        for i in 0..STATES {
            let (right, left) = ((ahead[i] - here[i]) / step, (here[i] - behind[i]) / step);
            let size = right.abs().max(left.abs()).max(1e-6 * here[i].abs() / step);
            if (right - left).abs() > 1e-2 * size {
                return None;
            }
            product[i] = 2.0 / h * direction[i] - 0.5 * (right + left);
        }
        Some(product)
    }

    fn effect_subset() -> impl Strategy<Value = Effects<f64>> {
        proptest::collection::vec(proptest::option::weighted(0.3, 0.5f64..1.5), Effect::ALL.len()).prop_map(|factors| {
            let mut effects = Effects::none();
            for (effect, factor) in Effect::ALL.into_iter().zip(factors) {
                let Some(factor) = factor else { continue };
                let values: Vec<f64> =
                    effect.info().parameters.iter().map(|p| (p.typical * factor).clamp(p.min, p.max)).collect();
                effects.set(effect, &values);
            }
            effects
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

        #[test]
        fn stage_solutions_invert_the_jacobian_of_any_state_and_effects(
            effects in effect_subset(),
            y in -0.45f64..0.45,
            v in prop_oneof![-0.02f64..0.02, -1.0f64..1.0],
            p in (1.2e5f64..6.5e5, 1.2e5f64..6.5e5, 5e5f64..6.9e5),
            z in -6e-5f64..6e-5,
            u in (-3.0f64..3.0, -3.0f64..3.0),
            h in prop_oneof![Just(1e-5f64), Just(1e-3)],
            bought in 0..5u8,
            warmths in (-0.15f64..0.15, -0.15f64..0.15),
            spool in (prop_oneof![Just(0.0), 0.05f64..1.5], -300.0f64..300.0),
            corners in (prop_oneof![Just(0.0), 0.02f64..0.4], prop_oneof![Just(0.0), -0.4f64..0.4], prop_oneof![Just(0.0), 0.3f64..1.0]),
            far in (-3.0f64..3.0, -300.0f64..300.0),
            r in proptest::array::uniform15(-1.0f64..1.0),
        ) {
            let mut rig = Rig::<f64>::paper_a();
            rig.friction.damping_n_s_per_m = 450.0;
            rig.valve.spool_inertia = spool.0;
            (rig.valve.corner_rounding_v, rig.valve.exhaust_overlap_v) = (corners.0, corners.1);
            // The fourth has all but ISO 6358 and its opening.
            if (1..4).contains(&bought) {
                let v = &mut rig.valve;
                (v.fill_coefficient_kg_per_s_pa, v.exhaust_coefficient_kg_per_s_pa) = (0.0, 0.0);
                (v.fill_conductance_a_m3_per_s_pa, v.fill_conductance_b_m3_per_s_pa) = (1.0e-8, 1.1e-8);
                (v.exhaust_conductance_a_m3_per_s_pa, v.exhaust_conductance_b_m3_per_s_pa) = (1.2e-8, 0.9e-8);
                (v.fill_critical_ratio_a, v.exhaust_critical_ratio_a) = (0.25, 0.35);
                rig.cylinder.area_b_m2 = 4.0e-4;
                rig.load.inclination_deg = 40.0;
                let points = [[-5.0, -1.0], [-0.5, -0.1], [0.1, 0.0], [0.3, 0.0], [1.5, 0.4], [4.0, 1.0]];
                rig.opening = crate::OpeningTable::new(&points).unwrap();
                [rig.valve.dead_zone_left_v, rig.valve.dead_zone_right_v] = rig.opening.closed_v();
                rig.valve.opening_smoothness = corners.2;
            }
            if bought > 1 {
                let hoses = &mut rig.hoses;
                (hoses.a_length_m, hoses.a_diameter_m) = (1.5, 4.0e-3);
                (hoses.b_length_m, hoses.b_diameter_m) = (0.3, 2.5e-3);
                let cushions = &mut rig.cushions;
                // Mouths of 45 mm on either side of the middle.
                (cushions.cushion_a_length_m, cushions.cushion_a_conductance_m3_per_s_pa) = (0.45, 2.0e-9);
                (cushions.cushion_b_length_m, cushions.cushion_b_conductance_m3_per_s_pa) = (0.45, 3.0e-9);
            }
            if bought == 3 {
                (rig.cylinder.spring_n_per_m, rig.cylinder.spring_preload_n) = (400.0, 20.0);
            }
            let Ok(plant) = Plant::new(&rig, &effects) else { return Ok(()) };
            let inputs = Inputs { u_v: u.0, external_force_n: 3.0, supply_pa: 7e5 };
            let drive = plant.drive(&inputs);
            let mut state = to_state(&[
                y, v, p.0, p.1, z, u.1, p.2, p.0 + 100.0, p.1 - 100.0, warmths.0, warmths.1, spool.1, y + 0.003, far.0, far.1,
            ]);
            plant.settle(&mut state, &drive);
            // States that follow their sources at once have no rate: their right-hand side is zero.
            let mut right: [f64; STATES] = core::array::from_fn(|i| r[i] * SCALE[i] / h);
            let (lags, moves) = (plant.added.valve_lag.is_present(), plant.added.valve_lag.has_inertia());
            if !lags { right[5] = 0.0; }
            if !moves { right[11] = 0.0; }
            if !(lags && plant.feels_apart()) { right[13] = 0.0; }
            if !(moves && plant.feels_apart()) { right[14] = 0.0; }
            if !plant.added.supply_droop.is_present() { right[6] = 0.0; }
            if !plant.added.pressure_lag.is_present() { right[7] = 0.0; right[8] = 0.0; }
            if !plant.added.position_lag.is_present() { right[12] = 0.0; }
            if !plant.added.wall_heat.is_present() { right[9] = 0.0; right[10] = 0.0; }

            let check = |k: State<f64>, rates: &dyn Fn(&State<f64>) -> State<f64>| {
                let Some(back) = multiplied(rates, &state, &k, h) else { return Ok(()) };
                for i in 0..STATES {
                    if right[i] == 0.0 { continue }
                    let error = (back[i] - right[i]).abs();
                    let size = right[i].abs() + 2.0 / h * (SCALE[i] + to_array(&k)[i].abs());
                    prop_assert!(error < 2e-3 * size, "component {}: {} instead of {}", i, back[i], right[i]);
                }
                Ok(())
            };
            let r = to_state(&right);
            if plant.is_extended() {
                let (_, jacobian) = plant.linearise::<true>(&state, &drive, false);
                let k = Stages::new::<true>(&plant, &jacobian, 0.5 * h, 2.0 / h, false).solve::<true>(&r);
                check(k, &|x| plant.rates::<true>(x, &drive, false))?;
            } else {
                let (_, jacobian) = plant.linearise::<false>(&state, &drive, false);
                let k = Stages::new::<false>(&plant, &jacobian, 0.5 * h, 2.0 / h, false).solve::<false>(&r);
                check(k, &|x| plant.rates::<false>(x, &drive, false))?;
            }
        }
    }

    #[test]
    fn halving_the_step_reduces_the_error_eightfold() {
        // Case (c) sliding: the fastest gas dynamics of the three rigs, no kink in the window.
        let plant = Plant::new(&Rig::<f64>::paper_c(), &Effects::none()).unwrap();
        let drive = plant.drive(&plant.inputs(1.0));
        let start = State { v_m_per_s: 0.4, z_m: 4.6e-5, ..plant.state_at_rest(-0.05, 4.0e5, 3.0e5) };
        type Step = fn(&Plant<f64>, &State<f64>, &Drive<f64>, f64) -> State<f64>;
        let methods: [(&str, Step); 2] = [
            ("ROS3", |plant, state, drive, h| ros3::<f64>(plant, state, drive, false, h).0),
            ("Rodas3", |plant, state, drive, h| rodas3::<f64, false>(plant, state, drive, false, h).0),
        ];
        for (name, step) in methods {
            let after = |steps: u32| {
                let h = 0.032 / f64::from(steps);
                (0..steps).fold(start, |state, _| step(&plant, &state, &drive, h))
            };
            let truth = after(4096);
            let errors: Vec<f64> = [16, 32, 64, 128].map(|n| (after(n).p_a_pa - truth.p_a_pa).abs()).to_vec();
            for pair in errors.windows(2) {
                let order = (pair[0] / pair[1]).log2();
                assert!(order > 2.7, "{name}: order {order}, errors {errors:?}");
            }
        }
    }
}
