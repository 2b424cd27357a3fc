//! Integration of the reference equations under an input that is held over each sampling interval.

use crate::equations::{NUMBER_OF_STATES, Reference, state};
use crate::integrators::{Accuracy, DormandPrince, ExtrapolatedEuler, OneStep, StepTooSmall};

/// The solver used. Two that have nothing in common guard against the reference itself being wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Explicit Runge-Kutta of order 5 (Dormand and Prince).
    DormandPrince,
    /// Linearly implicit Euler, extrapolated to order 4 (Deuflhard).
    ExtrapolatedEuler,
}

/// The size of each component that counts as ordinary, for the error control.
const SCALE: [f64; NUMBER_OF_STATES] = [1e-2, 1e-1, 1e4, 1e4, 1e-5, 1.0, 1e5, 1e4, 1e4, 1e-2];

impl Reference {
    /// The state after every interval of `dt` seconds in which the command is held at one of `commands`, in V; to a
    /// relative tolerance.
    ///
    /// # Errors
    /// The equations cannot be integrated to this tolerance.
    pub fn simulate(
        &self,
        method: Method,
        tolerance: f64,
        start: [f64; NUMBER_OF_STATES],
        commands: &[f64],
        dt: f64,
    ) -> Result<Vec<[f64; NUMBER_OF_STATES]>, StepTooSmall> {
        match method {
            Method::DormandPrince => self.drive::<DormandPrince>(tolerance, start, commands, dt),
            Method::ExtrapolatedEuler => self.drive::<ExtrapolatedEuler>(tolerance, start, commands, dt),
        }
    }

    fn drive<M: OneStep<NUMBER_OF_STATES>>(
        &self,
        tolerance: f64,
        start: [f64; NUMBER_OF_STATES],
        commands: &[f64],
        dt: f64,
    ) -> Result<Vec<[f64; NUMBER_OF_STATES]>, StepTooSmall> {
        let accuracy = Accuracy { relative: tolerance, scale: SCALE };
        let (mut x, mut h) = (start, 1e-6);
        commands
            .iter()
            .map(|u| {
                let rates = |x: &[f64; NUMBER_OF_STATES]| {
                    let mut rates = [0.0; NUMBER_OF_STATES];
                    self.right_hand_side(*u, x, &mut rates);
                    rates
                };
                x = M::advance(&rates, x, dt, &mut h, &accuracy)?;
                Ok(x)
            })
            .collect()
    }
}

const _: () = assert!(state::M_Y + 1 == NUMBER_OF_STATES);
