//! Plant, command path, integrator and sensors as one object: what closed loops, sweeps and tests drive.

use crate::command_path::CommandPath;
use crate::effects::Effects;
use crate::measurement::Measurement;
use crate::plant::{Inputs, Plant, State};
use crate::real::Real;
use crate::rig::{ParameterError, Rig};
use crate::sensors::Sensors;
use crate::stepper::{Stepper, Tolerance};

/// A simulated rig. `N` is the number of intervals that delays can reach back (line delay, position delay); it costs
/// `4 N` scalars of memory.
///
/// ```
/// use plant_model::{Effects, Rig, Simulator};
/// let rig = Rig::<f64>::paper_a();
/// let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).expect("the paper's rig is valid");
/// for _ in 0..1000 {
///     simulator.advance(2.0, 1.0e-3);
/// }
/// assert!(simulator.measure().y_m > 0.1);
/// ```
#[derive(Clone, Debug)]
pub struct Simulator<R, const N: usize = 256> {
    plant: Plant<R>,
    state: State<R>,
    stepper: Stepper<R>,
    command_path: CommandPath<R, N>,
    sensors: Sensors<R, N>,
}

impl<R: Real, const N: usize> Simulator<R, N> {
    /// A rig at rest at mid-stroke with both chambers at the equilibrium pressure, under standard error control.
    ///
    /// # Errors
    /// The first invalid parameter of rig or effects.
    pub fn new(rig: &Rig<R>, effects: &Effects<R>) -> Result<Self, ParameterError> {
        let plant = Plant::new(rig, effects)?;
        let [p_a, p_b] = rig.equilibrium_pressures_pa();
        let state = plant.state_at_rest(R::ZERO, p_a, p_b);
        Ok(Self::from_state(plant, state, Stepper::adaptive(&Tolerance::standard())))
    }

    /// A simulator in a given state, with an empty command path (valve at mid) and a piston that has been at rest.
    #[must_use]
    pub fn from_state(plant: Plant<R>, state: State<R>, stepper: Stepper<R>) -> Self {
        Self {
            command_path: CommandPath::new(plant.line_delays_s(), plant.added.valve_hysteresis),
            sensors: Sensors::new(plant.added.position_delay.delay_s),
            plant,
            state,
            stepper,
        }
    }

    /// A command in V that was held for `dt` seconds before the simulation begins: it passes through the command path
    /// (delay, play) and moves nothing else.
    pub fn recall(&mut self, u_v: R, dt_s: R) {
        if self.command_path.pass(u_v).is_none() {
            self.command_path.send(u_v, dt_s, |_, _| {});
        }
    }

    /// Holds a valve command in V for `dt` seconds, at nominal supply and without external force.
    #[inline]
    pub fn advance(&mut self, u_v: R, dt_s: R) {
        let inputs = self.plant.inputs(u_v);
        self.advance_with(&inputs, dt_s);
    }

    /// Holds inputs for `dt` seconds.
    #[inline]
    pub fn advance_with(&mut self, inputs: &Inputs<R>, dt_s: R) {
        self.sensors.record(self.state.y_sensed_m, dt_s);
        let (plant, state, stepper) = (&self.plant, &mut self.state, &mut self.stepper);
        if let Some(u_v) = self.command_path.pass(inputs.u_v) {
            stepper.advance_inline(plant, state, &Inputs { u_v, ..*inputs }, u_v, dt_s);
            return;
        }
        self.advance_late(inputs, dt_s);
    }

    /// Behind delays: a function of its own, so that the registers of the shorter path do not suffer from it.
    #[inline(never)]
    fn advance_late(&mut self, inputs: &Inputs<R>, dt_s: R) {
        let (plant, state, stepper) = (&self.plant, &mut self.state, &mut self.stepper);
        self.command_path.send(inputs.u_v, dt_s, |[u_v, u_b_v], duration| {
            stepper.advance_inline(plant, state, &Inputs { u_v, ..*inputs }, u_b_v, duration);
        });
    }

    /// What the sensors show now, before noise and quantisation.
    #[inline]
    #[must_use]
    pub fn measure(&self) -> Measurement<R> {
        self.sensors.measure(&self.plant.added, &self.state)
    }

    /// The true state.
    #[must_use]
    pub fn state(&self) -> &State<R> {
        &self.state
    }

    /// Puts the plant into another state; delays keep what is under way.
    pub fn set_state(&mut self, state: State<R>) {
        self.state = state;
    }

    /// The model.
    #[must_use]
    pub fn plant(&self) -> &Plant<R> {
        &self.plant
    }

    /// The integrator, for its statistics.
    #[must_use]
    pub fn stepper(&self) -> &Stepper<R> {
        &self.stepper
    }
}
