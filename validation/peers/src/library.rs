//! Integration of the reference equations by diffsol, under an input that is held over each sampling interval.

use diffsol::{NalgebraLU, NalgebraMat, OdeBuilder, OdeEquations, OdeSolverMethod, OdeSolverStopReason, Vector};
use std::cell::Cell;
use validation::{NUMBER_OF_STATES, Reference};

type SolverError = diffsol::DiffsolError;

type Matrix = NalgebraMat<f64>;

/// The solver used.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Method {
    /// Explicit Runge-Kutta of order 5 (Tsitouras). One-step: does not suffer from the input's jumps.
    Tsit45,
    /// Implicit, L-stable Runge-Kutta of order 4.
    Esdirk34,
    /// Backward differentiation formulas of variable order.
    Bdf,
}

/// Absolute tolerances at a relative tolerance of one, by component: the scale of each quantity.
const SCALE: [f64; NUMBER_OF_STATES] = [1e-2, 1e-1, 1e4, 1e4, 1e-5, 1.0, 1e5, 1e4, 1e4, 1e-2];

/// The state after every interval of `dt` seconds in which the command is held at one of `commands`, in V; to a
/// relative tolerance.
///
/// # Errors
/// Whatever makes the solver give up.
pub(crate) fn simulate(
    reference: &Reference,
    method: Method,
    tolerance: f64,
    start: [f64; NUMBER_OF_STATES],
    commands: &[f64],
    dt: f64,
) -> Result<Vec<[f64; NUMBER_OF_STATES]>, SolverError> {
    let command = Cell::new(commands.first().copied().unwrap_or(0.0));
    let problem = OdeBuilder::<Matrix>::new()
        .rtol(tolerance)
        .atol(SCALE.map(|s| s * tolerance))
        .h0(1e-6)
        .rhs_implicit(
            |x, _p, _t, rates| reference.right_hand_side(command.get(), x, rates),
            |x, _p, _t, direction, product| jacobian_product(reference, command.get(), x, direction, product),
        )
        .init(|_p, _t, x| x.copy_from_slice(&start), NUMBER_OF_STATES)
        .build()?;
    match method {
        Method::Tsit45 => drive(reference, problem.tsit45()?, &command, commands, dt),
        Method::Esdirk34 => drive(reference, problem.esdirk34::<NalgebraLU<f64>>()?, &command, commands, dt),
        Method::Bdf => drive(reference, problem.bdf::<NalgebraLU<f64>>()?, &command, commands, dt),
    }
}

fn drive<'a, E, S>(
    reference: &Reference,
    mut solver: S,
    command: &Cell<f64>,
    commands: &[f64],
    dt: f64,
) -> Result<Vec<[f64; NUMBER_OF_STATES]>, SolverError>
where
    E: OdeEquations<T = f64> + 'a,
    E::V: Vector<T = f64> + std::ops::Index<usize, Output = f64> + std::ops::IndexMut<usize, Output = f64>,
    S: OdeSolverMethod<'a, E>,
{
    let mut trace = Vec::with_capacity(commands.len());
    for (k, u) in commands.iter().enumerate() {
        let jumps = *u != command.replace(*u);
        if jumps {
            // The input jumps: the rates must follow before the solver extrapolates them.
            let mut rates = [0.0; NUMBER_OF_STATES];
            let x = to_array(solver.state().y);
            reference.right_hand_side(*u, &x, &mut rates);
            let into = solver.state_mut();
            for (i, rate) in rates.into_iter().enumerate() {
                into.dy[i] = rate;
            }
        }
        solver.set_stop_time((k + 1) as f64 * dt)?;
        while solver.step()? != OdeSolverStopReason::TstopReached {}
        trace.push(to_array(solver.state().y));
    }
    Ok(trace)
}

/// Jacobian times a vector by central differences, for the implicit methods' Newton iteration.
fn jacobian_product(reference: &Reference, u: f64, x: &[f64], direction: &[f64], product: &mut [f64]) {
    let size = direction.iter().zip(SCALE).map(|(d, s)| (d / s).abs()).fold(0.0, f64::max);
    if size == 0.0 {
        product.fill(0.0);
        return;
    }
    let step = 1e-6 / size;
    let shifted = |factor: f64| {
        let mut at = [0.0; NUMBER_OF_STATES];
        for ((to, from), d) in at.iter_mut().zip(x).zip(direction) {
            *to = from + factor * d;
        }
        let mut rates = [0.0; NUMBER_OF_STATES];
        reference.right_hand_side(u, &at, &mut rates);
        rates
    };
    let (ahead, behind) = (shifted(step), shifted(-step));
    for (i, to) in product.iter_mut().enumerate() {
        *to = (ahead[i] - behind[i]) / (2.0 * step);
    }
}

fn to_array<V: std::ops::Index<usize, Output = f64>>(vector: &V) -> [f64; NUMBER_OF_STATES] {
    std::array::from_fn(|i| vector[i])
}
