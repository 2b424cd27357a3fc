//! How much disagreement is normal.

use plant_model::ParameterError;

/// What the monitor tolerates. The defaults suit sensors with 600 Pa and 0.05 mm of noise and a rig file whose
/// coefficients are right within a fifth.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct MonitorParameters {
    /// How far back the comparison looks, s: at least two ticks.
    pub horizon_s: f32,
    /// Pressure error that is always allowed, Pa: about five times the sensor's noise.
    pub pressure_pa: f32,
    /// Position error that is always allowed, m: about seven times the sensor's noise, and more for play in the mounting.
    pub position_m: f32,
    /// Relative error of predicted flow and compression that is allowed.
    pub relative: f32,
    /// Uncertainty of the valve's opening, V: its hysteresis and null shift.
    pub opening_v: f32,
}

impl Default for MonitorParameters {
    fn default() -> Self {
        Self { horizon_s: 0.05, pressure_pa: 3.5e3, position_m: 0.4e-3, relative: 0.2, opening_v: 0.025 }
    }
}

/// What is wrong with a monitor's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MonitorError {
    /// The offending key.
    pub key: &'static str,
    /// The value found.
    pub value: f64,
    /// What would be accepted, as the end of the sentence "must …".
    pub must: &'static str,
}

impl core::fmt::Display for MonitorError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "{} = {} must {}", self.key, self.value, self.must)
    }
}

impl core::error::Error for MonitorError {}

impl From<ParameterError> for MonitorError {
    fn from(error: ParameterError) -> Self {
        Self { key: error.key, value: error.value, must: error.must }
    }
}

impl MonitorParameters {
    pub(crate) fn validate(&self, tick_s: f32) -> Result<(), MonitorError> {
        let tests = [
            ("tick_s", tick_s, 2.0e-5, 0.1, "be from 2e-5 to 0.1 (seconds)"),
            ("monitor.horizon_s", self.horizon_s, 2.0 * tick_s, 10.0, "be from two ticks to 10 (seconds)"),
            ("monitor.pressure_pa", self.pressure_pa, 1.0, 1.0e6, "be from 1 to 1e6 (pascals)"),
            ("monitor.position_m", self.position_m, 0.0, 1.0, "be from 0 to 1 (metres)"),
            ("monitor.relative", self.relative, 0.0, 10.0, "be from 0 to 10"),
            ("monitor.opening_v", self.opening_v, 0.0, 10.0, "be from 0 to 10 (volts)"),
        ];
        for (key, value, low, high, must) in tests {
            if !(value >= low && value <= high) {
                return Err(MonitorError { key, value: f64::from(value), must });
            }
        }
        Ok(())
    }
}
