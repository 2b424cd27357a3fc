//! The firmware's controller for a rig: its parameters from the rig file, overlaid by a controller file.

use crate::document::Document;
use crate::error::InputError;
use crate::rig_file::RigFile;
use crate::tuning::{self, Pneumatics, Rule};
use crate::write::read_text;
use control::{Config, ConfigError, Key, LawChoice, Parameters, Value};
use plant_model::{Rig, Short};
use std::path::Path;

/// The parameters that follow from a rig file; [`parameters`] leaves all others at the firmware's defaults.
pub const FROM_RIG: [Key; 51] = [
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
    Key::law,
    Key::servo_speed_m_per_s,
    Key::servo_acceleration_m_per_s2,
    Key::servo_jerk_m_per_s3,
    Key::servo_bandwidth_rad_per_s,
    Key::servo_observer_rad_per_s,
    Key::servo_area_m2_per_kg,
    Key::servo_length_a_m,
    Key::servo_length_b_m,
    Key::servo_fill_m_per_s,
    Key::servo_exhaust_m_per_s,
    Key::servo_heat_capacity_ratio,
    Key::servo_atmosphere_pa,
    Key::servo_supply_pa,
    Key::servo_rest_pa,
    Key::servo_bristle_per_s2,
    Key::servo_viscous_per_s,
    Key::servo_coulomb_m_per_s2,
    Key::servo_lag_s,
    Key::servo_delay_s,
    Key::servo_lead_s,
    Key::servo_stick_slip,
    Key::servo_area_b_m2_per_kg,
    Key::servo_fill_b_m_per_s,
    Key::servo_exhaust_b_m_per_s,
    Key::servo_rest_b_pa,
    Key::servo_fill_critical_ratio,
    Key::servo_exhaust_critical_ratio,
    Key::servo_opening_1_v,
    Key::servo_opening_2_v,
    Key::servo_opening_3_v,
    Key::servo_opening_4_v,
    Key::servo_opening_5_v,
    Key::servo_opening_6_v,
    Key::servo_opening_7_v,
    Key::servo_opening_8_v,
    Key::servo_opening_9_v,
    Key::servo_opening_10_v,
];

/// The parameters for a rig: its converters, its nominal dead zone and limits, and what the positioning law has to know of
/// it; everything else at the firmware's defaults (for the paper's law, a proportional gain of 4 V/m).
#[must_use]
pub fn parameters(rig: &RigFile) -> Parameters {
    positioning(rig, with_papers_law(rig))
}

/// The same with the paper's law, for what compares with the paper.
#[must_use]
pub fn papers_parameters(rig: &RigFile) -> Parameters {
    Parameters { law: LawChoice::Paper, ..parameters(rig) }
}

/// The positioning law's numbers: the rule's, and the rig's as they stand per moving mass and per area.
fn positioning(rig: &RigFile, base: Parameters) -> Parameters {
    let lag_s = tuning::lag_s(rig);
    let air = Pneumatics::of(&rig.rig);
    let rule = Rule::with(&rig.rig, &air, lag_s, rig.io.tick_s());
    let Rig { gas, supply, load, friction, .. } = &rig.rig;
    let mass = load.mass_kg;
    let [area, area_b] = air.areas_m2;
    let flow = |coefficients: [f64; 2], n: usize| {
        gas.gas_constant_j_per_kg_k * gas.temperature_k * coefficients[n] / air.areas_m2[n]
    };
    // A rig beyond the ranges gets their ends: the configuration, not this function, refuses.
    let within = |key: Key, value: f64| value.clamp(key.row().limits.low, key.row().limits.high) as f32;
    let on_side_b = |key: Key, [a, b]: [f64; 2]| (a != b).then(|| within(key, b));
    let knot = |n: usize| air.opening_v.map(|volts| within(Key::servo_opening_1_v, volts[n]));
    Parameters {
        // The positioning law moves the force by two driven chambers.
        law: if rig.rig.cylinder.is_single_acting() { LawChoice::Paper } else { LawChoice::Servo },
        servo_speed_m_per_s: within(Key::servo_speed_m_per_s, rule.speed),
        servo_acceleration_m_per_s2: within(Key::servo_acceleration_m_per_s2, rule.acceleration),
        servo_jerk_m_per_s3: within(Key::servo_jerk_m_per_s3, rule.jerk),
        servo_bandwidth_rad_per_s: within(Key::servo_bandwidth_rad_per_s, rule.law_w),
        servo_observer_rad_per_s: within(Key::servo_observer_rad_per_s, rule.observer_w),
        servo_area_m2_per_kg: within(Key::servo_area_m2_per_kg, area / mass),
        servo_length_a_m: within(Key::servo_length_a_m, air.volumes_m3[0] / area),
        servo_length_b_m: within(Key::servo_length_b_m, air.volumes_m3[1] / area_b),
        servo_fill_m_per_s: within(Key::servo_fill_m_per_s, flow(air.fill, 0)),
        servo_exhaust_m_per_s: within(Key::servo_exhaust_m_per_s, flow(air.exhaust, 0)),
        servo_area_b_m2_per_kg: on_side_b(Key::servo_area_b_m2_per_kg, [area, area_b].map(|area| area / mass)),
        servo_fill_b_m_per_s: on_side_b(Key::servo_fill_b_m_per_s, [0, 1].map(|n| flow(air.fill, n))),
        servo_exhaust_b_m_per_s: on_side_b(Key::servo_exhaust_b_m_per_s, [0, 1].map(|n| flow(air.exhaust, n))),
        servo_rest_b_pa: on_side_b(Key::servo_rest_b_pa, air.rest_pa),
        servo_fill_critical_ratio: air.critical.map(|[b, _]| within(Key::servo_fill_critical_ratio, b)),
        servo_exhaust_critical_ratio: air.critical.map(|[_, b]| within(Key::servo_exhaust_critical_ratio, b)),
        servo_opening_1_v: knot(0),
        servo_opening_2_v: knot(1),
        servo_opening_3_v: knot(2),
        servo_opening_4_v: knot(3),
        servo_opening_5_v: knot(4),
        servo_opening_6_v: knot(5),
        servo_opening_7_v: knot(6),
        servo_opening_8_v: knot(7),
        servo_opening_9_v: knot(8),
        servo_opening_10_v: knot(9),
        servo_lead_s: within(Key::servo_lead_s, rule.lead_s),
        servo_stick_slip: tuning::stick_slip(&rig.rig),
        servo_delay_s: within(Key::servo_delay_s, air.delay_s),
        servo_heat_capacity_ratio: within(Key::servo_heat_capacity_ratio, gas.heat_capacity_ratio),
        servo_atmosphere_pa: within(Key::servo_atmosphere_pa, supply.atmosphere_pa),
        servo_supply_pa: within(Key::servo_supply_pa, supply.pressure_pa),
        servo_rest_pa: within(Key::servo_rest_pa, air.rest_pa[0]),
        servo_bristle_per_s2: within(Key::servo_bristle_per_s2, tuning::STIFFER * friction.stiffness_n_per_m / mass),
        servo_viscous_per_s: within(Key::servo_viscous_per_s, friction.viscous_n_s_per_m / mass),
        servo_coulomb_m_per_s2: within(Key::servo_coulomb_m_per_s2, friction.coulomb_n / mass),
        servo_lag_s: within(Key::servo_lag_s, lag_s),
        ..base
    }
}

fn with_papers_law(rig: &RigFile) -> Parameters {
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
        // They are both connected or both not, and a chamber that breathes freely has none.
        pressure_sensors: !rig.rig.cylinder.is_single_acting(),
        ..Parameters::default()
    }
}

/// Overlays a controller file (TOML, the keys of [`Parameters`]) on the parameters of a rig.
///
/// # Errors
/// The file cannot be read, has an unknown key or a value of the wrong type, or a value the controller refuses.
pub fn read_parameters(path: &Path, rig: &RigFile) -> Result<Parameters, InputError> {
    let parameters = overlay(&read_text(path)?, &path.display().to_string(), parameters(rig))?;
    check_law(rig, &parameters, &path.display().to_string())?;
    Ok(parameters)
}

/// What a simulation takes from the rig file's `[io]`: sensors, converters and tick.
pub const OF_CONVERTERS: [Key; 6] =
    [Key::position_range_m, Key::pressure_range_pa, Key::adc_bits, Key::valve_range_v, Key::dac_bits, Key::tick_hz];

/// [`read_parameters`] for a simulation of the rig, whose sensors, converters and tick are the rig file's.
///
/// # Errors
/// As [`read_parameters`]; or the controller file wants others.
pub fn read_simulated_parameters(path: &Path, rig: &RigFile) -> Result<Parameters, InputError> {
    let (chosen, simulated) = (read_parameters(path, rig)?, parameters(rig));
    let Some(key) = OF_CONVERTERS.into_iter().find(|key| chosen.get(*key) != simulated.get(*key)) else {
        return Ok(chosen);
    };
    let (text, file) = (read_text(path)?, path.display().to_string());
    let problem = format!("= {} is not what the simulated rig has, {}", chosen.get(key), simulated.get(key));
    let remedy = format!("leave it out, or change `{}` under [io] of the rig file", key.row().key);
    let document = Document::parse(&text, &file)?;
    let entries = document.entries();
    Err(match entries.iter().find(|entry| entry.name == key.row().key) {
        Some(entry) => entry.error(problem, &remedy),
        None => InputError::new(file, format!("`{}` {problem}", key.row().key), remedy),
    })
}

/// Whether a law can hold a rig.
///
/// # Errors
/// The positioning law for a single-acting cylinder, which has one driven chamber.
pub fn check_law(rig: &RigFile, parameters: &Parameters, file: &str) -> Result<(), InputError> {
    if rig.rig.cylinder.is_single_acting() && parameters.law == LawChoice::Servo {
        return Err(InputError::new(
            file,
            "`law = \"servo\"` cannot hold a single-acting cylinder: it moves the force by two driven chambers",
            "write `law = \"paper\"` and a `gain_v_per_m`",
        ));
    }
    Ok(())
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
    // A gain is the paper's law's; a file that gives one and no law means that law.
    let gives = |key: Key| entries.iter().any(|entry| entry.name == key.row().key);
    if gives(Key::gain_v_per_m) && !gives(Key::law) {
        parameters.law = LawChoice::Paper;
        table.insert(Key::law.row().key.to_string(), toml::Value::String(LawChoice::Paper.word().into()));
    }
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
        let problem = format!("= {} must {}", Short(error.value), error.must);
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
    let problem = format!("the controller refuses it: `{}` = {} must {}", error.key, Short(error.value), error.must);
    InputError::new(file, problem, "correct the value in the rig file or in the controller file")
}

/// The words that a key of a controller file may be; `None` for a number.
#[must_use]
pub fn choices(key: Key) -> Option<String> {
    match key.default_value() {
        Value::Flag(_) => Some("true or false".to_string()),
        Value::Choice(_, words) => Some(words.join(" or ")),
        _ => None,
    }
}

/// Every key of a controller file with its unit, range and default, for `--help`.
#[must_use]
pub fn keys_help() -> String {
    let line = |key: Key| {
        let row = key.row();
        let range = choices(key).unwrap_or_else(|| match row.limits.pair {
            true => format!("two of {}", row.limits),
            false => row.limits.to_string(),
        });
        format!("  {:31} {range}, default {}\n", row.key, key.default_value())
    };
    "KEYS of a controller file (meanings: docs/controller.md)\n".to_string() + &Key::ALL.map(line).concat()
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::End;

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
        (rig.rig.supply.pressure_pa, rig.rig.supply.atmosphere_pa) = (6.0e5, 0.9e5);
        rig.effects.set(plant_model::Effect::ValveLag, &[2.0e-3]);
        (rig.rig.gas.heat_capacity_ratio, rig.rig.load.mass_kg) = (1.3, 5.0);
        (rig.rig.cylinder.area_a_m2, rig.rig.cylinder.area_b_m2) = (1.0e-3, 0.8e-3);
        let valve = &mut rig.rig.valve;
        (valve.fill_coefficient_kg_per_s_pa, valve.exhaust_coefficient_kg_per_s_pa) = (0.0, 0.0);
        (valve.fill_conductance_a_m3_per_s_pa, valve.fill_conductance_b_m3_per_s_pa) = (1.0e-8, 1.1e-8);
        (valve.exhaust_conductance_a_m3_per_s_pa, valve.exhaust_conductance_b_m3_per_s_pa) = (1.0e-8, 1.1e-8);
        (valve.fill_critical_ratio_a, valve.fill_critical_ratio_b) = (0.3, 0.3);
        (valve.exhaust_critical_ratio_a, valve.exhaust_critical_ratio_b) = (0.3, 0.3);
        (rig.rig.hoses.a_length_m, rig.rig.hoses.a_diameter_m) = (1.0, 4.0e-3);
        (rig.rig.friction.stiffness_n_per_m, rig.rig.friction.coulomb_n) = (1.0e5, 20.0);
        let valve = &mut rig.rig.valve;
        (valve.dead_zone_right_v, valve.dead_zone_left_v, valve.max_voltage_v) = (0.3, -0.2, 4.0);
        (valve.slope_right, valve.slope_left) = (1.1, 0.9);
        let (found, default) = (parameters(&rig), Parameters::default());
        for key in Key::ALL {
            assert_eq!(found.get(key) != default.get(key), FROM_RIG.contains(&key), "{}", key.row().key);
        }
    }

    #[test]
    fn a_single_acting_cylinder_gets_the_papers_law_and_no_other() {
        let mut rig = RigFile::paper_c();
        rig.rig.cylinder.spring_preload_n = 100.0;
        let chosen = parameters(&rig);
        assert_eq!((chosen.law, chosen.pressure_sensors), (LawChoice::Paper, false));
        assert_eq!(check_law(&rig, &chosen, "c.toml"), Ok(()));
        let servo = Parameters { law: LawChoice::Servo, ..chosen };
        let error = check_law(&rig, &servo, "c.toml").expect_err("one chamber is driven").to_string();
        assert!(error.starts_with("c.toml") && error.contains("law = \"paper\""), "{error}");
        assert_eq!(check_law(&RigFile::paper_c(), &servo, "c.toml"), Ok(()));
    }

    #[test]
    fn the_firmwares_default_parameters_are_those_of_the_papers_case_a_with_the_papers_law() {
        let (found, default) = (papers_parameters(&RigFile::paper_a()), Parameters::default());
        for key in Key::ALL {
            let (found, default) = (found.get(key), default.get(key));
            let close = (found.number(End::First) / default.number(End::First) - 1.0).abs() < 1e-5;
            assert!(found == default || close, "{} = {found}, by default {default}", key.row().key);
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
            // A gain without a law is the paper's law.
            law: LawChoice::Paper,
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
