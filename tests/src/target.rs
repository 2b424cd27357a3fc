//! Who executes the control step.

use control::{ControllerState, DacCode, Inputs, Learned, Mode, Parameters, Reason};
use firmware_core::{BenchPlant, ControlLoop, LoopTick, MonitorSetup, Order, Setup};
use monitor::MonitorParameters;
use plant_model::Plant;
use rig_files::RigFile;

/// What a target answers to one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickOutput {
    /// The code for the valve.
    pub dac: DacCode,
    /// The mode after the tick.
    pub mode: Mode,
    /// Whether it is a controlled stop: safe, and the valve still moves.
    pub stopping: bool,
}

/// A target that cannot go on: the connection broke, or it answered nonsense.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TargetError(pub String);

impl std::fmt::Display for TargetError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for TargetError {}

/// Something that runs the control step in lock-step with the plant.
///
/// `inputs.faults.model_disagreement` is always false: the monitor is part of the target.
pub trait Target {
    /// One tick: codes in, code and mode out.
    ///
    /// # Errors
    /// The target cannot be reached or makes no sense.
    fn tick(&mut self, inputs: &Inputs) -> Result<TickOutput, TargetError>;

    /// A tick does not happen: its trigger is lost. Targets that only count ticks need not know.
    ///
    /// # Errors
    /// As [`Target::tick`].
    fn lose_tick(&mut self) -> Result<(), TargetError> {
        Ok(())
    }

    /// Whether a watchdog guards it.
    fn has_watchdog(&self) -> bool {
        true
    }

    /// The watchdog has bitten: the target boots anew, knowing why.
    ///
    /// # Errors
    /// As [`Target::tick`].
    fn watchdog_reset(&mut self) -> Result<(), TargetError>;
}

/// The firmware's own loop on this computer.
pub struct HostTarget {
    control_loop: ControlLoop,
    closest: f32,
}

impl HostTarget {
    /// A target for a rig.
    ///
    /// # Errors
    /// Parameters of controller, monitor or rig that are out of range.
    pub fn new(
        rig: &RigFile,
        parameters: &Parameters,
        monitor: Option<&MonitorParameters>,
        output_delay_ticks: u8,
        state: ControllerState,
    ) -> Result<Self, TargetError> {
        let fail = |error: &dyn std::fmt::Display| TargetError(error.to_string());
        let monitor = match monitor {
            None => None,
            Some(parameters) => Some(MonitorSetup {
                // As the board's: the nominal values, and of the effects the valve's lag alone.
                plant: Plant::without_effects(&rig.rig.convert()).map_err(|error| fail(&error))?,
                parameters: *parameters,
                trips: true,
                output_delay_ticks,
            }),
        };
        let setup = Setup::new(parameters, monitor, 1).map_err(|error| fail(&error))?;
        Ok(Self { control_loop: ControlLoop::in_state(setup, state), closest: 0.0 })
    }

    /// In bench mode: the loop's own plant in place of the codes of the ticks. As on the board, a loop that runs already refuses.
    #[must_use]
    pub fn on_the_bench(mut self, plant: BenchPlant) -> Self {
        self.control_loop.order(&Order::BenchOn(plant));
        self
    }

    /// The largest residual of the monitor so far, as a share of its threshold: how close it came to a trip.
    #[must_use]
    pub fn closest_to_disagreement(&self) -> f32 {
        self.closest
    }

    /// What the positioning law has learned so far; `None` under the paper's law.
    #[must_use]
    pub fn learned(&self) -> Option<Learned> {
        self.control_loop.learned()
    }

    /// A tick with everything that it leaves for telemetry.
    pub fn loop_tick(&mut self, inputs: &Inputs) -> LoopTick {
        if let Some(command) = inputs.command {
            self.control_loop.order(&Order::Command(command));
        }
        self.control_loop.hold(inputs.reference);
        let codes = [inputs.position, inputs.pressure_a, inputs.pressure_b, inputs.supply.unwrap_or_default()];
        let tick = self.control_loop.tick(codes.map(|code| code.0), inputs.faults, inputs.host_heard);
        self.control_loop.conclude_and(|verdict| self.closest = self.closest.max(verdict.closeness()));
        tick
    }
}

impl Target for HostTarget {
    fn tick(&mut self, inputs: &Inputs) -> Result<TickOutput, TargetError> {
        // What the law wants: in bench mode the valve itself stands at the safe code.
        let dac = DacCode(self.loop_tick(inputs).record.dac);
        Ok(TickOutput { dac, mode: self.control_loop.mode(), stopping: self.control_loop.state().stopping() })
    }

    fn watchdog_reset(&mut self) -> Result<(), TargetError> {
        self.control_loop.reboot(Reason::WatchdogReset);
        Ok(())
    }
}
