//! A table of malformed rig files: each gives one error that names the line or key and the remedy.

use plant_model::Effect;
use rig_files::RigFile;

/// What to replace in a good rig file, by what, and the words the error must contain.
/// The last line of a good rig file.
const END: &str = "default = 0.02";

const BAD: &[(&str, &str, &[&str])] = &[
    ("mass_kg = 10.125", "mass_kg = -3.0", &["line 28", "load.mass_kg", "-3", "kg"]),
    ("mass_kg = 10.125", "mass_kg = 0", &["line 28", "load.mass_kg"]),
    ("mass_kg = 10.125", "mass_kg = \"10 kg\"", &["line 28", "load.mass_kg", "10 kg", "without quotes"]),
    ("mass_kg = 10.125", "mass_kg = nan", &["line 28", "load.mass_kg", "finite"]),
    ("mass_kg = 10.125", "mass_kg = inf", &["line 28", "load.mass_kg", "finite"]),
    ("mass_kg = 10.125", "mass_kg = 1e999", &["line 28", "load.mass_kg", "finite"]),
    ("mass_kg = 10.125", "mass_kg = [1.0]", &["line 28", "load.mass_kg", "number but is an array"]),
    ("mass_kg = 10.125", "mass_kg = true", &["line 28", "load.mass_kg", "is a boolean"]),
    ("mass_kg = 10.125", "mass_kg = { kg = 10.0 }", &["line 28", "load.mass_kg", "is a table"]),
    ("mass_kg = 10.125", "mass_kg = -1e300", &["line 28", "`load.mass_kg` = -1e300 is not plausible"]),
    ("tick_hz = 1000", "tick_hz = 1e300", &["io.tick_hz", "= 1e300 must be a whole number"]),
    ("default = 0.02", "default = 1e300", &["tolerance.default", "= 1e300 must"]),
    (
        "position_range_m = [-0.5, 0.5]",
        "position_range_m = [1e300, -1e300]",
        &["io.position_range_m", "[1e300, -1e300] is no range"],
    ),
    (END, "default = 0.02\n[effects.valve-lag]\ntime_constant_s = 1e300", &["= 1e300 must lie from 0 to 0.2"]),
    ("mass_kg = 10.125", "mass_g = 10125.0", &["line 28", "load.mass_g", "did you mean `mass_kg`"]),
    ("mass_kg = 10.125", "", &["load.mass_kg", "missing", "[load]"]),
    ("mass_kg = 10.125", "mass_kg = 10.125\nmass_kg = 3.0", &["line 29", "duplicate"]),
    ("mass_kg = 10.125", "mass_kg = ", &["line 28", "TOML"]),
    ("mass_kg = 10.125", "area_m2 = 1.0", &["line 28", "load.area_m2", "[cylinder]"]),
    ("[load]", "[lode]", &["line 27", "lode", "did you mean `load`"]),
    ("[load]\nmass_kg = 10.125", "[io]\nload = 3\n#", &["duplicate", "[io]"]),
    ("pressure_pa = 700000.0", "pressure_pa = 7.0", &["supply.pressure_pa", "Pa"]),
    ("pressure_pa = 700000.0", "pressure_pa = 90000.0", &["line 9", "supply.pressure_pa", "atmosphere"]),
    ("dead_zone_left_v = 0.0", "dead_zone_left_v = 0.5", &["valve.dead_zone_left_v", "dead_zone_right_v"]),
    ("static_n = 24.0", "static_n = 20.0", &["friction.static_n", "coulomb_n"]),
    ("breakaway_m = 3.234e-5", "breakaway_m = 1e-3", &["friction.breakaway_m", "stiffness"]),
    ("area_m2 = 0.000491", "area_m2 = 4.91", &["cylinder.area_m2", "m2"]),
    ("adc_bits = 16", "adc_bits = 17", &["io.adc_bits", "1 to 16"]),
    ("adc_bits = 16", "adc_bits = 12.5", &["io.adc_bits", "whole"]),
    ("adc_bits = 16", "adc_bit = 16", &["io.adc_bit", "did you mean `adc_bits`"]),
    ("tick_hz = 1000", "tick_hz = 0", &["io.tick_hz", "1 to 100000"]),
    ("position_range_m = [-0.5, 0.5]", "position_range_m = [0.5, -0.5]", &["io.position_range_m", "lower end first"]),
    ("position_range_m = [-0.5, 0.5]", "position_range_m = [0.5]", &["io.position_range_m", "2 numbers"]),
    ("position_range_m = [-0.5, 0.5]", "position_range_m = 0.5", &["io.position_range_m", "2 numbers"]),
    ("position_range_m = [-0.5, 0.5]", "position_range_m = [\"a\", 1]", &["io.position_range_m", "the text"]),
    ("default = 0.02", "default = 2", &["tolerance.default", "0.02"]),
    ("default = 0.02", "default = -0.1", &["tolerance.default"]),
    ("default = 0.02", "mas_kg = 0.1", &["tolerance.mas_kg", "did you mean `mass_kg`"]),
    ("default = 0.02", "load.mas_kg = 0.1", &["tolerance.load.mas_kg", "did you mean `mass_kg`"]),
    ("default = 0.02", "zzz = 0.1", &["tolerance.zzz", "remove it"]),
    (
        END,
        "default = 0.02\n[effects.leak-cross]\nx = 1",
        &["line 49", "effects.leak-cross", "did you mean `leak-cross-piston`"],
    ),
    (END, "default = 0.02\n[effects.valve-lag]\ntau = 1", &["line 50", "effects.valve-lag.tau", "time_constant_s"]),
    (
        END,
        "default = 0.02\n[effects.valve-lag]\ntime_constant_s = -1",
        &["line 50", "time_constant_s", "= -1 must lie from 0"],
    ),
    (END, "default = 0.02\n[effects.valve-lag]\ntime_constant_s = \"1\"", &["line 50", "time_constant_s", "number"]),
    (END, "default = 0.02\n[effects.valve-lag]", &["line 49", "effects.valve-lag", "no parameter"]),
    (
        END,
        "default = 0.02\n[effects.line-delay]\ndelay_s = -0.001",
        &["line 49", "effects.line-delay.delay_s", "= -0.001 must not be negative where no hose delays"],
    ),
    ("slope_right", "spool_inertia = 0.4\nslope_right", &["line 17", "valve.spool_inertia", "[effects.valve-lag]"]),
    ("slope_right", "spool_inertia = 2.5\nslope_right", &["line 17", "valve.spool_inertia", "2.5", "0 to 2"]),
    ("slope_right", "opening_smoothness = 0.4\nslope_right", &["line 17", "valve.opening_smoothness", "`opening`"]),
    (
        "slope_right",
        "corner_rounding_v = -0.1\nslope_right",
        &["line 17", "valve.corner_rounding_v", "-0.1", "0 to 1000"],
    ),
    (END, "default = 0.02\n[effects]\nvalve-lag = 3", &["line 50", "effects.valve-lag", "must be a table"]),
    ("name = \"paper case (a)\"", "name = 7", &["name", "quotes"]),
    ("name = \"paper case (a)\"", "nam = \"x\"", &["line 1", "nam", "did you mean `name`"]),
];

#[test]
fn every_malformed_rig_gives_one_error_that_names_place_and_remedy() {
    let good = RigFile::paper_a().to_toml();
    for (from, to, words) in BAD {
        assert!(good.contains(from), "the table is out of date: {from}\n{good}");
        let bad = good.replacen(from, to, 1);
        let error = RigFile::parse(&bad, "rigs/bad.toml").expect_err(to).to_string();
        assert!(error.starts_with("rigs/bad.toml"), "{to}: {error}");
        assert_eq!(error.lines().count(), 1, "{to}: {error}");
        assert!(error.contains("; "), "{to} has no remedy: {error}");
        for word in *words {
            assert!(error.contains(word), "{to}: expected {word:?} in: {error}");
        }
    }
}

#[test]
fn the_known_tables_are_listed_once() {
    let error = RigFile::parse(&(RigFile::paper_a().to_toml() + "[bar]\nx = 1\n"), "r.toml").expect_err("unknown");
    let (_, known) = error.remedy.split_once("known here: ").expect("a list");
    let mut words: Vec<&str> = known.split(", ").collect();
    assert!(words.contains(&"gas") && words.contains(&"effects"), "{known}");
    let listed = words.len();
    words.sort_unstable();
    words.dedup();
    assert_eq!(words.len(), listed, "{known}");
}

#[test]
fn a_missing_folder_an_empty_file_and_a_binary_one_are_told_apart() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let read = |name: &str, bytes: Option<&[u8]>| {
        let path = folder.path().join(name);
        if let Some(bytes) = bytes {
            std::fs::write(&path, bytes).expect("writable");
        }
        RigFile::read(&path).expect_err(name).to_string()
    };
    assert!(read("none.toml", None).contains("check the path"));
    assert!(read("empty.toml", Some(b" \n")).contains("is empty"));
    assert!(read("utf16.toml", Some(b"\xFF\xFEn\0a\0")).contains("UTF-16"));
    assert!(read("latin1.toml", Some(b"# a\n# m\xB2\n")).contains("line 2: is not UTF-8"));
    assert!(RigFile::read(folder.path()).expect_err("a folder").to_string().contains("name a file"));
}

#[test]
fn absent_optional_tables_mean_the_documented_defaults() {
    let text = RigFile::paper_b().to_toml();
    let mandatory = &text[..text.find("[io]").expect("written")];
    let rig = RigFile::parse(&mandatory.replace("name = \"paper case (b)\"\n", ""), "rigs/press.toml").expect("good");
    assert_eq!(rig, RigFile { name: "press".into(), ..RigFile::paper_b() });
    assert_eq!(rig.tolerance.of("load.mass_kg"), 0.02);
}

#[test]
fn tolerances_are_found_by_plain_and_by_full_key() {
    let text = RigFile::paper_a().to_toml() + "mass_kg = 0.005\ncylinder.area_m2 = 0.0\n\"gas.temperature_k\" = 0.01\n";
    let tolerance = RigFile::parse(&text, "r.toml").expect("good").tolerance;
    assert_eq!((tolerance.of("mass_kg"), tolerance.of("load.mass_kg")), (0.005, 0.005));
    assert_eq!((tolerance.of("area_m2"), tolerance.of("gas.temperature_k")), (0.0, 0.01));
    assert_eq!(tolerance.of("friction.coulomb_n"), 0.02);
}

#[test]
fn a_stated_effect_has_a_tolerance_of_its_own() {
    let effects = "effects.valve-lag.time_constant_s = 0.3\n\n[effects.valve-lag]\ntime_constant_s = 0.002\n";
    let rig = RigFile::parse(&(RigFile::paper_a().to_toml() + effects), "r.toml").expect("good");
    assert_eq!(rig.tolerance.of_effect(Effect::ValveLag, 0), 0.3);
    assert_eq!(rig.tolerance.of_effect(Effect::ValveHysteresis, 0), 0.0);
    // Written and read again it is the same.
    assert_eq!(RigFile::parse(&rig.to_toml(), "r.toml").expect("good"), rig);
    let wrong = [("valve-lag.time_constant_s", "valve-log.time_constant_s", "did you mean `valve-lag`?")];
    for (right, wrong, remedy) in
        wrong.into_iter().chain([("time_constant_s", "time", "did you mean `time_constant_s`?")])
    {
        let text = RigFile::paper_a().to_toml() + &effects.replacen(right, wrong, 1);
        let error = RigFile::parse(&text, "r.toml").expect_err(wrong).to_string();
        assert!(error.contains(remedy) || error.contains("known here: time_constant_s"), "{error}");
    }
}
