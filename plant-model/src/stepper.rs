//! Integration over intervals of constant input.
//!
//! The method is Rodas3 (Sandu et al. 1997): a Rosenbrock method of order 3 with an embedded order 2, L-stable and
//! stiffly accurate, three evaluations of the right-hand side a step. It needs the Jacobian, which for this plant is
//! an arrow pointing at the velocity, so that the linear systems are solved by a few sums of products instead
//! of a matrix factorisation. Being L-stable it takes steps that the bristles' stiffness (2.2e4 1/s at 1 m/s) does not
//! limit; explicit Euler diverges above 90 us and Runge-Kutta 4 above 130 us.

use crate::plant::{Drive, Inputs, Jacobian, Plant, State};
use crate::real::Real;

/// Accepted error of one step (Euclidean norm over the components), absolute, in the units of the state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance<R> {
    /// Position, m.
    pub position_m: R,
    /// Velocity, m/s.
    pub velocity_m_per_s: R,
    /// Pressures (chambers, supply, sensed), Pa.
    pub pressure_pa: R,
    /// Bristle deflection, m.
    pub bristle_m: R,
    /// Spool position, V.
    pub spool_v: R,
}

impl<R: Real> Tolerance<R> {
    /// The tolerance at which simulated logs stay within 1e-6 m and 10 Pa of a tight reference over seconds.
    #[must_use]
    pub fn standard() -> Self {
        Self {
            position_m: R::of(5.0e-8),
            velocity_m_per_s: R::of(1.0e-6),
            pressure_pa: R::of(0.5),
            bristle_m: R::of(5.0e-9),
            spool_v: R::of(5.0e-5),
        }
    }

    /// The same tolerance made larger or smaller by a factor.
    #[must_use]
    pub fn scaled(self, factor: R) -> Self {
        Self {
            position_m: self.position_m * factor,
            velocity_m_per_s: self.velocity_m_per_s * factor,
            pressure_pa: self.pressure_pa * factor,
            bristle_m: self.bristle_m * factor,
            spool_v: self.spool_v * factor,
        }
    }
}

/// Reciprocals of a tolerance, multiplied instead of divided by.
#[derive(Clone, Copy, Debug)]
struct Weights<R> {
    position: R,
    velocity: R,
    pressure: R,
    bristle: R,
    spool: R,
}

/// How the interval is divided.
#[derive(Clone, Copy, Debug)]
enum Division<R> {
    /// A fixed number of equal steps: constant cost, for the microcontroller.
    Equal(u16),
    /// As many as the error estimate asks for; holds the step size to try next.
    Adaptive { weights: Weights<R>, next_s: R },
}

/// Integrates the plant; keeps the step size between calls.
#[derive(Clone, Copy, Debug)]
pub struct Stepper<R> {
    division: Division<R>,
    steps: u64,
}

/// Never more than this many steps in one call of [`Stepper::advance`]; then the rest is taken in one (L-stable) step.
const MAX_STEPS: u32 = 100_000;
/// Smallest step, s: a floor against an error estimate that cannot be met in the scalar's precision.
const MIN_STEP_S: f64 = 1.0e-8;
/// How far the piston may run past an end stop before the impact is located more closely, m.
const STOP_TOLERANCE_M: f64 = 1.0e-7;

impl<R: Real> Stepper<R> {
    /// Adaptive steps under error control.
    #[must_use]
    pub fn adaptive(tolerance: &Tolerance<R>) -> Self {
        let weights = Weights {
            position: R::ONE / tolerance.position_m,
            velocity: R::ONE / tolerance.velocity_m_per_s,
            pressure: R::ONE / tolerance.pressure_pa,
            bristle: R::ONE / tolerance.bristle_m,
            spool: R::ONE / tolerance.spool_v,
        };
        Self { division: Division::Adaptive { weights, next_s: R::of(1.0e-4) }, steps: 0 }
    }

    /// A fixed number of equal steps per call (at least one): constant cost per call.
    #[must_use]
    pub fn equal_steps(count: u16) -> Self {
        Self { division: Division::Equal(count.max(1)), steps: 0 }
    }

    /// How many steps have been taken, rejected ones included.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Advances the state by `dt` seconds under constant inputs. `dt` must be positive; otherwise nothing happens.
    #[inline]
    pub fn advance(&mut self, plant: &Plant<R>, state: &mut State<R>, inputs: &Inputs<R>, dt_s: R) {
        let runs = dt_s > R::ZERO;
        if !runs {
            return;
        }
        let drive = plant.drive(inputs);
        if plant.is_extended() {
            plant.settle(state, &drive);
            self.run::<true>(plant, state, &drive, dt_s);
        } else {
            self.run::<false>(plant, state, &drive, dt_s);
        }
        plant.settle(state, &drive);
    }

    /// One L-stable step of a plant without effects, and nothing else: what bench mode on the microcontroller needs,
    /// without the code of error control and of the additional states.
    pub fn single_step(plant: &Plant<R>, state: &mut State<R>, inputs: &Inputs<R>, dt_s: R) {
        let drive = plant.drive(inputs);
        let held = plant.held_at_stop(state, &drive);
        let (mut next, _) = rodas3::<R, false>(plant, state, &drive, held, dt_s);
        stop_at_ends(plant, &mut next);
        *state = next;
        plant.settle(state, &drive);
    }

    fn run<const EXTENDED: bool>(&mut self, plant: &Plant<R>, state: &mut State<R>, drive: &Drive<R>, dt: R) {
        match &mut self.division {
            Division::Equal(count) => {
                let h = dt / R::of(f64::from(*count));
                for _ in 0..*count {
                    let held = plant.held_at_stop(state, drive);
                    let (mut next, _) = rodas3::<R, EXTENDED>(plant, state, drive, held, h);
                    stop_at_ends(plant, &mut next);
                    *state = next;
                }
                self.steps += u64::from(*count);
            }
            Division::Adaptive { weights, next_s } => {
                let mut left = dt;
                let mut h = *next_s;
                let mut taken = 0;
                loop {
                    // Two almost equal steps instead of a full one and a sliver.
                    let last = h >= left || taken >= MAX_STEPS;
                    let step = if last {
                        left
                    } else if h + h > left {
                        left * R::HALF
                    } else {
                        h
                    };
                    taken += 1;
                    let held = plant.held_at_stop(state, drive);
                    let (mut next, error) = rodas3::<R, EXTENDED>(plant, state, drive, held, step);
                    let norm = weights.norm_squared::<EXTENDED>(&error);
                    let floor = step <= R::of(MIN_STEP_S) || taken >= MAX_STEPS;
                    // A NaN is not accepted either.
                    let accepted = norm <= R::ONE;
                    if !accepted && !floor {
                        h = (step * step_factor(norm)).at_least(R::of(MIN_STEP_S));
                        continue;
                    }
                    if let Some(sooner) = impact(plant, state, &next, step).filter(|_| !floor) {
                        h = sooner;
                        continue;
                    }
                    stop_at_ends(plant, &mut next);
                    *state = next;
                    if !last || step >= h {
                        h = step * step_factor(norm);
                    }
                    if last {
                        break;
                    }
                    left -= step;
                }
                *next_s = h.limit(R::of(MIN_STEP_S), R::of(0.1));
                self.steps += u64::from(taken);
            }
        }
    }
}

/// Growth of the step size for a squared normalised error: `0.9 norm^(-1/3)` within 0.2 … 5, without a cube root.
fn step_factor<R: Real>(norm_squared: R) -> R {
    if !norm_squared.is_finite() {
        return R::of(0.2);
    }
    // Newton's iteration for x = norm^(1/3) from a start on the right side converges in a few steps.
    let target = norm_squared.sqrt().limit(R::of(0.006), R::of(90.0));
    let mut x = if target > R::ONE { R::of(2.0) } else { R::of(0.5) };
    for _ in 0..4 {
        x = (x + x + target / (x * x)) * R::of(1.0 / 3.0);
    }
    R::of(0.9) / x
}

/// When the step would run past an end stop: the shorter step that lands on it.
#[inline]
fn impact<R: Real>(plant: &Plant<R>, from: &State<R>, to: &State<R>, step: R) -> Option<R> {
    let limit = plant.half_stroke_m();
    let beyond = to.y_m.abs() - limit;
    if beyond <= R::of(STOP_TOLERANCE_M) || from.y_m.abs() >= limit {
        return None;
    }
    let part = (limit - from.y_m.abs()) / (to.y_m.abs() - from.y_m.abs());
    let sooner = step * part.limit(R::of(0.02), R::of(0.98));
    (sooner > R::of(MIN_STEP_S)).then_some(sooner)
}

/// End stops are perfectly inelastic: at ±L/2 outward motion ends.
#[inline]
fn stop_at_ends<R: Real>(plant: &Plant<R>, state: &mut State<R>) {
    let limit = plant.half_stroke_m();
    if state.y_m.abs() > limit {
        let outward = state.y_m.sign();
        state.y_m = limit * outward;
        if state.v_m_per_s * outward > R::ZERO {
            state.v_m_per_s = R::ZERO;
        }
    }
}

impl<R: Real> Weights<R> {
    /// Square of the error in units of the tolerance (Euclidean norm); NaN if any component is.
    #[inline(always)]
    fn norm_squared<const EXTENDED: bool>(&self, error: &State<R>) -> R {
        let square = |error: R, weight: R| {
            let part = error * weight;
            part * part
        };
        let pressures = square(error.p_a_pa, self.pressure) + square(error.p_b_pa, self.pressure);
        let motion = square(error.y_m, self.position) + square(error.v_m_per_s, self.velocity);
        let mut sum = pressures + (motion + square(error.z_m, self.bristle));
        if EXTENDED {
            sum += square(error.spool_v, self.spool) + square(error.p_sup_pa, self.pressure);
            sum += square(error.p_a_sensed_pa, self.pressure) + square(error.p_b_sensed_pa, self.pressure);
        }
        sum
    }
}

/// The linear systems of one step, `(2/h - J) k = r`, eliminated towards the velocity: `k_v` is a weighted sum of the
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
    spool: R,
    supply: R,
    supply_spool: R,
    filled_a: R,
    filled_b: R,
    a_spool: R,
    b_spool: R,
    a_supply: R,
    b_supply: R,
    sensed: R,
    sensed_gain: R,
}

impl<R: Real> Extra<R> {
    fn new(plant: &Plant<R>, j: &Jacobian<R>, diagonal: R) -> Self {
        let rate = |time_constant: R| if time_constant > R::ZERO { R::ONE / time_constant } else { R::ZERO };
        let supply = R::ONE / (diagonal - j.supply_supply);
        let sensed_gain = rate(plant.model.pressure_time_constant_s);
        // Only the chamber that is being filled depends on the supply, and the supply on it.
        let fills_a = j.a_supply != R::ZERO;
        let coupling = j.supply_filled * supply;
        Self {
            spool: R::ONE / (diagonal + rate(plant.model.spool_time_constant_s)),
            supply,
            supply_spool: j.supply_spool,
            filled_a: if fills_a { coupling } else { R::ZERO },
            filled_b: if fills_a { R::ZERO } else { coupling },
            a_spool: j.a_spool,
            b_spool: j.b_spool,
            a_supply: j.a_supply,
            b_supply: j.b_supply,
            sensed: R::ONE / (diagonal + sensed_gain),
            sensed_gain,
        }
    }
}

impl<R: Real> Stages<R> {
    #[inline(always)]
    fn new<const EXTENDED: bool>(plant: &Plant<R>, j: &Jacobian<R>, h: R, held: bool) -> Self {
        let zero = R::ZERO;
        let diagonal = (R::ONE + R::ONE) / h;
        let inverse_y = h * R::HALF;
        let mut extra = Extra::default();
        let (diagonal_a, diagonal_b) = (diagonal - j.a_a, diagonal - j.b_b);
        let (a_a, a_b, b_b, b_a);
        if EXTENDED {
            extra = Extra::new(plant, j, diagonal);
            let (diagonal_a, diagonal_b) =
                (diagonal_a - j.a_supply * extra.filled_a, diagonal_b - j.b_supply * extra.filled_b);
            let inverse_determinant = R::ONE / (diagonal_a * diagonal_b - j.a_b * j.b_a);
            a_a = diagonal_b * inverse_determinant;
            b_b = diagonal_a * inverse_determinant;
            a_b = j.a_b * inverse_determinant;
            b_a = j.b_a * inverse_determinant;
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
            pivot = pivot - j.v_y * inverse_y - j.v_level_p * (a_v + b_v);
        }
        let v_v = if held { zero } else { R::ONE / pivot };
        let v_p = j.v_p * v_v;
        let v_z_of = j.v_z * v_v;
        let (v_y, v_a, v_b);
        if EXTENDED {
            // What a pressure does to the velocity: directly, through the sliding force, through the bristle.
            let v_level = j.v_level_p * v_v + v_z_of * z_p;
            let (from_a, from_b) = (v_level + v_p, v_level - v_p);
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
        if EXTENDED {
            k.spool_v = r.spool_v * x.spool;
            // The supply without what the filled chamber's own change adds to it.
            k.p_sup_pa = (r.p_sup_pa + x.supply_spool * k.spool_v) * x.supply;
            r_a += x.a_spool * k.spool_v + x.a_supply * k.p_sup_pa;
            r_b += x.b_spool * k.spool_v + x.b_supply * k.p_sup_pa;
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
        }
        k
    }
}

impl<R: Real> State<R> {
    /// `self + factor other`, field by field.
    #[inline(always)]
    fn plus<const EXTENDED: bool>(&self, factor: R, other: &Self) -> Self {
        let mut sum = *self;
        sum.y_m += factor * other.y_m;
        sum.v_m_per_s += factor * other.v_m_per_s;
        sum.p_a_pa += factor * other.p_a_pa;
        sum.p_b_pa += factor * other.p_b_pa;
        sum.z_m += factor * other.z_m;
        if EXTENDED {
            sum.spool_v += factor * other.spool_v;
            sum.p_sup_pa += factor * other.p_sup_pa;
            sum.p_a_sensed_pa += factor * other.p_a_sensed_pa;
            sum.p_b_sensed_pa += factor * other.p_b_sensed_pa;
        }
        sum
    }
}

/// One step of Rodas3: the new state and the difference to the embedded second-order solution.
#[inline]
fn rodas3<R: Real, const EXTENDED: bool>(
    plant: &Plant<R>,
    state: &State<R>,
    drive: &Drive<R>,
    held: bool,
    h: R,
) -> (State<R>, State<R>) {
    let (f, jacobian) = plant.linearise::<EXTENDED>(state, drive, held);
    let stages = Stages::new::<EXTENDED>(plant, &jacobian, h, held);
    let one = R::ONE / h;
    let two = R::ONE + R::ONE;
    let k1 = stages.solve::<EXTENDED>(&f);
    let k2 = stages.solve::<EXTENDED>(&f.plus::<EXTENDED>((two + two) * one, &k1));
    let base = state.plus::<EXTENDED>(two, &k1);
    let f3 = plant.rates::<EXTENDED>(&base, drive, held);
    let k3 = stages.solve::<EXTENDED>(&f3.plus::<EXTENDED>(one, &k1).plus::<EXTENDED>(-one, &k2));
    let inner = base.plus::<EXTENDED>(R::ONE, &k3);
    let f4 = plant.rates::<EXTENDED>(&inner, drive, held);
    let r4 = f4.plus::<EXTENDED>(one, &k1).plus::<EXTENDED>(-one, &k2).plus::<EXTENDED>(R::of(-8.0 / 3.0) * one, &k3);
    let k4 = stages.solve::<EXTENDED>(&r4);
    (inner.plus::<EXTENDED>(R::ONE, &k4), k4)
}
