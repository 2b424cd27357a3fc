//! The firmware's controller for a rig: its parameters from the rig file, overlaid by a controller file, and its model
//! monitor.

use control::{Config, ConfigError, Parameters};
use firmware_core::{MonitorSetup, Setup, SetupError};
use monitor::{MonitorError, MonitorParameters};
use plant_model::{Cylinder, Friction, Gas, Load, Plant, Rig, Supply, Valve};
use rig_files::{Document, InputError, RigFile, read_text};
use std::path::Path;

/// What the model monitor's verdict does: the board's parameter `monitor`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum MonitorAction {
    /// There is no monitor.
    Off,
    /// A contradiction is told; the controller runs on.
    Warn,
    /// A contradiction leads to the safe state, as on the board by default.
    #[default]
    Trip,
}

/// The firmware's loop for a controller's parameters, with the monitor that the board would have: it knows the nominal
/// values `model` and none of a rig's effects, and allows the board's default limits. `output_delay_ticks` is 1 on the board.
///
/// # Errors
/// The first parameter of controller, model or monitor that is out of range.
pub fn setup(
    parameters: &Parameters,
    model: &Rig<f64>,
    action: MonitorAction,
    output_delay_ticks: u8,
) -> Result<Setup, SetupError> {
    let monitor = match action {
        MonitorAction::Off => None,
        MonitorAction::Warn | MonitorAction::Trip => Some(MonitorSetup {
            plant: Plant::without_effects(&as_the_board_holds_it(model))
                .map_err(|error| SetupError::Monitor(MonitorError::from(error)))?,
            parameters: MonitorParameters::default(),
            trips: action == MonitorAction::Trip,
            output_delay_ticks,
        }),
    };
    // Telemetry is not sent here; a record that is due every tick costs nothing.
    Setup::new(parameters, monitor, 1)
}

/// The rig in single precision.
fn as_the_board_holds_it(rig: &Rig<f64>) -> Rig<f32> {
    let (g, s, v, c, f) = (&rig.gas, &rig.supply, &rig.valve, &rig.cylinder, &rig.friction);
    Rig {
        gas: Gas {
            gas_constant_j_per_kg_k: g.gas_constant_j_per_kg_k as f32,
            temperature_k: g.temperature_k as f32,
            heat_capacity_ratio: g.heat_capacity_ratio as f32,
        },
        supply: Supply { pressure_pa: s.pressure_pa as f32, atmosphere_pa: s.atmosphere_pa as f32 },
        valve: Valve {
            fill_coefficient_kg_per_s_pa: v.fill_coefficient_kg_per_s_pa as f32,
            exhaust_coefficient_kg_per_s_pa: v.exhaust_coefficient_kg_per_s_pa as f32,
            dead_zone_right_v: v.dead_zone_right_v as f32,
            dead_zone_left_v: v.dead_zone_left_v as f32,
            slope_right: v.slope_right as f32,
            slope_left: v.slope_left as f32,
            max_voltage_v: v.max_voltage_v as f32,
        },
        cylinder: Cylinder {
            area_m2: c.area_m2 as f32,
            stroke_m: c.stroke_m as f32,
            volume_a0_m3: c.volume_a0_m3 as f32,
            volume_b0_m3: c.volume_b0_m3 as f32,
        },
        load: Load { mass_kg: rig.load.mass_kg as f32 },
        friction: Friction {
            stiffness_n_per_m: f.stiffness_n_per_m as f32,
            damping_n_s_per_m: f.damping_n_s_per_m as f32,
            viscous_n_s_per_m: f.viscous_n_s_per_m as f32,
            coulomb_n: f.coulomb_n as f32,
            static_n: f.static_n as f32,
            stribeck_velocity_m_per_s: f.stribeck_velocity_m_per_s as f32,
            breakaway_m: f.breakaway_m as f32,
        },
    }
}

/// The parameters for a rig: its converters, its nominal dead zone and limits; everything else at the firmware's defaults
/// (proportional gain 4 V/m).
#[must_use]
pub fn parameters(rig: &RigFile) -> Parameters {
    let pair = |[low, high]: [f64; 2]| [low as f32, high as f32];
    let (io, valve, supply) = (&rig.io, &rig.rig.valve, &rig.rig.supply);
    let [p_low, p_high] = io.pressure_range_pa;
    Parameters {
        position_range_m: pair(io.position_range_m),
        pressure_range_pa: pair(io.pressure_range_pa),
        adc_bits: io.adc_bits as u8,
        valve_range_v: pair(io.valve_range_v),
        dac_bits: io.dac_bits as u8,
        tick_hz: io.tick_hz,
        dead_zone_right_v: valve.dead_zone_right_v as f32,
        dead_zone_left_v: valve.dead_zone_left_v as f32,
        slope_right: valve.slope_right as f32,
        slope_left: valve.slope_left as f32,
        max_voltage_v: valve.max_voltage_v as f32,
        // No chamber falls far below atmosphere, and the last hundredth of the range is the sensor's rail.
        pressure_limits_pa: [p_low.max(0.5 * supply.atmosphere_pa) as f32, (p_high - 0.01 * (p_high - p_low)) as f32],
        supply_minimum_pa: (0.571 * supply.pressure_pa) as f32,
        ..Parameters::default()
    }
}

/// Overlays a controller file (TOML, the keys of [`Parameters`]) on the parameters of a rig.
///
/// # Errors
/// The file cannot be read, has an unknown key or a value of the wrong type, or a value the controller refuses.
pub fn read_parameters(path: &Path, rig: &RigFile) -> Result<Parameters, InputError> {
    overlay(&read_text(path)?, &path.display().to_string(), parameters(rig))
}

/// [`read_parameters`] on text.
///
/// # Errors
/// As [`read_parameters`].
pub fn overlay(text: &str, file: &str, base: Parameters) -> Result<Parameters, InputError> {
    let document = Document::parse(text, file)?;
    let refused = |error: toml::ser::Error| InputError::new(file, format!("cannot be applied: {error}"), "report this");
    let mut table = toml::Table::try_from(&base).map_err(refused)?;
    let known = known_keys();
    let given: toml::Table = toml::from_str(text)
        .map_err(|error| InputError::new(file, format!("is not valid TOML: {}", error.message()), "correct it"))?;
    let mut parameters = base;
    let entries = document.entries();
    for entry in &entries {
        if !known.iter().any(|key| key == entry.name) {
            return Err(entry.unknown(known.iter().map(String::as_str)));
        }
        if let Some(value) = given.get(entry.name) {
            table.insert(entry.name.to_string(), value.clone());
        }
        parameters = table.clone().try_into().map_err(|error: toml::de::Error| {
            let problem = format!("has a value that does not fit: {}", error.message().replace('\n', " "));
            entry.error(problem, "see `docs/controller.md` for its type and unit")
        })?;
    }
    Config::from_parameters(&parameters).map_err(|error| {
        let place = entries.iter().find(|entry| entry.name == error.key);
        let problem = format!("= {} must {}", error.value, error.must);
        match place {
            Some(entry) => entry.error(problem, "correct the value"),
            None => config_error(file, &error),
        }
    })?;
    Ok(parameters)
}

/// The controller's refusal as an error about a file that led to it.
#[must_use]
pub fn config_error(file: &str, error: &ConfigError) -> InputError {
    let problem = format!("the controller refuses it: `{}` = {} must {}", error.key, error.value, error.must);
    InputError::new(file, problem, "correct the value in the rig file or in the controller file")
}

/// Every key of a controller file.
fn known_keys() -> Vec<String> {
    let full = Parameters {
        setpoint_range_m: Some([0.0, 0.1]),
        setpoint_velocity_m_per_s: Some(1.0),
        setpoint_acceleration_m_per_s2: Some(1.0),
        dead_zone_blend_v: Some(0.01),
        safe_voltage_v: Some(0.0),
        command_time_out_s: Some(1.0),
        ..Parameters::default()
    };
    toml::Table::try_from(&full).map(|table| table.keys().cloned().collect()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_rigs_get_the_firmwares_default_parameters() {
        let parameters = parameters(&RigFile::paper_a());
        let default = Parameters::default();
        assert_eq!(
            Parameters {
                supply_minimum_pa: default.supply_minimum_pa,
                pressure_limits_pa: default.pressure_limits_pa,
                ..parameters.clone()
            },
            default
        );
        assert!((parameters.supply_minimum_pa - 4.0e5).abs() < 1e3);
        assert!((parameters.pressure_limits_pa[1] - 9.9e5).abs() < 1.0);
    }

    #[test]
    fn a_controller_file_overrides_what_it_names_and_nothing_else() {
        let base = parameters(&RigFile::paper_a());
        let text = "gain_v_per_m = 12\ndead_zone_right_v = 0.42\ndead_zone_left_v = -0.42\nsafe_voltage_v = 0.1\n";
        let got = overlay(text, "c.toml", base.clone()).expect("good");
        let expected = Parameters {
            gain_v_per_m: 12.0,
            dead_zone_right_v: 0.42,
            dead_zone_left_v: -0.42,
            safe_voltage_v: Some(0.1),
            ..base
        };
        assert_eq!(got, expected);
    }

    #[test]
    fn a_malformed_controller_file_is_refused_with_line_key_and_remedy() {
        let cases: [(&str, &[&str]); 6] = [
            ("\ngian_v_per_m = 4", &["line 2", "gian_v_per_m", "did you mean `gain_v_per_m`"]),
            ("gain_v_per_m = \"4\"", &["line 1", "gain_v_per_m", "does not fit"]),
            ("gain_v_per_m = -4.0", &["line 1", "gain_v_per_m", "= -4 must be"]),
            ("gain_v_per_m = nan", &["line 1", "gain_v_per_m"]),
            ("dead_zone_left_v = 1.0", &["line 1", "dead_zone_left_v"]),
            ("gain_v_per_m = ", &["line 1", "TOML"]),
        ];
        for (text, words) in cases {
            let error = overlay(text, "c.toml", Parameters::default()).expect_err(text).to_string();
            for word in words {
                assert!(error.contains(word), "{text}: expected {word:?} in {error}");
            }
        }
    }
}
