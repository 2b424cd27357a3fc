//! Named parameters: one table, read by the board (range checks) and by the desktop (names, help).

use serde::{Deserialize, Serialize};

/// What is known of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Name with its unit, as the rig file and the controller's configuration write it.
    pub name: &'static str,
    /// Value of a new board.
    pub default: f32,
    /// Smallest value accepted.
    pub low: f32,
    /// Largest value accepted.
    pub high: f32,
}

/// Why a value is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ParameterError {
    /// Outside its range, or not a number.
    Range,
}

macro_rules! parameters {
    ($($key:ident = $number:literal: $name:literal, $default:expr, $low:expr => $high:expr, $meaning:literal;)*) => {
        /// One number that can be changed on the board. The numbers behind the names are part of the protocol and of
        /// what lies in flash: append only.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Parameter {
            $(#[doc = $meaning] $key = $number,)*
        }

        impl Parameter {
            /// Every parameter, in the order of their numbers.
            pub const ALL: [Self; [$($number),*].len()] = [$(Self::$key),*];

            /// Name, default and range.
            #[must_use]
            pub const fn info(self) -> ParameterInfo {
                match self {
                    $(Self::$key => ParameterInfo { name: $name, default: $default, low: $low, high: $high },)*
                }
            }

            /// What it does, in a sentence. Apart from the rest, so that the texts are not in the firmware.
            #[must_use]
            pub const fn meaning(self) -> &'static str {
                match self {
                    $(Self::$key => $meaning,)*
                }
            }
        }
    };
}

parameters! {
    PositionLow = 0: "position_low_m", -0.5, -7.9 => 7.9, "Position at the converter's code 0, m from mid-stroke.";
    PositionHigh = 1: "position_high_m", 0.5, -7.9 => 7.9, "Position at the highest code, m.";
    PressureLow = 2: "pressure_low_pa", 0.0, -1.0e6 => 8.0e6, "Pressure at code 0, Pa absolute, all three sensors.";
    PressureHigh = 3: "pressure_high_pa", 1.0e6, -1.0e6 => 8.0e6, "Pressure at the highest code, Pa absolute.";
    ValveLow = 4: "valve_low_v", -5.0, -100.0 => 100.0, "Valve voltage about mid at DAC code 0, V.";
    ValveHigh = 5: "valve_high_v", 5.0, -100.0 => 100.0, "Valve voltage about mid at DAC code 4095, V.";
    TickHz = 6: "tick_hz", 1000.0, 1000.0 => 10000.0, "Control ticks per second; takes effect at the next start.";
    SupplySensor = 7: "supply_sensor", 1.0, 0.0 => 1.0, "1 if a supply pressure sensor is connected, 0 if not.";
    Gain = 8: "gain_v_per_m", 4.0, 0.0 => 30000.0, "Proportional gain, V/m.";
    SetpointLow = 9: "setpoint_low_m", -0.5, -7.9 => 7.9, "Lowest setpoint, m.";
    SetpointHigh = 10: "setpoint_high_m", 0.5, -7.9 => 7.9, "Highest setpoint, m.";
    SetpointVelocity = 11: "setpoint_velocity_m_per_s", 0.0, 0.0 => 100.0, "Fastest setpoint, m/s; 0: not limited.";
    SetpointAcceleration = 12: "setpoint_acceleration_m_per_s2", 0.0, 0.0 => 1000.0,
        "Largest setpoint acceleration, m/s2; 0: not limited.";
    DeadZoneRight = 13: "dead_zone_right_v", 0.0, -100.0 => 100.0, "Right break-point of the valve's dead zone, V.";
    DeadZoneLeft = 14: "dead_zone_left_v", 0.0, -100.0 => 100.0, "Left break-point of the valve's dead zone, V.";
    SlopeRight = 15: "slope_right", 1.0, 0.05 => 20.0, "Slope right of the dead zone.";
    SlopeLeft = 16: "slope_left", 1.0, 0.05 => 20.0, "Slope left of the dead zone.";
    DeadZoneBlend = 17: "dead_zone_blend_v", 0.0, 0.0 => 1.0,
        "Half-width of the blend across the dead zone, V; 0: chosen from the converters.";
    MaxVoltage = 18: "max_voltage_v", 5.0, 0.01 => 100.0, "Largest valve voltage ever commanded, V.";
    PositionMargin = 19: "position_margin_m", 0.0, 0.0 => 7.9, "Readings closer than this to a range end are faults, m.";
    PressureLimitLow = 20: "pressure_limit_low_pa", 5.0e4, -1.0e6 => 8.0e6, "Lowest believable pressure, Pa.";
    PressureLimitHigh = 21: "pressure_limit_high_pa", 9.9e5, -1.0e6 => 8.0e6, "Highest believable pressure, Pa.";
    PositionRate = 22: "position_rate_m_per_s", 3.0, 1.0e-3 => 100.0, "Fastest believable piston, m/s.";
    PositionNoise = 23: "position_noise_m", 1.0e-3, 0.0 => 1.0, "Largest sample difference by noise alone, m.";
    PressureRate = 24: "pressure_rate_pa_per_s", 2.5e8, 1.0 => 1.0e9, "Fastest believable pressure change, Pa/s.";
    PressureNoise = 25: "pressure_noise_pa", 1.0e4, 0.0 => 1.0e6, "Largest sample difference by noise alone, Pa.";
    GlitchTime = 26: "glitch_time_s", 5.0e-3, 0.0 => 1.0, "How long implausible readings are bridged, s.";
    StuckTime = 27: "stuck_time_s", 15.0e-3, 1.0e-3 => 10.0, "How long a noisy channel may repeat a code, s.";
    SupplyMinimum = 28: "supply_minimum_pa", 4.0e5, 0.0 => 8.0e6, "Supply pressure needed to run, Pa absolute.";
    TimingFaultTicks = 29: "timing_fault_ticks", 3.0, 0.0 => 100.0, "Timing faults in a row that are tolerated.";
    SelfTestTime = 30: "self_test_time_s", 0.1, 1.0e-3 => 60.0, "How long all sensors must be plausible after start, s.";
    CommandTimeOut = 31: "command_time_out_s", 0.0, 0.0 => 3600.0, "Longest silence of the host while running, s; 0: any.";
    TelemetryEvery = 32: "telemetry_every", 10.0, 1.0 => 10000.0, "One telemetry record every so many ticks.";
    Monitor = 33: "monitor", 2.0, 0.0 => 2.0, "Model monitor: 0 off, 1 warns, 2 trips.";
    MonitorHorizon = 34: "monitor_horizon_s", 0.05, 0.005 => 1.0, "How far back the model monitor compares, s.";
    MonitorPressure = 35: "monitor_pressure_pa", 3.5e3, 10.0 => 1.0e6,
        "Pressure error the monitor always allows, Pa: about five times the sensors' noise.";
    MonitorPosition = 36: "monitor_position_m", 0.4e-3, 0.0 => 0.1,
        "Position error the monitor always allows, m: about seven times the sensor's noise, more for play.";
    MonitorRelative = 37: "monitor_relative", 0.2, 0.0 => 2.0, "Relative error of flow and motion the monitor allows.";
    MonitorOpening = 38: "monitor_opening_v", 0.025, 0.0 => 5.0, "Valve hysteresis and null shift the monitor allows, V.";
    GasConstant = 40: "gas_constant_j_per_kg_k", 287.0, 1.0 => 1.0e4, "Specific gas constant, J/(kg K).";
    Temperature = 41: "temperature_k", 293.0, 200.0 => 400.0, "Supply air temperature, K.";
    HeatCapacityRatio = 42: "heat_capacity_ratio", 1.4, 1.01 => 1.7, "Ratio of specific heats.";
    SupplyPressure = 43: "supply_pressure_pa", 7.0e5, 1.0e5 => 8.0e6, "Nominal supply pressure, Pa absolute.";
    Atmosphere = 44: "atmosphere_pa", 1.0e5, 5.0e4 => 1.2e5, "Ambient pressure, Pa absolute.";
    FillCoefficient = 45: "fill_coefficient_kg_per_s_pa", 0.69501e-8, 1.0e-12 => 1.0e-5, "Flow into a chamber, kg/(s Pa).";
    ExhaustCoefficient = 46: "exhaust_coefficient_kg_per_s_pa", 0.898105e-8, 1.0e-12 => 1.0e-5,
        "Flow out of a chamber, kg/(s Pa).";
    Area = 47: "area_m2", 4.91e-4, 1.0e-6 => 1.0, "Piston area, m2.";
    Stroke = 48: "stroke_m", 1.0, 1.0e-3 => 15.0, "Stroke, m.";
    VolumeA0 = 49: "volume_a0_m3", 2.5e-4, 1.0e-7 => 1.0, "Volume of chamber A at mid-stroke, m3.";
    VolumeB0 = 50: "volume_b0_m3", 2.5e-4, 1.0e-7 => 1.0, "Volume of chamber B at mid-stroke, m3.";
    Mass = 51: "mass_kg", 10.125, 1.0e-3 => 1.0e4, "Moving mass, kg.";
    BristleStiffness = 52: "stiffness_n_per_m", 0.5e6, 1.0 => 1.0e9, "Bristle stiffness, N/m.";
    BristleDamping = 53: "damping_n_s_per_m", 400.0, 0.0 => 1.0e6, "Bristle damping, N s/m.";
    Viscous = 54: "viscous_n_s_per_m", 46.532, 0.0 => 1.0e6, "Viscous friction, N s/m.";
    Coulomb = 55: "coulomb_n", 23.103, 1.0e-3 => 1.0e5, "Coulomb friction, N.";
    StaticFriction = 56: "static_n", 24.0, 1.0e-3 => 1.0e5, "Static friction, N.";
    StribeckVelocity = 57: "stribeck_velocity_m_per_s", 0.010, 1.0e-5 => 1.0, "Stribeck velocity, m/s.";
    Breakaway = 58: "breakaway_m", 3.234e-5, 0.0 => 1.0e-2, "Breakaway deflection, m.";
}

impl Parameter {
    /// The number in frames and in flash.
    #[must_use]
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The parameter of a number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.number() == number)
    }

    /// The parameter of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.info().name == name)
    }

    /// Checks a value against the range.
    ///
    /// # Errors
    /// If the value is outside, or not a number.
    pub fn check(self, value: f32) -> Result<(), ParameterError> {
        let info = self.info();
        // A NaN fails both comparisons.
        if value >= info.low && value <= info.high { Ok(()) } else { Err(ParameterError::Range) }
    }
}
