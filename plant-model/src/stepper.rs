//! Integration over intervals of constant input.
//!
//! The method is Rodas3 (Sandu et al. 1997): a Rosenbrock method of order 3 with an embedded order 2, L-stable and
//! stiffly accurate, three evaluations of the right-hand side a step. It needs the Jacobian, which for this plant is
//! an arrow pointing at the velocity, so that the linear systems are solved by a dozen divisions-free lines instead of
//! a matrix factorisation. Being L-stable it takes steps that the bristles' stiffness (2.2e4 1/s at 1 m/s) does not
//! limit; explicit Euler diverges above 90 us and Runge-Kutta 4 above 130 us.

use crate::plant::{Drive, Inputs, Jacobian, Plant, State};
use crate::real::Real;

/// Accepted error of one step, absolute, in the units of the state.
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
            position_m: R::of(1.0e-7),
            velocity_m_per_s: R::of(2.0e-6),
            pressure_pa: R::of(1.0),
            bristle_m: R::of(1.0e-8),
            spool_v: R::of(1.0e-4),
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
                    let norm = weights.norm::<EXTENDED>(&error);
                    let factor = step_factor(norm);
                    let floor = step <= R::of(MIN_STEP_S) || taken >= MAX_STEPS;
                    let accepted = norm.is_finite() && norm <= R::ONE;
                    if !accepted && !floor {
                        h = (step * factor).at_least(R::of(MIN_STEP_S));
                        continue;
                    }
                    if let Some(sooner) = impact(plant, state, &next, step).filter(|_| !floor) {
                        h = sooner;
                        continue;
                    }
                    stop_at_ends(plant, &mut next);
                    *state = next;
                    if !last || step >= h {
                        h = step * factor;
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

/// Growth of the step size for a normalised error: `0.9 norm^(-1/3)` within 0.2 … 5, without a cube root.
#[inline]
fn step_factor<R: Real>(norm: R) -> R {
    if !norm.is_finite() {
        return R::of(0.2);
    }
    // Newton's iteration for x = norm^(1/3) from a start on the right side converges in a few steps.
    let target = norm.limit(R::of(0.006), R::of(90.0));
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
    #[inline]
    fn norm<const EXTENDED: bool>(&self, error: &State<R>) -> R {
        let mut norm = (error.y_m * self.position).abs();
        norm = norm.at_least((error.v_m_per_s * self.velocity).abs());
        norm = norm.at_least((error.p_a_pa * self.pressure).abs());
        norm = norm.at_least((error.p_b_pa * self.pressure).abs());
        norm = norm.at_least((error.z_m * self.bristle).abs());
        if EXTENDED {
            norm = norm.at_least((error.spool_v * self.spool).abs());
            norm = norm.at_least((error.p_sup_pa * self.pressure).abs());
            norm = norm.at_least((error.p_a_sensed_pa * self.pressure).abs());
            norm = norm.at_least((error.p_b_sensed_pa * self.pressure).abs());
        }
        // Comparisons can drop a NaN; the sum of all errors cannot.
        let sum = error.y_m + error.v_m_per_s + error.p_a_pa + error.p_b_pa + error.z_m;
        if sum.is_finite() { norm } else { sum }
    }
}

/// The linear systems of one step: `(1/(h gamma) - J) k = r`, solved by elimination towards the velocity.
struct Stages<'a, R> {
    jacobian: &'a Jacobian<R>,
    held: bool,
    inverse_y: R,
    inverse_a: R,
    inverse_b: R,
    inverse_z: R,
    inverse_v: R,
    a_via_v: R,
    b_via_v: R,
    z_via_v: R,
    spool: R,
    supply: R,
    sensed: R,
    sensed_gain: R,
}

impl<'a, R: Real> Stages<'a, R> {
    #[inline]
    fn new<const EXTENDED: bool>(plant: &Plant<R>, j: &'a Jacobian<R>, h: R, held: bool) -> Self {
        let diagonal = (R::ONE + R::ONE) / h;
        let inverse_y = h * R::HALF;
        let inverse_a = R::ONE / (diagonal - j.a_a);
        let inverse_b = R::ONE / (diagonal - j.b_b);
        let inverse_z = R::ONE / (diagonal - j.z_z);
        let a_via_v = (j.a_v + j.a_y * inverse_y) * inverse_a;
        let b_via_v = (j.b_v + j.b_y * inverse_y) * inverse_b;
        let z_via_v = (j.z_v + j.z_y * inverse_y + j.z_p * (a_via_v + b_via_v)) * inverse_z;
        let pivot = diagonal
            - j.v_v
            - j.v_y * inverse_y
            - j.v_p * (a_via_v - b_via_v)
            - j.v_level_p * (a_via_v + b_via_v)
            - j.v_z * z_via_v;
        let (mut spool, mut supply, mut sensed, mut sensed_gain) = (R::ZERO, R::ZERO, R::ZERO, R::ZERO);
        if EXTENDED {
            let m = &plant.model;
            let rate = |time_constant: R| {
                if time_constant > R::ZERO { R::ONE / time_constant } else { R::ZERO }
            };
            spool = R::ONE / (diagonal + rate(m.spool_time_constant_s));
            supply = R::ONE / (diagonal - j.supply_supply);
            sensed_gain = rate(m.pressure_time_constant_s);
            sensed = R::ONE / (diagonal + sensed_gain);
        }
        Self {
            jacobian: j,
            held,
            inverse_y,
            inverse_a,
            inverse_b,
            inverse_z,
            inverse_v: R::ONE / pivot,
            a_via_v,
            b_via_v,
            z_via_v,
            spool,
            supply,
            sensed,
            sensed_gain,
        }
    }

    #[inline]
    fn solve<const EXTENDED: bool>(&self, r: &State<R>) -> State<R> {
        let j = self.jacobian;
        let mut k = State::default();
        let (mut r_a, mut r_b) = (r.p_a_pa, r.p_b_pa);
        if EXTENDED {
            k.spool_v = r.spool_v * self.spool;
            k.p_sup_pa = (r.p_sup_pa + j.supply_spool * k.spool_v) * self.supply;
            r_a += j.a_spool * k.spool_v + j.a_supply * k.p_sup_pa;
            r_b += j.b_spool * k.spool_v + j.b_supply * k.p_sup_pa;
        }
        let y = r.y_m * self.inverse_y;
        let a = (r_a + j.a_y * y) * self.inverse_a;
        let b = (r_b + j.b_y * y) * self.inverse_b;
        let z = (r.z_m + j.z_y * y + j.z_p * (a + b)) * self.inverse_z;
        k.v_m_per_s = if self.held {
            R::ZERO
        } else {
            (r.v_m_per_s + j.v_y * y + j.v_p * (a - b) + j.v_level_p * (a + b) + j.v_z * z) * self.inverse_v
        };
        let v = k.v_m_per_s;
        k.y_m = y + v * self.inverse_y;
        k.p_a_pa = a + self.a_via_v * v;
        k.p_b_pa = b + self.b_via_v * v;
        k.z_m = z + self.z_via_v * v;
        if EXTENDED {
            k.p_a_sensed_pa = (r.p_a_sensed_pa + self.sensed_gain * k.p_a_pa) * self.sensed;
            k.p_b_sensed_pa = (r.p_b_sensed_pa + self.sensed_gain * k.p_b_pa) * self.sensed;
        }
        k
    }
}

impl<R: Real> State<R> {
    /// `self + factor other`, field by field.
    #[inline]
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
