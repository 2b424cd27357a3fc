//! The parameters as one set: read and written by key, checked as a whole before anything uses them.

use board_link::{KeptError, Parameter, ParameterError, Source};
use control::{Config, MEASURED_AGAINST, Parameters, Quantities};
use monitor::{Monitor, MonitorParameters};
use parameter_table::{End, ParameterError as SettingsError};
use plant_model::{Plant, Rig};

use crate::bench::BenchPlant;
use crate::check::CHECK;
use crate::control_loop::Setup;

/// The timer latches a code one tick after the sample it answers.
const OUTPUT_DELAY_TICKS: u8 = 1;

/// What was learned and kept.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// [`Settings::rig_check`] of the parameters with which it was learned.
    pub rig: u32,
    /// The values.
    pub values: Quantities,
}

/// Every number that can be changed on the board, and what was kept of what it has learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    values: [f32; Parameter::ALL.len()],
    /// What the law begins with, if it fits.
    pub kept: Option<Kept>,
}

impl Default for Settings {
    // Filled in place, and apart from its callers: their stacks are small.
    #[inline(never)]
    fn default() -> Self {
        let mut settings = Self { values: [0.0; Parameter::ALL.len()], kept: None };
        for (value, parameter) in settings.values.iter_mut().zip(&Parameter::ALL) {
            *value = parameter.default_value();
        }
        settings
    }
}

fn index(parameter: Parameter) -> usize {
    // `ALL` holds every parameter once; a miss would read the first one rather than panic.
    Parameter::ALL.iter().position(|other| *other == parameter).unwrap_or(0)
}

impl Settings {
    /// The value of one parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f32 {
        self.values.get(index(parameter)).copied().unwrap_or_default()
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
    #[inline(never)]
    pub fn check(&self) -> Result<(), SettingsError> {
        // As `setup`, one part after the other: the stack need not hold the whole.
        self.control_config()?;
        self.watching()?;
        self.rig().validate()
    }

    /// The parameter that a check of these settings names, if the board has it.
    #[must_use]
    pub fn named_by(&self, error: &SettingsError) -> Option<Parameter> {
        Parameter::of_key(error.key, error.value, |parameter| self.get(parameter))
    }

    /// The control law's configuration. It begins with what was kept, if that fits.
    ///
    /// # Errors
    /// The first key that does not fit the others.
    #[inline(never)]
    pub fn control_config(&self) -> Result<Config, SettingsError> {
        let mut config = Config::from_parameters(&self.control_parameters()).map_err(SettingsError::from)?;
        let _ = self.begin_with_kept(&mut config);
        Ok(config)
    }

    /// The model monitor, if it is not off. Apart from the rest, so that its making and the law's share the stack.
    #[inline(never)]
    fn watching(&self) -> Result<Option<Monitor>, SettingsError> {
        if self.monitor_mode() == 0 {
            return Ok(None);
        }
        let plant = Plant::without_effects(&self.rig())?;
        let tick_s = 1.0 / self.tick_hz() as f32;
        let (allowed, lag_s) = (self.monitor_parameters(), self.get(Parameter::ServoLag));
        Ok(Some(Monitor::for_plant(plant, &allowed, tick_s, OUTPUT_DELAY_TICKS, lag_s)?))
    }

    /// Check value of the parameters that learned values are measured against.
    #[must_use]
    pub fn rig_check(&self) -> u32 {
        let mut check = CHECK.digest();
        for (source, value) in self.entries() {
            if let Source::Control(key, _) = source
                && MEASURED_AGAINST.contains(&key)
            {
                check.update(&value.to_le_bytes());
            }
        }
        check.finalize()
    }

    /// Lets a configuration made of these settings begin with what was kept, where something was. Or why not: the configuration
    /// is unchanged then.
    fn begin_with_kept(&self, config: &mut Config) -> Result<(), KeptError> {
        let Some(kept) = &self.kept else { return Ok(()) };
        if kept.rig != self.rig_check() {
            return Err(KeptError::OtherParameters);
        }
        config.start_from(&kept.values, self.tick_hz()).map_err(|quantity| KeptError::Limits(quantity.number()))
    }

    /// Whether what was kept is begun with. Apart from its callers: a configuration takes up much of the stack.
    ///
    /// # Errors
    /// Why it is not.
    #[inline(never)]
    pub fn kept_fits(&self) -> Result<(), KeptError> {
        match self.control_config() {
            Ok(mut config) => self.begin_with_kept(&mut config),
            // Whoever makes a setup of these settings is told.
            Err(_) => Ok(()),
        }
    }

    /// The rig's nominal values of what is learned. `None` under the paper's law.
    #[inline(never)]
    #[must_use]
    pub fn nominal(&self) -> Option<Quantities> {
        let config = self.control_config().ok()?;
        Some(config.nominal()?.values(self.tick_hz()))
    }

    /// Everything the control loop needs.
    ///
    /// # Errors
    /// The first key that does not fit the others.
    pub fn setup(&self) -> Result<Setup, SettingsError> {
        Ok(Setup {
            monitor: self.watching()?,
            config: self.control_config()?,
            monitor_trips: self.monitor_mode() == 2,
            every: self.telemetry_every(),
        })
    }

    fn monitor_mode(&self) -> u8 {
        self.get(Parameter::Monitor) as u8
    }

    /// Every value with the line of the table it belongs to.
    fn entries(&self) -> impl Iterator<Item = (Source, f32)> {
        Parameter::ALL.iter().map(|parameter| parameter.source()).zip(self.values.iter().copied())
    }

    /// The plant of bench mode. `None` if the settings describe no physical rig.
    #[must_use]
    pub fn bench_plant(&self) -> Option<BenchPlant> {
        BenchPlant::of_rig(&self.rig(), &self.control_parameters())
    }

    /// The control law's parameters. What the board cannot change is as by default: 16-bit ADC codes and 12-bit DAC codes,
    /// which every board hands over, and the safe voltage in the middle of the dead zone.
    #[must_use]
    #[inline(never)]
    pub fn control_parameters(&self) -> Parameters {
        let mut parameters = Parameters::default();
        for (source, value) in self.entries() {
            if let Source::Control(key, end) = source {
                parameters.put(key, end, value);
            }
        }
        parameters
    }

    /// What the model monitor allows.
    #[must_use]
    pub fn monitor_parameters(&self) -> MonitorParameters {
        let mut parameters = MonitorParameters::default();
        for (source, value) in self.entries() {
            if let Source::Monitor(key) = source {
                parameters.put(key, End::First, value);
            }
        }
        parameters
    }

    /// The plant of bench mode and of the model monitor; its valve is the one that the law compensates.
    #[must_use]
    #[inline(never)]
    pub fn rig(&self) -> Rig<f32> {
        let mut rig = Rig::<f32>::paper_a();
        for (source, value) in self.entries() {
            if let Source::Rig(place) = source {
                place.key().set(&mut rig, value);
            }
        }
        rig.valve.dead_zone_right_v = self.get(Parameter::DeadZoneRight);
        rig.valve.dead_zone_left_v = self.get(Parameter::DeadZoneLeft);
        rig.valve.slope_right = self.get(Parameter::SlopeRight);
        rig.valve.slope_left = self.get(Parameter::SlopeLeft);
        rig.valve.max_voltage_v = self.get(Parameter::MaxVoltage);
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
