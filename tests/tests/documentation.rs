//! The controller's page lists every parameter, and nothing that is none.

use control::Parameters;

#[test]
fn the_controller_page_names_every_parameter_once() {
    let page = include_str!("../../docs/controller.md");
    let full = Parameters {
        setpoint_range_m: Some([0.0, 0.1]),
        setpoint_velocity_m_per_s: Some(1.0),
        setpoint_acceleration_m_per_s2: Some(1.0),
        dead_zone_blend_v: Some(0.01),
        safe_voltage_v: Some(0.0),
        command_time_out_s: Some(1.0),
        ..Parameters::default()
    };
    let mut keys: Vec<String> = toml::Table::try_from(&full).unwrap().keys().cloned().collect();
    let mut listed: Vec<String> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split_once("` |").map(|(key, _)| key.to_owned()))
        .collect();
    keys.sort();
    listed.sort();
    assert_eq!(listed, keys);
}

#[test]
fn the_controller_page_states_the_defaults_in_force() {
    let page = include_str!("../../docs/controller.md");
    let defaults = toml::Table::try_from(Parameters::default()).unwrap();
    for line in page.lines().filter_map(|line| line.strip_prefix("| `")) {
        let cells: Vec<&str> = line.split(" | ").map(str::trim).collect();
        let (key, stated) = (cells[0].trim_end_matches('`'), cells[cells.len() - 2]);
        let Some(value) = defaults.get(key) else {
            assert!(
                stated == "absent" || stated == "position range",
                "{key} has no default but the page says {stated}"
            );
            continue;
        };
        let numbers: Vec<f64> = match value {
            toml::Value::Array(pair) => pair.iter().filter_map(toml::Value::as_float).collect(),
            toml::Value::Float(number) => vec![*number],
            toml::Value::Integer(number) => vec![*number as f64],
            toml::Value::Boolean(flag) => {
                assert_eq!(stated, flag.to_string(), "{key}");
                continue;
            }
            other => panic!("{key} is {other}"),
        };
        let on_page: Vec<f64> =
            stated.trim_matches(['[', ']']).split(", ").map(|number| number.parse().expect(stated)).collect();
        assert_eq!(numbers.len(), on_page.len(), "{key}");
        for (a, b) in numbers.iter().zip(on_page) {
            assert!((a - b).abs() <= 1e-6 * b.abs(), "{key}: {a}, the page says {b}");
        }
    }
}
