//! The firmware's controller for a rig: its parameters from the rig file, overlaid by a controller file.

use crate::document::Document;
use crate::error::InputError;
use crate::rig_file::RigFile;
use crate::write::read_text;
use control::{Config, ConfigError, Key, Parameters, Value};
use std::path::Path;

/// The parameters that follow from a rig file; [`parameters`] leaves all others at the firmware's defaults.
pub const FROM_RIG: [Key; 13] = [
    Key::position_range_m,
    Key::pressure_range_pa,
    Key::adc_bits,
    Key::valve_range_v,
    Key::dac_bits,
    Key::tick_hz,
    Key::dead_zone_right_v,
    Key::dead_zone_left_v,
    Key::slope_right,
    Key::slope_left,
    Key::max_voltage_v,
    Key::pressure_limits_pa,
    Key::supply_minimum_pa,
];

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
        // The share that the default of 4 bar is of the paper's 7.
        supply_minimum_pa: (supply.pressure_pa * 4.0 / 7.0) as f32,
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
    let known = Key::ALL.map(|key| key.row().key);
    let given: toml::Table = toml::from_str(text)
        .map_err(|error| InputError::new(file, format!("is not valid TOML: {}", error.message()), "correct it"))?;
    let mut parameters = base;
    let entries = document.entries();
    for entry in &entries {
        if !known.contains(&entry.name) {
            return Err(entry.unknown(known));
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

/// Every key of a controller file with its unit, range and default, for `--help`.
#[must_use]
pub fn keys_help() -> String {
    let line = |key: Key| {
        let row = key.row();
        let range = match key.default_value() {
            Value::Flag(_) => "true or false".to_string(),
            _ if row.limits.pair => format!("two of {}", row.limits),
            _ => row.limits.to_string(),
        };
        format!("  {:31} {range}, default {}\n", row.key, key.default_value())
    };
    "KEYS of a controller file (meanings: docs/controller.md)\n".to_string() + &Key::ALL.map(line).concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parameters_that_follow_from_a_rig_are_those_that_change_with_it() {
        let mut rig = RigFile::paper_a();
        rig.io = crate::Io {
            position_range_m: [-0.2, 0.3],
            pressure_range_pa: [1.0e5, 1.1e6],
            adc_bits: 14,
            valve_range_v: [-6.0, 6.0],
            dac_bits: 10,
            tick_hz: 2000,
        };
        rig.rig.supply.pressure_pa = 6.0e5;
        let valve = &mut rig.rig.valve;
        (valve.dead_zone_right_v, valve.dead_zone_left_v, valve.max_voltage_v) = (0.3, -0.2, 4.0);
        (valve.slope_right, valve.slope_left) = (1.1, 0.9);
        let (found, default) = (parameters(&rig), Parameters::default());
        for key in Key::ALL {
            assert_eq!(found.get(key) != default.get(key), FROM_RIG.contains(&key), "{}", key.row().key);
        }
    }

    #[test]
    fn the_papers_rigs_get_the_firmwares_default_parameters() {
        for rig in [RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()] {
            assert_eq!(parameters(&rig), Parameters::default());
        }
    }

    #[test]
    fn the_help_lists_every_key_with_its_range_and_default() {
        let help = keys_help();
        for key in toml::Table::try_from(Parameters::default()).expect("a table").keys() {
            assert!(help.contains(&format!("  {key} ")), "{key}");
        }
        assert!(help.contains("gain_v_per_m                    0 to 10000 V/m, default 4\n"), "{help}");
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
