//! The parameters as one set: read and written by key, checked as a whole before anything uses them.

use board_link::{Parameter, ParameterError};
use control::{Config, Parameters};
use monitor::{Monitor, MonitorParameters};
use plant_model::{Plant, Rig};

use crate::control_loop::Setup;

/// The timer latches a code one tick after the sample it answers.
const OUTPUT_DELAY_TICKS: u8 = 1;

/// Every number that can be changed on the board.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    values: [f32; Parameter::ALL.len()],
}

/// The parameters do not fit together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettingsError {
    /// The key at fault.
    pub key: &'static str,
    /// What it must be, as the end of the sentence "must …".
    pub must: &'static str,
}

impl Default for Settings {
    fn default() -> Self {
        Self { values: Parameter::ALL.map(|parameter| parameter.info().default) }
    }
}

fn index(parameter: Parameter) -> usize {
    // `ALL` holds every parameter once; a miss would read the first one rather than panic.
    Parameter::ALL.into_iter().position(|other| other == parameter).unwrap_or(0)
}

impl Settings {
    /// The value of one parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f32 {
        self.values.get(index(parameter)).copied().unwrap_or(parameter.info().default)
    }

    /// Changes one parameter, within its own range. [`Settings::check`] tells whether the whole still fits together.
    ///
    /// # Errors
    /// If the value is out of range; nothing is changed then.
    pub fn set(&mut self, parameter: Parameter, value: f32) -> Result<(), ParameterError> {
        parameter.check(value)?;
        if let Some(slot) = self.values.get_mut(index(parameter)) {
            *slot = value;
        }
        Ok(())
    }

    /// Checks everything that depends on more than one parameter.
    ///
    /// # Errors
    /// The first key that does not fit the others.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.setup()?;
        self.rig().validate().map_err(|error| SettingsError { key: error.key, must: error.must })
    }

    /// The control law's configuration.
    ///
    /// # Errors
    /// The first key that does not fit the others.
    pub fn control_config(&self) -> Result<Config, SettingsError> {
        Config::from_parameters(&self.control_parameters())
            .map_err(|error| SettingsError { key: error.key, must: error.must })
    }

    /// Everything the control loop needs.
    ///
    /// # Errors
    /// The first key that does not fit the others.
    pub fn setup(&self) -> Result<Setup, SettingsError> {
        let monitor = self.get(Parameter::Monitor) as u8;
        let watching = if monitor == 0 {
            None
        } else {
            let parameters = self.monitor_parameters();
            let tick_s = 1.0 / self.tick_hz() as f32;
            let plant = Plant::without_effects(&self.rig())
                .map_err(|error| SettingsError { key: error.key, must: error.must })?;
            let made = Monitor::for_plant(plant, &parameters, tick_s, OUTPUT_DELAY_TICKS);
            Some(made.map_err(|error| SettingsError { key: error.key, must: error.must })?)
        };
        Ok(Setup {
            config: self.control_config()?,
            monitor: watching,
            monitor_trips: monitor == 2,
            every: self.telemetry_every(),
        })
    }

    /// The control law's parameters.
    #[must_use]
    pub fn control_parameters(&self) -> Parameters {
        use Parameter as P;
        let unless_zero = |parameter| Some(self.get(parameter)).filter(|value| *value > 0.0);
        Parameters {
            position_range_m: [self.get(P::PositionLow), self.get(P::PositionHigh)],
            pressure_range_pa: [self.get(P::PressureLow), self.get(P::PressureHigh)],
            valve_range_v: [self.get(P::ValveLow), self.get(P::ValveHigh)],
            tick_hz: self.tick_hz(),
            supply_sensor: self.get(P::SupplySensor) >= 0.5,
            gain_v_per_m: self.get(P::Gain),
            setpoint_range_m: Some([self.get(P::SetpointLow), self.get(P::SetpointHigh)]),
            setpoint_velocity_m_per_s: unless_zero(P::SetpointVelocity),
            setpoint_acceleration_m_per_s2: unless_zero(P::SetpointAcceleration),
            dead_zone_right_v: self.get(P::DeadZoneRight),
            dead_zone_left_v: self.get(P::DeadZoneLeft),
            slope_right: self.get(P::SlopeRight),
            slope_left: self.get(P::SlopeLeft),
            dead_zone_blend_v: unless_zero(P::DeadZoneBlend),
            max_voltage_v: self.get(P::MaxVoltage),
            safe_voltage_v: None,
            position_margin_m: self.get(P::PositionMargin),
            pressure_limits_pa: [self.get(P::PressureLimitLow), self.get(P::PressureLimitHigh)],
            position_rate_m_per_s: self.get(P::PositionRate),
            position_noise_m: self.get(P::PositionNoise),
            pressure_rate_pa_per_s: self.get(P::PressureRate),
            pressure_noise_pa: self.get(P::PressureNoise),
            glitch_time_s: self.get(P::GlitchTime),
            stuck_time_s: self.get(P::StuckTime),
            supply_minimum_pa: self.get(P::SupplyMinimum),
            timing_fault_ticks: self.get(P::TimingFaultTicks) as u8,
            self_test_time_s: self.get(P::SelfTestTime),
            command_time_out_s: unless_zero(P::CommandTimeOut),
            // 16-bit ADC codes and 12-bit DAC codes: what every board hands over.
            ..Parameters::default()
        }
    }

    /// What the model monitor allows.
    #[must_use]
    pub fn monitor_parameters(&self) -> MonitorParameters {
        use Parameter as P;
        MonitorParameters {
            horizon_s: self.get(P::MonitorHorizon),
            pressure_pa: self.get(P::MonitorPressure),
            position_m: self.get(P::MonitorPosition),
            relative: self.get(P::MonitorRelative),
            opening_v: self.get(P::MonitorOpening),
        }
    }

    /// The plant of bench mode and of the model monitor.
    #[must_use]
    pub fn rig(&self) -> Rig<f32> {
        use Parameter as P;
        let mut rig = Rig::<f32>::paper_a();
        rig.gas.gas_constant_j_per_kg_k = self.get(P::GasConstant);
        rig.gas.temperature_k = self.get(P::Temperature);
        rig.gas.heat_capacity_ratio = self.get(P::HeatCapacityRatio);
        rig.supply.pressure_pa = self.get(P::SupplyPressure);
        rig.supply.atmosphere_pa = self.get(P::Atmosphere);
        rig.valve.fill_coefficient_kg_per_s_pa = self.get(P::FillCoefficient);
        rig.valve.exhaust_coefficient_kg_per_s_pa = self.get(P::ExhaustCoefficient);
        rig.valve.dead_zone_right_v = self.get(P::DeadZoneRight);
        rig.valve.dead_zone_left_v = self.get(P::DeadZoneLeft);
        rig.valve.slope_right = self.get(P::SlopeRight);
        rig.valve.slope_left = self.get(P::SlopeLeft);
        rig.valve.max_voltage_v = self.get(P::MaxVoltage);
        rig.cylinder.area_m2 = self.get(P::Area);
        rig.cylinder.stroke_m = self.get(P::Stroke);
        rig.cylinder.volume_a0_m3 = self.get(P::VolumeA0);
        rig.cylinder.volume_b0_m3 = self.get(P::VolumeB0);
        rig.load.mass_kg = self.get(P::Mass);
        rig.friction.stiffness_n_per_m = self.get(P::BristleStiffness);
        rig.friction.damping_n_s_per_m = self.get(P::BristleDamping);
        rig.friction.viscous_n_s_per_m = self.get(P::Viscous);
        rig.friction.coulomb_n = self.get(P::Coulomb);
        rig.friction.static_n = self.get(P::StaticFriction);
        rig.friction.stribeck_velocity_m_per_s = self.get(P::StribeckVelocity);
        rig.friction.breakaway_m = self.get(P::Breakaway);
        rig
    }

    /// Control ticks per second.
    #[must_use]
    pub fn tick_hz(&self) -> u32 {
        self.get(Parameter::TickHz) as u32
    }

    /// Telemetry records are one in this many ticks; at least 1.
    #[must_use]
    pub fn telemetry_every(&self) -> u32 {
        (self.get(Parameter::TelemetryEvery) as u32).max(1)
    }
}
