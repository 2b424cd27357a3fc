//! The scenario file.

use crate::fault::Fault;
use crate::rig;
use control::program::ProgramParameters;
use control::{OperatorCommand, Parameters};
use monitor::MonitorParameters;
use plant_model::Effect;
use plant_sim::CodeNoise;
use rig_files::{InputError, RigFile, read_text};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One scenario.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// What happens, as a sentence.
    pub name: String,
    /// `paper-a`, `paper-b`, `paper-c`, or a rig file relative to the scenario file.
    pub rig: String,
    /// How long it runs, s.
    pub duration_s: f64,
    /// Seed of noise and garbage.
    #[serde(default)]
    pub seed: u64,
    /// Armed from the beginning, or booting.
    #[serde(default)]
    pub start: Start,
    /// Whole ticks between computing a DAC code and the valve receiving it; 1 on the board, where a timer latches it.
    #[serde(default = "one")]
    pub output_delay_ticks: u8,
    /// Dead zone of the rig's valve and of the controller's inverse, ± V, instead of the rig file's.
    pub dead_zone_v: Option<f64>,
    /// Effects added to the rig, as in a rig file; law and monitor know the valve's lag of them, as on the board.
    #[serde(default)]
    pub effects: BTreeMap<String, BTreeMap<String, f64>>,
    /// How the plant differs from its rig file, which controller and monitor do not know.
    #[serde(default)]
    pub deviation: Deviation,
    /// A dump valve at the board's air output: how fast the supply then falls in every state but idle, run and a controlled stop, s.
    /// Absent: none.
    pub dump_valve_s: Option<f64>,
    /// Ticks per second instead of the rig file's.
    pub tick_hz: Option<u32>,
    /// Sensor noise in a finished code, standard deviations.
    #[serde(default)]
    pub noise: CodeNoise,
    /// Where the piston begins, m.
    #[serde(default)]
    pub initial_position_m: f64,
    /// Parameters of the controller that differ from those made for the rig.
    #[serde(default)]
    pub control: toml::Table,
    /// The monitor's parameters; `enabled = false` leaves it out.
    #[serde(default)]
    pub monitor: MonitorChoice,
    /// References, each in force from its time on.
    #[serde(default)]
    pub reference: Vec<ReferenceSegment>,
    /// Operator commands.
    #[serde(default)]
    pub command: Vec<ScheduledCommand>,
    /// Faults.
    #[serde(default)]
    pub fault: Vec<Fault>,
    /// What must come of it.
    pub expect: Expect,
    /// Where the file stands, to find rig files.
    #[serde(skip)]
    pub folder: PathBuf,
}

/// By what factors the plant differs from its rig file.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Deviation {
    /// Of the flow that fills.
    pub fill: f64,
    /// Of the flow that exhausts.
    pub exhaust: f64,
    /// Of the volumes of both chambers at mid-stroke.
    pub volumes: [f64; 2],
    /// Of the valve's time constant.
    pub lag: f64,
    /// Of both break-points of the dead zone.
    pub dead_zone: f64,
    /// Of the polytropic exponent.
    pub exponent: f64,
    /// Of the mass.
    pub mass: f64,
    /// Of dry and viscous friction.
    pub friction: f64,
}

impl Deviation {
    /// The rig file is right.
    pub const NONE: Self = Self {
        fill: 1.0,
        exhaust: 1.0,
        volumes: [1.0; 2],
        lag: 1.0,
        dead_zone: 1.0,
        exponent: 1.0,
        mass: 1.0,
        friction: 1.0,
    };
    /// Fills faster, exhausts slower by a tenth, and has chambers larger by half of that.
    pub const A_TENTH: Self = Self { fill: 1.1, exhaust: 0.9, volumes: [1.05; 2], ..Self::NONE };

    /// Makes the plant of a rig file.
    pub fn spoil(&self, file: &mut RigFile) {
        let rig = &mut file.rig;
        rig.valve.fill_coefficient_kg_per_s_pa *= self.fill;
        rig.valve.exhaust_coefficient_kg_per_s_pa *= self.exhaust;
        rig.cylinder.volume_a0_m3 *= self.volumes[0];
        rig.cylinder.volume_b0_m3 *= self.volumes[1];
        rig.valve.dead_zone_right_v *= self.dead_zone;
        rig.valve.dead_zone_left_v *= self.dead_zone;
        rig.gas.heat_capacity_ratio *= self.exponent;
        rig.load.mass_kg *= self.mass;
        rig.friction.coulomb_n *= self.friction;
        rig.friction.static_n *= self.friction;
        rig.friction.viscous_n_s_per_m *= self.friction;
        // A bristle must not carry more than the sliding force.
        rig.friction.breakaway_m *= self.friction.min(1.0);
        if let Some(&[lag_s]) = file.effects.get(Effect::ValveLag) {
            file.effects.set(Effect::ValveLag, &[lag_s * self.lag]);
        }
    }
}

impl Default for Deviation {
    fn default() -> Self {
        Self::NONE
    }
}

fn one() -> u8 {
    1
}

/// How the controller begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// Running.
    #[default]
    Armed,
    /// Self-test first; commands must arm it.
    Boot,
}

/// The monitor, or none.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(default)]
pub struct MonitorChoice {
    /// Whether it runs.
    pub enabled: bool,
    /// Its tolerances.
    #[serde(flatten)]
    pub parameters: MonitorParameters,
}

impl Default for MonitorChoice {
    fn default() -> Self {
        Self { enabled: true, parameters: MonitorParameters::default() }
    }
}

/// A reference from a time on: a position, or a program that the controller can run by itself.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceSegment {
    /// From when, s.
    pub at_s: f64,
    /// A constant position, m.
    pub position_m: Option<f64>,
    /// A program.
    pub program: Option<ProgramParameters>,
}

/// An operator command at a time.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScheduledCommand {
    /// When, s.
    pub at_s: f64,
    /// Which.
    pub command: OperatorCommand,
}

/// Bounds on the outcome; each one given is checked.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Expect {
    /// The state's word at the end.
    pub end_state: Option<String>,
    /// The end state is one of these.
    pub end_state_one_of: Vec<String>,
    /// Longest time from the first fault to the safe state, s.
    pub caught_within_s: Option<f64>,
    /// Furthest the piston may go, after the first fault, outside the span of where it was and where it was sent, m.
    pub max_excursion_m: Option<f64>,
    /// Largest |position − reference| in the last 10 % of the time, m.
    pub final_error_below_m: Option<f64>,
    /// And not smaller than this: an unexplained improvement is a finding too, m.
    pub final_error_above_m: Option<f64>,
    /// Furthest beyond the last reference, seen from the start, m.
    pub max_overshoot_m: Option<f64>,
    /// At least this far beyond, m.
    pub min_overshoot_m: Option<f64>,
}

impl Scenario {
    /// Reads and checks a scenario file.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, has an unknown key, or asks for what cannot be.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let folder = path.parent().unwrap_or(Path::new("."));
        Self::parse(&read_text(path)?, &path.display().to_string(), folder)
    }

    /// Parses the text of a scenario; `file` is what errors call it, `folder` where rig files are sought.
    ///
    /// # Errors
    /// As [`Scenario::read`].
    pub fn parse(text: &str, file: &str, folder: &Path) -> Result<Self, InputError> {
        let mut scenario: Self = toml::from_str(text).map_err(|error| {
            let line = error.span().map(|span| 1 + text[..span.start.min(text.len())].matches('\n').count() as u64);
            let located = InputError::new(file, error.message().to_string(), "correct or remove the key");
            line.map_or(located.clone(), |line| located.at_line(line))
        })?;
        scenario.folder = folder.to_path_buf();
        let bad = |problem: String, remedy: &str| Err(InputError::new(file, problem, remedy));
        if !(scenario.duration_s > 0.0 && scenario.duration_s <= 36_000.0) {
            return bad(format!("`duration_s` = {} ", scenario.duration_s), "give a time from 0 to 36000 (seconds)");
        }
        if scenario.dump_valve_s.is_some_and(|time_constant| time_constant.is_nan() || time_constant <= 0.0) {
            return bad("`dump_valve_s` must be positive".into(), "give a time constant in seconds");
        }
        if scenario.tick_hz.is_some_and(|hz| !(50..=20_000).contains(&hz)) {
            return bad("`tick_hz` is out of range".into(), "give 50 to 20000 (ticks per second)");
        }
        if scenario.reference.windows(2).any(|pair| pair[0].at_s > pair[1].at_s) {
            return bad("the references are not in the order of time".into(), "sort them by `at_s`");
        }
        for segment in &scenario.reference {
            if segment.position_m.is_some() == segment.program.is_some() {
                let problem = format!("the reference at {} s must be one thing", segment.at_s);
                return bad(problem, "give either `position_m` or `program`");
            }
        }
        for fault in &scenario.fault {
            if fault.kind.is_sensor() != fault.channel.is_some() {
                return bad(
                    format!("the fault {:?} at {} s and its `channel` do not fit", fault.kind, fault.at_s),
                    "sensor faults name a `channel`, other faults do not",
                );
            }
        }
        scenario.rig_file()?;
        let parameters = scenario.parameters(file)?;
        control::Config::from_parameters(&parameters)
            .map_err(|error| InputError::new(file, format!("`control.{error}`"), "correct the value"))?;
        Ok(scenario)
    }

    /// The rig with the scenario's dead zone and effects.
    ///
    /// # Errors
    /// An unknown effect or parameter, or a rig file that cannot be read.
    pub fn rig_file(&self) -> Result<RigFile, InputError> {
        let mut rig = rig::find(&self.rig, &self.folder)?;
        rig.io.tick_hz = self.tick_hz.unwrap_or(rig.io.tick_hz);
        if let Some(half) = self.dead_zone_v {
            (rig.rig.valve.dead_zone_right_v, rig.rig.valve.dead_zone_left_v) = (half, -half);
        }
        for (id, values) in &self.effects {
            let Some(effect) = Effect::from_id(id) else {
                return Err(InputError::new(
                    &self.name,
                    format!("unknown effect `{id}`"),
                    "see docs for the catalogue",
                ));
            };
            let mut ordered = Vec::new();
            for info in effect.info().parameters {
                let Some(value) = values.get(info.name) else {
                    let problem = format!("effect `{id}` lacks `{}`", info.name);
                    return Err(InputError::new(&self.name, problem, "add it"));
                };
                ordered.push(*value);
            }
            if values.len() != ordered.len() {
                let problem = format!("effect `{id}` has a parameter it does not know");
                return Err(InputError::new(&self.name, problem, "remove it"));
            }
            rig.effects.set(effect, &ordered);
        }
        Ok(rig)
    }

    /// The controller's parameters: made for the rig, then changed as the scenario says.
    ///
    /// # Errors
    /// A key in `[control]` that is no parameter.
    pub fn parameters(&self, file: &str) -> Result<Parameters, InputError> {
        let made = rig::parameters(&self.rig_file()?);
        let wrong = |problem: String| InputError::new(file, problem, "see control::Parameters for keys and types");
        let mut table = toml::Table::try_from(&made).map_err(|error| wrong(error.to_string()))?;
        // As in a controller file: a gain without a law means the paper's.
        if self.control.contains_key("gain_v_per_m") {
            table.insert("law".into(), toml::Value::String(control::LawChoice::Paper.word().into()));
        }
        table.extend(self.control.clone());
        table.try_into().map_err(|error: toml::de::Error| wrong(format!("[control]: {}", error.message())))
    }
}
