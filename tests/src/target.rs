//! Who executes the control step.

use crate::rig;
use control::{Config, DacCode, ExternalFaults, Inputs, Mode, Parameters, Reason, State};
use monitor::{Monitor, MonitorParameters, Readings};
use rig_files::RigFile;

/// What a target answers to one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TickOutput {
    /// The code for the valve.
    pub dac: DacCode,
    /// The mode after the tick.
    pub mode: Mode,
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

/// The control crate and the monitor on this computer, put together as the firmware does: the monitor runs behind the DAC
/// write, its verdict counts in the next tick.
pub struct HostTarget {
    config: Config,
    state: State,
    monitor: Option<Monitor>,
    disagreement: bool,
    previous_u_v: f32,
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
        state: State,
    ) -> Result<Self, TargetError> {
        let fail = |error: &dyn std::fmt::Display| TargetError(error.to_string());
        let config = Config::from_parameters(parameters).map_err(|error| fail(&error))?;
        let monitor = match monitor {
            None => None,
            Some(parameters) => Some(
                Monitor::new(
                    &rig::convert(&rig.rig),
                    &rig.effects.convert(),
                    parameters,
                    rig.io.tick_s() as f32,
                    output_delay_ticks,
                )
                .map_err(|error| fail(&error))?,
            ),
        };
        Ok(Self { config, state, monitor, disagreement: false, previous_u_v: 0.0, closest: 0.0 })
    }
}

impl HostTarget {
    /// The largest residual of the monitor so far, as a share of its threshold: how close it came to a trip.
    #[must_use]
    pub fn closest_to_disagreement(&self) -> f32 {
        self.closest
    }
}

impl Target for HostTarget {
    fn tick(&mut self, inputs: &Inputs) -> Result<TickOutput, TargetError> {
        let inputs =
            Inputs { faults: ExternalFaults { model_disagreement: self.disagreement, ..inputs.faults }, ..*inputs };
        let outputs = control::step(&self.config, &mut self.state, inputs);
        if let Some(monitor) = &mut self.monitor {
            let telemetry = &outputs.telemetry;
            let readings = Readings {
                position_m: telemetry.position.to_num(),
                pressure_a_pa: telemetry.pressure_a.to_num(),
                pressure_b_pa: telemetry.pressure_b.to_num(),
                supply_pa: telemetry.supply.map(|p| p.to_num()),
            };
            let u_v: f32 = telemetry.u.to_num();
            if outputs.mode == Mode::Run {
                let verdict = monitor.step(&readings, self.previous_u_v);
                self.disagreement = verdict.disagreement;
                self.closest = self.closest.max(verdict.closeness());
            } else {
                monitor.restart(u_v);
                self.disagreement = false;
            }
            self.previous_u_v = u_v;
        }
        Ok(TickOutput { dac: outputs.dac, mode: outputs.mode })
    }

    fn watchdog_reset(&mut self) -> Result<(), TargetError> {
        self.state = State::boot(Some(Reason::WatchdogReset));
        self.disagreement = false;
        Ok(())
    }
}
