//! Integration over intervals of constant input.
//!
//! The methods (`rosenbrock.rs`) are L-stable: they take steps that the bristles' stiffness (2.2e4 1/s at 1 m/s) does not limit,
//! where explicit Euler diverges above 90 us and Runge-Kutta 4 above 130 us. At a 1 kHz tick one step suffices but for
//! breakaway, reversal and impact, which the error control finds.

use crate::plant::{Inputs, Plant, State};
use crate::real::Real;
use crate::right_hand_side::Drive;
use crate::rosenbrock::{rodas3, ros3};
use crate::valve_flow::Opening;

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
            bristle_m: R::of(1.25e-9),
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
    opening: Opening<R>,
    steps: u64,
    forced_steps: u64,
}

/// Never more than this many steps in one call of [`Stepper::advance`]: see [`Stepper::forced_steps`].
const MAX_STEPS: u32 = 100_000;
/// Smallest step, s: a floor against an error estimate that cannot be met in the scalar's precision.
const MIN_STEP_S: f64 = 1.0e-8;
/// A chamber's pressure, as far as a relative change of it stands for one of the temperature, Pa: half a usual supply's. The
/// tolerance of a warmth is that of the pressure over it.
const WARMTH_PRESSURE_PA: f64 = 3.0e5;
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
        Self::with(Division::Adaptive { weights, next_s: R::of(1.0e-4) })
    }

    /// A fixed number of equal steps per call (at least one): constant cost per call.
    #[must_use]
    pub fn equal_steps(count: u16) -> Self {
        Self::with(Division::Equal(count.max(1)))
    }

    fn with(division: Division<R>) -> Self {
        Self { division, opening: Opening::at(R::ZERO), steps: 0, forced_steps: 0 }
    }

    /// How many steps have been taken, rejected ones included.
    #[must_use]
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// How often the tolerance could not be met: a smallest step was accepted all the same, or an interval was cut
    /// short because its result would not have been physical or took too many steps (the state then stays as it was).
    /// Zero unless parameters are absurd.
    #[must_use]
    pub fn forced_steps(&self) -> u64 {
        self.forced_steps
    }

    /// Advances the state by `dt` seconds under constant inputs. `dt` must be positive; otherwise nothing happens.
    pub fn advance(&mut self, plant: &Plant<R>, state: &mut State<R>, inputs: &Inputs<R>, dt_s: R) {
        self.advance_inline(plant, state, inputs, inputs.u_v, dt_s);
    }

    /// [`Stepper::advance`] for the one place where nearly all ticks of a simulation pass, with the command as chamber B feels it, V.
    #[inline(always)]
    pub(crate) fn advance_inline(
        &mut self,
        plant: &Plant<R>,
        state: &mut State<R>,
        inputs: &Inputs<R>,
        u_b_v: R,
        dt_s: R,
    ) {
        let runs = dt_s > R::ZERO;
        if !runs {
            return;
        }
        let drive = plant.drive_from(inputs, u_b_v, &mut self.opening);
        if plant.is_extended() {
            self.advance_extended(plant, state, &drive, dt_s);
            return;
        }
        match self.division {
            Division::Adaptive { weights, next_s } if next_s >= dt_s => {
                self.whole(plant, state, &drive, dt_s, &weights);
            }
            _ => self.subdivide::<false>(plant, state, &drive, dt_s),
        }
        plant.follow(state, &drive);
    }

    /// A function of its own, so that the registers of the shorter path do not suffer from the longer one.
    #[inline(never)]
    fn advance_extended(&mut self, plant: &Plant<R>, state: &mut State<R>, drive: &Drive<R>, dt: R) {
        plant.settle(state, drive);
        self.subdivide::<true>(plant, state, drive, dt);
        plant.settle(state, drive);
    }

    /// The usual tick of the paper's model: all of it in one step, without a loop. Turns to [`Stepper::subdivide`] when that fails.
    #[inline(always)]
    fn whole(&mut self, plant: &Plant<R>, state: &mut State<R>, drive: &Drive<R>, dt: R, weights: &Weights<R>) {
        let held = plant.held_at_stop::<false>(state, drive);
        let (next, error) = ros3(plant, state, drive, held, dt);
        let norm = weights.norm_squared::<false>(&error);
        self.steps += 1;
        if norm <= R::ONE && next.y_m.abs() <= plant.half_stroke_m() {
            *state = next;
            return;
        }
        if let Division::Adaptive { next_s, .. } = &mut self.division
            && norm > R::ONE
        {
            *next_s = (dt * step_factor(norm)).at_least(R::of(MIN_STEP_S));
        }
        self.subdivide::<false>(plant, state, drive, dt);
    }

    /// One L-stable step of a plant without effects, and nothing else: what bench mode on the microcontroller needs,
    /// without the code of error control and of the additional states.
    pub fn single_step(plant: &Plant<R>, state: &mut State<R>, inputs: &Inputs<R>, dt_s: R) {
        let drive = plant.drive(inputs);
        if plant.is_extended() {
            plant.settle(state, &drive);
            let held = plant.held_at_stop::<true>(state, &drive);
            *state = rodas3::<R, true>(plant, state, &drive, held, dt_s).0;
        } else {
            let held = plant.held_at_stop::<false>(state, &drive);
            *state = rodas3::<R, false>(plant, state, &drive, held, dt_s).0;
        }
        stop_at_ends(plant, state);
        plant.settle(state, &drive);
    }

    /// The interval in as many steps as it takes.
    #[inline(never)]
    fn subdivide<const EXTENDED: bool>(&mut self, plant: &Plant<R>, state: &mut State<R>, drive: &Drive<R>, dt: R) {
        match &mut self.division {
            Division::Equal(count) => {
                let h = dt / R::of(f64::from(*count));
                for _ in 0..*count {
                    let held = plant.held_at_stop::<EXTENDED>(state, drive);
                    let (mut next, _) = rodas3::<R, EXTENDED>(plant, state, drive, held, h);
                    stop_at_ends(plant, &mut next);
                    if next.is_physical() {
                        *state = next;
                    } else {
                        self.forced_steps += 1;
                    }
                }
                self.steps += u64::from(*count);
            }
            Division::Adaptive { weights, next_s } => {
                let mut left = dt;
                let mut h = *next_s;
                let mut taken = 0;
                loop {
                    // Two almost equal steps instead of a full one and a sliver.
                    let last = h >= left;
                    let step = if last {
                        left
                    } else if h + h > left {
                        left * R::HALF
                    } else {
                        h
                    };
                    taken += 1;
                    let held = plant.held_at_stop::<EXTENDED>(state, drive);
                    let (mut next, error) = if EXTENDED {
                        rodas3::<R, EXTENDED>(plant, state, drive, held, step)
                    } else {
                        ros3(plant, state, drive, held, step)
                    };
                    let norm = weights.norm_squared::<EXTENDED>(&error);
                    // A NaN is not accepted either.
                    let accepted = norm <= R::ONE;
                    if !accepted {
                        if taken < MAX_STEPS && step > R::of(MIN_STEP_S) {
                            h = (step * step_factor(norm)).at_least(R::of(MIN_STEP_S));
                            continue;
                        }
                        self.forced_steps += 1;
                        if taken >= MAX_STEPS || !next.is_physical() {
                            break;
                        }
                    } else if let Some(sooner) = impact(plant, state, &next, step) {
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

impl<R: Real> State<R> {
    /// All components finite, absolute pressures positive.
    fn is_physical(&self) -> bool {
        let spool = self.spool_v + self.spool_v_per_s + self.spool_b_v + self.spool_b_v_per_s;
        let motion = self.y_m + self.y_sensed_m + self.v_m_per_s + self.z_m + spool;
        let pressures = self.p_a_pa + self.p_b_pa + self.p_sup_pa + self.p_a_sensed_pa + self.p_b_sensed_pa;
        let temperatures = self.warmth_a > -R::ONE && self.warmth_b > -R::ONE;
        let finite = (motion + pressures + self.warmth_a + self.warmth_b).is_finite();
        finite && temperatures && self.p_a_pa > R::ZERO && self.p_b_pa > R::ZERO
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
            sum += square(error.spool_b_v, self.spool);
            sum += square(error.p_a_sensed_pa, self.pressure) + square(error.p_b_sensed_pa, self.pressure);
            sum += square(error.y_sensed_m, self.position);
            // Warmth and pressure err alike where a relative change of one is as large as one of the other.
            let warmth = self.pressure * R::of(WARMTH_PRESSURE_PA);
            sum += square(error.warmth_a, warmth) + square(error.warmth_b, warmth);
        }
        sum
    }
}
