//! The parameters that can be changed on the board, by number.
//!
//! Each is a line of the controller's, the monitor's or the rig's table: range, unit, default and meaning stand there, and
//! only what is the board's alone stands here.

use control::acceleration_range;
use parameter_table::{End, Limits, parameter_table};
use serde::{Deserialize, Serialize};

/// What is known of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Name with its unit.
    pub name: &'static str,
    /// Value of a new board.
    pub default: f32,
    /// The values accepted; where they are optional, 0 is accepted, too, and means absent.
    pub limits: Limits,
    /// If it is an end of a pair that is one parameter elsewhere: which.
    pub end: Option<End>,
    /// What it does, in a sentence or two; of a pair, what both do.
    pub meaning: &'static str,
}

/// Why a value is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ParameterError {
    /// Outside its range, or not a number.
    Range,
}

/// Where a parameter's line stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// In the controller's table; of a pair, one of its ends.
    Control(control::Key, End),
    /// In the model monitor's.
    Monitor(monitor::Key),
    /// In the rig's.
    Rig(plant_model::Place),
    /// In the board's own.
    Board(own::Key),
}

/// What only the board has.
pub mod own {
    use super::parameter_table;

    parameter_table! {
        /// The board's own parameters.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct BoardParameters, keys "";

        /// One telemetry record every so many ticks.
        telemetry_every: u32 = 10, "", 1 => 10_000;
        /// Model monitor: 0 off, 1 warns, 2 trips.
        monitor: u8 = 2, "", 0 => 2;
    }
}

/// The slowest and the fastest tick of the board, 1/s. A slower one is too long a step for the simulated plant of bench mode,
/// a faster one too short for the control interrupt.
const BOARD_TICK_HZ: [u32; 2] = [1000, 10_000];

const fn whole([low, high]: [u32; 2]) -> [f64; 2] {
    [low as f64, high as f64]
}

macro_rules! source {
    (control $entry:ident) => {
        Source::Control(control::Key::$entry, End::First)
    };
    (control $entry:ident $end:ident) => {
        Source::Control(control::Key::$entry, End::$end)
    };
    (monitor $entry:ident) => {
        Source::Monitor(monitor::Key::$entry)
    };
    (rig $entry:ident) => {
        Source::Rig(plant_model::Place::$entry)
    };
    (own $entry:ident) => {
        Source::Board(own::Key::$entry)
    };
}

macro_rules! parameters {
    ($($key:ident = $number:literal: $table:ident.$entry:ident $(.$end:ident)? $(as $name:literal)? $(within $narrower:expr)?;)*) => {
        /// One number that can be changed on the board. The numbers behind the names are part of the protocol and of
        /// what lies in flash: append only.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
        #[repr(u8)]
        pub enum Parameter {
            $(#[doc = concat!("`", stringify!($entry), "` of the table `", stringify!($table), "`.")] $key = $number,)*
        }

        impl Parameter {
            /// Every parameter, in the order of their numbers.
            pub const ALL: [Self; [$($number),*].len()] = [$(Self::$key),*];

            /// The table and the line in it.
            #[must_use]
            pub const fn source(self) -> Source {
                match self {
                    $(Self::$key => source!($table $entry $($end)?),)*
                }
            }

            /// The name in commands, where it is not that of the line.
            const fn alias(self) -> Option<&'static str> {
                match self {
                    $($(Self::$key => Some($name),)?)*
                    _ => None,
                }
            }

            /// The range, where the board's is narrower than that of the line.
            const fn narrower(self) -> Option<[f64; 2]> {
                match self {
                    $($(Self::$key => const { Some($narrower) },)?)*
                    _ => None,
                }
            }
        }
    };
}

parameters! {
    PositionLow = 0: control.position_range_m.First as "position_low_m";
    PositionHigh = 1: control.position_range_m.Second as "position_high_m";
    PressureLow = 2: control.pressure_range_pa.First as "pressure_low_pa";
    PressureHigh = 3: control.pressure_range_pa.Second as "pressure_high_pa";
    ValveLow = 4: control.valve_range_v.First as "valve_low_v";
    ValveHigh = 5: control.valve_range_v.Second as "valve_high_v";
    TickHz = 6: control.tick_hz within whole(BOARD_TICK_HZ);
    SupplySensor = 7: control.supply_sensor;
    Gain = 8: control.gain_v_per_m;
    SetpointLow = 9: control.setpoint_range_m.First as "setpoint_low_m";
    SetpointHigh = 10: control.setpoint_range_m.Second as "setpoint_high_m";
    SetpointVelocity = 11: control.setpoint_velocity_m_per_s;
    SetpointAcceleration = 12: control.setpoint_acceleration_m_per_s2 within
        [acceleration_range(BOARD_TICK_HZ[0])[0], acceleration_range(BOARD_TICK_HZ[1])[1]];
    DeadZoneRight = 13: control.dead_zone_right_v;
    DeadZoneLeft = 14: control.dead_zone_left_v;
    SlopeRight = 15: control.slope_right;
    SlopeLeft = 16: control.slope_left;
    DeadZoneBlend = 17: control.dead_zone_blend_v;
    MaxVoltage = 18: control.max_voltage_v;
    PositionMargin = 19: control.position_margin_m;
    PressureLimitLow = 20: control.pressure_limits_pa.First as "pressure_limit_low_pa";
    PressureLimitHigh = 21: control.pressure_limits_pa.Second as "pressure_limit_high_pa";
    PositionRate = 22: control.position_rate_m_per_s;
    PositionNoise = 23: control.position_noise_m;
    PressureRate = 24: control.pressure_rate_pa_per_s;
    PressureNoise = 25: control.pressure_noise_pa;
    GlitchTime = 26: control.glitch_time_s;
    StuckTime = 27: control.stuck_time_s;
    SupplyMinimum = 28: control.supply_minimum_pa;
    TimingFaultTicks = 29: control.timing_fault_ticks;
    SelfTestTime = 30: control.self_test_time_s;
    CommandTimeOut = 31: control.command_time_out_s;
    TelemetryEvery = 32: own.telemetry_every;
    Monitor = 33: own.monitor;
    MonitorHorizon = 34: monitor.horizon_s as "monitor_horizon_s";
    MonitorPressure = 35: monitor.pressure_pa as "monitor_pressure_pa";
    MonitorPosition = 36: monitor.position_m as "monitor_position_m";
    MonitorRelative = 37: monitor.relative as "monitor_relative";
    MonitorOpening = 38: monitor.opening_v as "monitor_opening_v";
    GasConstant = 40: rig.gas_constant_j_per_kg_k;
    Temperature = 41: rig.temperature_k;
    HeatCapacityRatio = 42: rig.heat_capacity_ratio;
    SupplyPressure = 43: rig.pressure_pa as "supply_pressure_pa";
    Atmosphere = 44: rig.atmosphere_pa;
    FillCoefficient = 45: rig.fill_coefficient_kg_per_s_pa;
    ExhaustCoefficient = 46: rig.exhaust_coefficient_kg_per_s_pa;
    Area = 47: rig.area_m2;
    Stroke = 48: rig.stroke_m;
    VolumeA0 = 49: rig.volume_a0_m3;
    VolumeB0 = 50: rig.volume_b0_m3;
    Mass = 51: rig.mass_kg;
    BristleStiffness = 52: rig.stiffness_n_per_m;
    BristleDamping = 53: rig.damping_n_s_per_m;
    Viscous = 54: rig.viscous_n_s_per_m;
    Coulomb = 55: rig.coulomb_n;
    StaticFriction = 56: rig.static_n;
    StribeckVelocity = 57: rig.stribeck_velocity_m_per_s;
    Breakaway = 58: rig.breakaway_m;
    Law = 59: control.law;
    ServoSpeed = 60: control.servo_speed_m_per_s;
    ServoAcceleration = 61: control.servo_acceleration_m_per_s2;
    ServoJerk = 62: control.servo_jerk_m_per_s3;
    ServoBandwidth = 63: control.servo_bandwidth_rad_per_s;
    ServoObserver = 64: control.servo_observer_rad_per_s;
    ServoForceRate = 65: control.servo_force_rate_per_s;
    ServoArea = 66: control.servo_area_m2_per_kg;
    ServoLengthA = 67: control.servo_length_a_m;
    ServoLengthB = 68: control.servo_length_b_m;
    ServoFill = 69: control.servo_fill_m_per_s;
    ServoExhaust = 70: control.servo_exhaust_m_per_s;
    ServoHeatCapacityRatio = 71: control.servo_heat_capacity_ratio;
    ServoAtmosphere = 72: control.servo_atmosphere_pa;
    ServoSupply = 73: control.servo_supply_pa;
    ServoRest = 74: control.servo_rest_pa;
    ServoBristle = 75: control.servo_bristle_per_s2;
    ServoViscous = 76: control.servo_viscous_per_s;
    ServoCoulomb = 77: control.servo_coulomb_m_per_s2;
    ServoLag = 78: control.servo_lag_s;
    PressureSensors = 79: control.pressure_sensors;
    PositionOffset = 80: control.position_offset_m;
    PositionGain = 81: control.position_gain;
    PressureAOffset = 82: control.pressure_a_offset_pa;
    PressureAGain = 83: control.pressure_a_gain;
    PressureBOffset = 84: control.pressure_b_offset_pa;
    PressureBGain = 85: control.pressure_b_gain;
    SupplyOffset = 86: control.supply_offset_pa;
    SupplyGain = 87: control.supply_gain;
    PressureLossTrips = 88: control.pressure_loss_trips;
    FillConductance = 90: rig.fill_conductance_m3_per_s_pa;
    ExhaustConductance = 91: rig.exhaust_conductance_m3_per_s_pa;
    FillCriticalRatio = 92: rig.fill_critical_ratio;
    ExhaustCriticalRatio = 93: rig.exhaust_critical_ratio;
    Inclination = 94: rig.inclination_deg;
    HoseALength = 95: rig.a_length_m as "hose_a_length_m";
    HoseADiameter = 96: rig.a_diameter_m as "hose_a_diameter_m";
    HoseBLength = 97: rig.b_length_m as "hose_b_length_m";
    HoseBDiameter = 98: rig.b_diameter_m as "hose_b_diameter_m";
    SpringRate = 99: rig.spring_n_per_m;
    SpringPreload = 100: rig.spring_preload_n;
    CushionALength = 101: rig.cushion_a_length_m as "cushion_a_length_m";
    CushionAConductance = 102: rig.cushion_a_conductance_m3_per_s_pa as "cushion_a_conductance_m3_per_s_pa";
    CushionBLength = 103: rig.cushion_b_length_m as "cushion_b_length_m";
    CushionBConductance = 104: rig.cushion_b_conductance_m3_per_s_pa as "cushion_b_conductance_m3_per_s_pa";
    ServoAreaB = 105: control.servo_area_b_m2_per_kg;
    ServoFillB = 106: control.servo_fill_b_m_per_s;
    ServoExhaustB = 107: control.servo_exhaust_b_m_per_s;
    ServoRestB = 108: control.servo_rest_b_pa;
    ServoFillCriticalRatio = 109: control.servo_fill_critical_ratio;
    ServoExhaustCriticalRatio = 110: control.servo_exhaust_critical_ratio;
    ServoDelay = 111: control.servo_delay_s;
    ServoOpening1 = 112: control.servo_opening_1_v;
    ServoOpening2 = 113: control.servo_opening_2_v;
    ServoOpening3 = 114: control.servo_opening_3_v;
    ServoOpening4 = 115: control.servo_opening_4_v;
    ServoOpening5 = 116: control.servo_opening_5_v;
    ServoOpening6 = 117: control.servo_opening_6_v;
    ServoOpening7 = 118: control.servo_opening_7_v;
    ServoOpening8 = 119: control.servo_opening_8_v;
    ServoOpening9 = 120: control.servo_opening_9_v;
    ServoOpening10 = 121: control.servo_opening_10_v;
    ServoLead = 122: control.servo_lead_s;
    ServoStickSlip = 123: control.servo_stick_slip;
    StopTime = 124: control.stop_time_s;
}

impl ParameterInfo {
    /// The range in words, e.g. `1e-4 to 50 m/s; 0: absent`.
    pub fn range(&self) -> impl core::fmt::Display {
        let absent = if self.limits.optional { "; 0: absent" } else { "" };
        core::fmt::from_fn(move |f| write!(f, "{}{absent}", self.limits))
    }

    /// The meaning; of an end of a pair, which end it is.
    pub fn words(&self) -> impl core::fmt::Display {
        let end = match self.end {
            None => "",
            Some(End::First) => "The first of: ",
            Some(End::Second) => "The second of: ",
        };
        core::fmt::from_fn(move |f| write!(f, "{end}{}", self.meaning))
    }
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
        Self::ALL.iter().copied().find(|parameter| parameter.number() == number)
    }

    /// The parameter of a name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|parameter| parameter.name() == name)
    }

    /// The name in commands: that of the line, unless it stands for one end of a pair or would not be clear alone.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.alias().unwrap_or(match self.source() {
            Source::Control(key, _) => key.row().key,
            Source::Monitor(key) => key.row().key,
            Source::Rig(place) => place.key().name,
            Source::Board(key) => key.row().key,
        })
    }

    /// The key of its line, as messages of the checks name it.
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self.source() {
            Source::Control(key, _) => key.row().key,
            Source::Monitor(key) => key.row().key,
            Source::Rig(place) => place.key().path,
            Source::Board(key) => key.row().key,
        }
    }

    /// Whether a message about `key` is about it: of the rig, `key` may be one side of what stands for both.
    fn is_meant_by(self, key: &str) -> bool {
        match self.source() {
            Source::Rig(place) if place.key().sides.iter().any(|side| side.key().path == key) => true,
            _ => self.key() == key,
        }
    }

    /// The parameter of a key that a check names, of a pair the end that has the value found.
    #[must_use]
    pub fn of_key(key: &str, value: f64, get: impl Fn(Self) -> f32) -> Option<Self> {
        let meant = || Self::ALL.into_iter().filter(|parameter| parameter.is_meant_by(key));
        meant().find(|parameter| f64::from(get(*parameter)) == value).or_else(|| meant().next())
    }

    /// Which end it is of a pair that is one parameter elsewhere.
    #[must_use]
    pub const fn end(self) -> Option<End> {
        match self.source() {
            Source::Control(key, end) if key.row().limits.pair => Some(end),
            _ => None,
        }
    }

    /// The values that the board takes.
    #[must_use]
    pub fn limits(self) -> Limits {
        let limits = match self.source() {
            Source::Control(key, _) => key.row().limits,
            Source::Monitor(key) => key.row().limits,
            Source::Rig(place) => place.key().limits,
            Source::Board(key) => key.row().limits,
        };
        let [low, high] = match (self.narrower(), self.end()) {
            (Some(narrower), _) => narrower,
            // The other end needs its place, too.
            (None, Some(End::First)) => [limits.low, limits.high - f64::from(limits.apart)],
            (None, Some(End::Second)) => [limits.low + f64::from(limits.apart), limits.high],
            (None, None) => [limits.low, limits.high],
        };
        // A board always has both ends of a range, and where 0 is a value it cannot mean absent.
        let optional = limits.optional && !limits.pair && low > 0.0;
        Limits { low, high, pair: false, optional, ..limits }
    }

    /// The value of a new board.
    #[must_use]
    #[inline(never)]
    pub fn default_value(self) -> f32 {
        match self.source() {
            Source::Control(control::Key::setpoint_range_m, end) => {
                // Absent: the range of the position.
                control::Key::position_range_m.default_value().number(end)
            }
            Source::Control(key, end) => key.default_value().number(end),
            Source::Monitor(key) => key.default_value().number(End::First),
            Source::Rig(place) => place.key().get(&plant_model::Rig::paper_a()),
            Source::Board(key) => key.default_value().number(End::First),
        }
    }

    /// What it does. Apart from the range, so that the texts are not in the firmware.
    #[must_use]
    pub const fn meaning(self) -> &'static str {
        match self.source() {
            Source::Control(key, _) => key.meaning(),
            Source::Monitor(key) => key.meaning(),
            Source::Rig(place) => place.key().meaning(),
            Source::Board(key) => key.meaning(),
        }
    }

    /// Everything that lists show.
    #[must_use]
    pub fn info(self) -> ParameterInfo {
        ParameterInfo {
            name: self.name(),
            default: self.default_value(),
            limits: self.limits(),
            end: self.end(),
            meaning: self.meaning(),
        }
    }

    /// Checks a value against the range.
    ///
    /// # Errors
    /// If the value is outside, or not a number.
    pub fn check(self, value: f32) -> Result<(), ParameterError> {
        let limits = self.limits();
        let absent = limits.optional && value == 0.0;
        if absent || limits.contains(value) { Ok(()) } else { Err(ParameterError::Range) }
    }
}
