//! The controller's parameters: physical numbers with units, as they stand in files, in flash and in commands.

/// Everything that can be set. `Default` is the converter ranges of the rig file's defaults, the paper's law at 4 V/m, no
/// dead zone, and plausibility limits wide enough for the paper's three cylinders.
///
/// Turned into a [`Config`](crate::Config) by [`Config::from_parameters`](crate::Config::from_parameters), which checks
/// every value.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct Parameters {
    /// Position at code 0 and at the highest code, m; within ±3.9. Make the sensor's range a little wider than the
    /// stroke and set `position_margin_m`: otherwise a broken wire looks like a piston at its end stop.
    pub position_range_m: [f32; 2],
    /// Pressure at code 0 and at the highest code, Pa; the same for the three pressure channels; within ±8 MPa.
    pub pressure_range_pa: [f32; 2],
    /// Bits of an ADC code, hardware oversampling included; 8 … 16.
    pub adc_bits: u8,
    /// Valve voltage about mid position at code 0 and at the highest code, V; within ±100 and at least 1 V apart.
    pub valve_range_v: [f32; 2],
    /// Bits of a DAC code; 8 … 16.
    pub dac_bits: u8,
    /// Ticks per second; 50 … 20,000.
    pub tick_hz: u32,
    /// Whether a supply pressure sensor is connected.
    pub supply_sensor: bool,

    /// Proportional gain `K_p`, V/m; 0 … 10,000.
    pub gain_v_per_m: f32,
    /// Lowest and highest position the reference may take, m; absent: the sensor's range.
    pub setpoint_range_m: Option<[f32; 2]>,
    /// Highest velocity of the reference, m/s; absent: a step passes as a step.
    pub setpoint_velocity_m_per_s: Option<f32>,
    /// Highest acceleration of the reference, m/s2; absent: not limited.
    pub setpoint_acceleration_m_per_s2: Option<f32>,

    /// Right break-point of the valve's dead zone that the inverse compensates, V.
    pub dead_zone_right_v: f32,
    /// Left break-point, V; not above the right one.
    pub dead_zone_left_v: f32,
    /// Slope right of the dead zone, dimensionless; 0.05 … 20.
    pub slope_right: f32,
    /// Slope left of the dead zone, dimensionless; 0.05 … 20.
    pub slope_left: f32,
    /// Half-width of the band in `w` over which the inverse crosses the dead zone, V; at least the gain times one position
    /// code, at most 1. Absent: one DAC code, or the gain times two position codes if that is more. See
    /// [`dead_zone_inverse`](crate::dead_zone_inverse) for how to choose it.
    pub dead_zone_blend_v: Option<f32>,
    /// Largest magnitude of valve voltage ever commanded, V.
    pub max_voltage_v: f32,
    /// Valve voltage in every mode but run, V; absent: the middle of the dead zone, where both chambers are blocked.
    pub safe_voltage_v: Option<f32>,

    /// Readings closer than this to an end of the position sensor's range are a fault, m. Zero means that the stroke
    /// reaches the ends of the range: an end reached continuously then counts as the end stop, one reached by a jump or
    /// found at self-test as a fault.
    pub position_margin_m: f32,
    /// Lowest and highest believable pressure, Pa absolute. No chamber is ever far below atmosphere, so a dead sensor shows.
    pub pressure_limits_pa: [f32; 2],
    /// Fastest believable piston, m/s.
    pub position_rate_m_per_s: f32,
    /// Largest difference between two samples that noise alone makes, m.
    pub position_noise_m: f32,
    /// Fastest believable pressure change, Pa/s. A chamber of a few cm3 at its end stop empties at 2e8 Pa/s.
    pub pressure_rate_pa_per_s: f32,
    /// Largest difference between two samples that noise alone makes, Pa.
    pub pressure_noise_pa: f32,
    /// How long implausible readings of one channel are bridged with the last good one, s; then the reason is raised.
    pub glitch_time_s: f32,
    /// How long a channel that is known to be noisy may repeat the same code, s; never less than 15 ticks.
    pub stuck_time_s: f32,
    /// Supply pressure below which the controller does not run, Pa absolute.
    pub supply_minimum_pa: f32,
    /// Ticks with a timing fault (missed, late, overrun) that are tolerated in a row; more raise the reason.
    pub timing_fault_ticks: u8,
    /// How long every sensor must be plausible before idle is reached, s.
    pub self_test_time_s: f32,
    /// Longest silence of the host while running, s; absent: the host may be silent.
    pub command_time_out_s: Option<f32>,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            position_range_m: [-0.5, 0.5],
            pressure_range_pa: [0.0, 1.0e6],
            adc_bits: 16,
            valve_range_v: [-5.0, 5.0],
            dac_bits: 12,
            tick_hz: 1000,
            supply_sensor: true,
            gain_v_per_m: 4.0,
            setpoint_range_m: None,
            setpoint_velocity_m_per_s: None,
            setpoint_acceleration_m_per_s2: None,
            dead_zone_right_v: 0.0,
            dead_zone_left_v: 0.0,
            slope_right: 1.0,
            slope_left: 1.0,
            dead_zone_blend_v: None,
            max_voltage_v: 5.0,
            safe_voltage_v: None,
            position_margin_m: 0.0,
            pressure_limits_pa: [5.0e4, 9.9e5],
            position_rate_m_per_s: 3.0,
            position_noise_m: 1.0e-3,
            pressure_rate_pa_per_s: 2.5e8,
            pressure_noise_pa: 1.0e4,
            glitch_time_s: 5.0e-3,
            stuck_time_s: 15.0e-3,
            supply_minimum_pa: 4.0e5,
            timing_fault_ticks: 3,
            self_test_time_s: 0.1,
            command_time_out_s: None,
        }
    }
}
