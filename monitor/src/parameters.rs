//! How much disagreement is normal.

use parameter_table::{Limits, Must, ParameterError as MonitorError, parameter_table};

parameter_table! {
    /// What the monitor tolerates. The defaults suit sensors with 600 Pa and 0.05 mm of noise and a rig file whose
    /// flows are right within a fifth; `docs/safety.md` has the rest.
    #[derive(Clone, Copy, Debug, PartialEq)]
    #[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
    pub struct MonitorParameters, keys "monitor.";

    // In a millisecond no flow adds up to more than a sensor's noise.
    /// How far back the comparison looks; at least two ticks.
    horizon_s: f32 = 0.05, "s", 1.0e-3 => 10.0;
    /// Pressure error that is always allowed: about five times the sensor's noise.
    pressure_pa: f32 = 3.5e3, "Pa", 1.0 => 1.0e6;
    /// Position error that is always allowed: about seven times the sensor's noise, and more for play in the mounting.
    position_m: f32 = 0.4e-3, "m", 0.0 => 1.0;
    /// Relative error of predicted flow and compression that is allowed.
    relative: f32 = 0.2, "", 0.0 => 10.0;
    /// Uncertainty of the valve's opening: its hysteresis and null shift.
    opening_v: f32 = 0.025, "V", 0.0 => 10.0;
}

/// A tick is no parameter of the monitor, but what it is built for.
static TICK: Limits = Limits::new("s", 2.0e-5, 0.1);

impl MonitorParameters {
    pub(crate) fn validate(&self, tick_s: f32) -> Result<(), MonitorError> {
        let refused = |key, value: f32, must| Err(MonitorError { key, value: f64::from(value), must });
        if !TICK.contains(tick_s) {
            return refused("tick_s", tick_s, Must::Fit(&TICK));
        }
        self.check_ranges()?;
        if self.horizon_s < 2.0 * tick_s {
            return refused(Key::horizon_s.row().key, self.horizon_s, Must::Be("be at least two ticks (seconds)"));
        }
        Ok(())
    }
}
