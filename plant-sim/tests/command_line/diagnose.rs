//! `plant-sim diagnose` and `plant-sim friction` do what the formats promise, and find what is in real recordings.

use crate::root;
use diagnosis::{OffCentre, friction_map};
use plant_sim::import::Mapping;
use rig_files::{Log, RigFile};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Output;

fn plant_sim(arguments: &[&str]) -> Output {
    crate::plant_sim(arguments, &root())
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).expect("written")).expect("JSON")
}

/// Every documented key, with its documented kind.
fn has_the_documented_shape(json: &Value) {
    let verdict = json["verdict"].as_str().expect("verdict");
    assert!(["no-gap", "explained", "partly-explained", "unexplained"].contains(&verdict), "{verdict}");
    for cause in json["causes"].as_array().expect("causes") {
        assert!(cause["id"].is_string() && cause["ties"].is_array() && cause["evidence"].is_string(), "{cause}");
        for parameter in cause["parameters"].as_array().expect("parameters") {
            assert!(parameter["name"].is_string() && parameter["value"].is_number(), "{parameter}");
            assert!(parameter.get("std_error").is_some(), "{parameter}");
        }
    }
    for value in json["calibration"].as_array().expect("calibration") {
        for key in ["name", "nominal", "value", "std_error"] {
            assert!(value.get(key).is_some(), "{value}");
        }
    }
    for error in ["baseline_rmse", "extended_rmse", "noise_floor"] {
        for channel in ["y_m", "p_a_pa", "p_b_pa"] {
            let value = json["gain"]["holdout"][error].get(channel).expect(channel);
            assert!(value.is_number() || value.is_null());
        }
    }
    assert!(json["gain"].get("horizon_s").is_some());
    assert!(json["not_identifiable"].is_array());
    let next = json.get("next_experiment").expect("next_experiment");
    assert!(next.is_string() || next.is_null());
}

#[test]
fn a_hidden_leak_is_named_and_the_extended_rig_runs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (log, out) = (folder.path().join("log.csv"), folder.path().join("out"));
    let effect = "leak-cross-piston:conductance_kg_per_s_pa=3e-10";
    let made = plant_sim(&[
        "synthesize",
        "--rig",
        "rigs/paper-a.toml",
        "--effect",
        effect,
        "--seed",
        "11",
        "--duration",
        "12",
        "--out",
        text(&log),
    ]);
    assert!(made.status.success());
    let done =
        plant_sim(&["diagnose", "--rig", "rigs/paper-a.toml", "--log", text(&log), "--out", text(&out), "--apply"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let said = String::from_utf8_lossy(&done.stdout);
    assert!(said.contains("Leak across the piston seal"), "{said}");

    let json = json(&out.join("diagnosis.json"));
    has_the_documented_shape(&json);
    assert_eq!(json["verdict"], "explained");
    assert_eq!(json["causes"][0]["id"], "leak-cross-piston");
    let value = json["causes"][0]["parameters"][0]["value"].as_f64().expect("a number");
    assert!((value / 3.0e-10 - 1.0).abs() < 0.1, "{value}");
    // The keys stand in the documented order, so that a person reads the verdict first.
    let raw = std::fs::read_to_string(out.join("diagnosis.json")).expect("written");
    let at = |key: &str| raw.find(key).expect(key);
    assert!(at("\"verdict\"") < at("\"causes\"") && at("\"causes\"") < at("\"calibration\""));

    let extended = RigFile::read(&out.join("extended-rig.toml")).expect("loads");
    assert!(extended.effects.get(plant_model::Effect::LeakCrossPiston).is_some());
    let rig = text(&out.join("extended-rig.toml")).to_string();
    let simulated = plant_sim(&[
        "simulate",
        "--rig",
        &rig,
        "--input",
        "examples/inputs/steps-and-sine.csv",
        "--out",
        text(&folder.path().join("o.csv")),
    ]);
    assert!(simulated.status.success());

    // The controller of the extended rig is the positioning law, and holds a step within 0.1 mm.
    let controller = text(&out.join("controller.toml")).to_string();
    let at = text(&folder.path().join("run")).to_string();
    let run = plant_sim(&["run", "--rig", &rig, "--config", &controller, "--duration", "2", "--out", &at]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let told = std::fs::read_to_string(&controller).expect("written");
    assert!(told.contains("law = \"servo\"") && !told.contains("tick_hz"), "{told}");
    let rows =
        said.lines().skip_while(|line| !line.contains("settled to 0.1 mm")).filter(|line| line.contains("positioning"));
    assert_eq!(rows.filter(|line| !line.contains('–')).count(), 2, "{said}");

    let report = std::fs::read_to_string(out.join("report.html")).expect("written");
    for word in
        ["The gap is explained", "noise alone", "share of the gap closed", "What this log cannot tell", "Appendix"]
    {
        assert!(report.contains(word), "{word}");
    }
    for reference in ["src=", "href=", "@import"] {
        assert!(!report.contains(reference), "{reference}");
    }
}

#[test]
fn bad_input_gives_one_clear_error_status_2_and_no_output() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let head = "t_s,u_v,y_m,p_a_pa,p_b_pa\n";
    let short = format!("{head}0,0,0,3e5,3e5\n0.001,0,0,3e5,3e5\n");
    let mut no_balance = "t_s,y_m,y_ref_m\n".to_string();
    for k in 0..8000 {
        let _ = writeln!(no_balance, "{},{},0", f64::from(k) * 1e-3, f64::from(k) * 1e-5);
    }
    let cases: [(&str, String, &[&str]); 7] = [
        ("too short", short, &["log.csv", "200"]),
        ("no balance", no_balance, &["log.csv", "u_v"]),
        ("empty", String::new(), &["log.csv", "empty"]),
        ("text in a number", format!("{head}0,0,0,x,3e5\n"), &["log.csv", "line 2", "p_a_pa"]),
        ("time backwards", format!("{head}0,0,0,3e5,3e5\n-1,0,0,3e5,3e5\n"), &["log.csv", "line 3"]),
        ("unknown column", "t_s,y_m,pressure\n0,0,0\n".into(), &["log.csv", "pressure"]),
        ("no position", "t_s,u_v\n0,0\n".into(), &["log.csv", "y_m"]),
    ];
    for (name, text_of_log, words) in cases {
        let (log, out) = (folder.path().join("log.csv"), folder.path().join("out"));
        std::fs::write(&log, text_of_log).expect("written");
        let done = plant_sim(&["diagnose", "--rig", "rigs/paper-a.toml", "--log", text(&log), "--out", text(&out)]);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(2), "{name}: {said}");
        assert_eq!(said.matches("error:").count(), 1, "{name}: {said}");
        for word in words {
            assert!(said.contains(word), "{name}: expected {word:?} in {said}");
        }
        assert!(!out.exists(), "{name}: no half-written output");
    }
    let missing = plant_sim(&["diagnose", "--rig", "nowhere.toml", "--log", "nowhere.csv", "--out", "out/never"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(!root().join("out/never").exists());
}

#[test]
fn one_pressure_and_the_position_of_the_vertical_cylinder_tell_gravity_and_nothing_more() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("out");
    let done = plant_sim(&[
        "diagnose",
        "--rig",
        "examples/rigs/cylinder-vertical.toml",
        "--map",
        "examples/mappings/cylinder-vertical.toml",
        "--log",
        "examples/data/cylinder-vertical/strokes.csv",
        "--out",
        text(&out),
    ]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let json = json(&out.join("diagnosis.json"));
    has_the_documented_shape(&json);
    assert_eq!(json["verdict"], "partly-explained");
    let causes = json["causes"].as_array().expect("causes");
    assert_eq!(causes.len(), 1);
    assert_eq!(causes[0]["id"], "constant-force");
    assert_eq!(causes[0]["ties"], serde_json::json!(["friction-asymmetry"]));
    let value = causes[0]["parameters"][0]["value"].as_f64().expect("a number");
    let error = causes[0]["parameters"][0]["std_error"].as_f64().expect("a number");
    // 1.469 kg weigh 14.4 N; too small an error would be as wrong as too large a one.
    assert!((value - 14.41).abs() < 2.0 * error && (1.0..4.0).contains(&error), "{value} ± {error}");
    RigFile::read(&out.join("extended-rig.toml")).expect("loads");
}

fn recordings(numbers: impl IntoIterator<Item = u32>) -> Vec<Log> {
    let mapping = Mapping::read(&root().join("examples/mappings/piston-friction.toml")).expect("a mapping");
    let folder = root().join("examples/data/piston-friction");
    let read = |n| mapping.convert_file(&folder.join(format!("circle_{n}bar.csv"))).expect("a recording");
    numbers.into_iter().map(read).collect()
}

#[test]
fn the_piston_recordings_show_friction_that_grows_with_pressure_differs_by_direction_and_ripples() {
    let rig = RigFile::read(&root().join("examples/rigs/piston-friction.toml")).expect("a rig");
    let logs = recordings(1..=7);
    let map = friction_map(&rig, &logs.iter().collect::<Vec<_>>()).expect("a map");
    let per_bar = map.pressure_n_per_pa.value * 1e5;
    assert!(map.pressure_n_per_pa.established && (0.6..1.0).contains(&per_bar), "{per_bar}");
    assert!((2.5..4.5).contains(&map.friction_n.value), "{:?}", map.friction_n);
    assert_eq!((map.off_centre, map.off_centre_ties.as_slice()), (Some(OffCentre::Direction), &[OffCentre::Area][..]));
    assert!((-0.6..-0.3).contains(&map.asymmetry.value), "{:?}", map.asymmetry);
    assert!((0.008..0.02).contains(&map.area_error.value), "{:?}", map.area_error);
    assert!(!map.speed_n_s_per_m.established, "{:?}", map.speed_n_s_per_m);
    let line = map.ripple.expect("a ripple");
    assert!((2.9e-3..3.15e-3).contains(&line.wavelength_m), "{line:?}");
    assert!((0.1..0.25).contains(&line.amplitude_n), "{line:?}");
    assert!(!line.turns_with_motion);
    let error = |model: &str| map.stages.iter().find(|stage| stage.model.contains(model)).expect(model).holdout_rmse_n;
    assert!(error("pressure") < 0.9 * error("constant friction") && error("direction") < 0.8 * error("pressure"));
    assert!(error("ripple") > 1.5, "the scatter between the runs stays: {:?}", map.stages);
}

#[test]
fn two_recordings_establish_nothing() {
    let rig = RigFile::read(&root().join("examples/rigs/piston-friction.toml")).expect("a rig");
    let logs = recordings([1, 7]);
    let map = friction_map(&rig, &logs.iter().collect::<Vec<_>>()).expect("a map");
    assert!(!map.pressure_n_per_pa.established && map.off_centre.is_none());
    assert!(map.stages.iter().skip(1).all(|stage| !stage.kept || stage.model.contains("ripple")), "{:?}", map.stages);
}

/// Slow strokes with friction `(f0 + k p) (1 + asymmetry sign v)`, a friction ripple of `ripple` at `wavelength`, noise of
/// `scatter` from run to run.
fn made(rig: &RigFile, p_bar: f64, law: [f64; 4], wavelength_m: f64, scatter_n: f64) -> Log {
    let [f0, per_bar, asymmetry, ripple] = law;
    let (mut t_s, mut y_m, mut p_a, mut f) = (vec![], vec![], vec![], vec![]);
    let mut noise: u64 = 0x9E37_79B9 + (p_bar * 1e3) as u64;
    let mut uniform = move || {
        noise ^= noise << 13;
        noise ^= noise >> 7;
        noise ^= noise << 17;
        (noise >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let own = scatter_n * 3.46 * uniform();
    for k in 0..6000 {
        let t = f64::from(k) * 0.01;
        // A triangle of 6 s over ±20 mm.
        let phase = (t / 6.0).fract();
        let (y, s) = if phase < 0.5 { (phase * 0.08 - 0.02, 1.0) } else { (0.06 - phase * 0.08, -1.0) };
        let wave = ripple * (core::f64::consts::TAU * y / wavelength_m + p_bar).sin();
        let friction = (f0 + per_bar * p_bar + own + wave) * (1.0 + asymmetry * s) * s;
        t_s.push(t);
        y_m.push(y + 1e-5 * uniform());
        p_a.push(rig.rig.supply.atmosphere_pa + p_bar * 1e5 + 200.0 * uniform());
        f.push(friction - rig.rig.cylinder.mean_area_m2() * p_bar * 1e5 + 0.3 * uniform());
    }
    Log { t_s, y_m, p_a_pa: Some(p_a), f_ext_n: Some(f), ..Log::default() }
}

#[test]
fn another_seal_gets_its_own_numbers() {
    let rig = RigFile::paper_a();
    let logs: Vec<Log> = [0.5, 2.0, 3.5, 5.0, 6.5].map(|p| made(&rig, p, [12.0, 1.7, 0.15, 0.8], 4.7e-3, 0.2)).into();
    let map = friction_map(&rig, &logs.iter().collect::<Vec<_>>()).expect("a map");
    assert!(map.pressure_n_per_pa.established);
    assert!((map.pressure_n_per_pa.value * 1e5 - 1.7).abs() < 0.15, "{:?}", map.pressure_n_per_pa);
    assert_eq!(map.off_centre, Some(OffCentre::Direction));
    assert!((map.asymmetry.value - 0.15).abs() < 0.03, "{:?}", map.asymmetry);
    let line = map.ripple.expect("a ripple");
    assert!((line.wavelength_m - 4.7e-3).abs() < line.resolution_m, "{line:?}");
    assert!((line.amplitude_n - 0.8).abs() < 0.15 && line.turns_with_motion, "{line:?}");
}

#[test]
fn a_plain_seal_shows_nothing() {
    let rig = RigFile::paper_a();
    let logs: Vec<Log> = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|p| made(&rig, p, [9.0, 0.0, 0.0, 0.0], 4e-3, 0.4)).into();
    let map = friction_map(&rig, &logs.iter().collect::<Vec<_>>()).expect("a map");
    assert!(!map.pressure_n_per_pa.established, "{:?}", map.pressure_n_per_pa);
    assert_eq!(map.off_centre, None);
    assert!(map.ripple.is_none(), "{:?}", map.ripple);
}

/// A log of a seal without dependences whose force and pressures tell of another area and of a constant force.
fn off_centre(p_bar: f64, area_error: f64, force_n: f64) -> Log {
    let rig = RigFile::paper_a();
    let mut log = made(&rig, p_bar, [9.0, 0.0, 0.0, 0.0], 4e-3, 0.2);
    for f in log.f_ext_n.as_mut().expect("a force") {
        *f += force_n - area_error * rig.rig.cylinder.mean_area_m2() * p_bar * 1e5;
    }
    log
}

#[test]
fn an_area_that_is_off_is_named_with_its_value_and_kept_in_the_table() {
    let rig = RigFile::paper_a();
    for (area_error, force_n, found) in [
        (0.03, 0.0, Some(OffCentre::Area)),
        // The offset changes its sign between the recordings, so that its mean is nothing.
        (-0.03, -0.03 * 3.5e5 * rig.rig.cylinder.mean_area_m2(), Some(OffCentre::AreaAndForce)),
        (0.0, 4.0, Some(OffCentre::ConstantForce)),
        (0.0, 0.0, None),
    ] {
        let logs: Vec<Log> = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0].map(|p| off_centre(p, area_error, force_n)).into();
        let map = friction_map(&rig, &logs.iter().collect::<Vec<_>>()).expect("a map");
        assert_eq!(map.off_centre, found, "{area_error} {force_n}: {:?}", map.stages);
        assert_eq!(map.area_error.established, area_error != 0.0);
        assert!(area_error == 0.0 || (map.area_error.value - area_error).abs() < 3.0 * map.area_error.std_error);
        assert!(force_n == 0.0 || (map.bias_n.value - force_n).abs() < 3.0 * map.bias_n.std_error);
        let kept = map.stages.iter().skip(3).filter(|stage| stage.kept).count();
        assert_eq!(kept, usize::from(found.is_some()), "the table says what the words say: {:?}", map.stages);
    }
}

#[test]
fn growth_with_speed_is_seen_inside_recordings_whose_speed_varies() {
    let rig = RigFile::paper_a();
    let logs: Vec<Log> = [1.0, 2.5, 4.0, 5.5]
        .map(|p| {
            let mut log = made(&rig, p, [9.0, 0.0, 0.0, 0.0], 4e-3, 0.2);
            // Every second period runs twice as slowly, so that friction that grows by 300 N s/m is 2 N less.
            let force = log.f_ext_n.as_mut().expect("a force");
            let (mut t, mut last) = (0.0, 0.0);
            for (time, force) in log.t_s.iter_mut().zip(force) {
                let slow = (*time / 6.0) as usize % 2 == 1;
                t += (*time - last) * if slow { 2.0 } else { 1.0 };
                last = *time;
                let towards = if (*time / 6.0).fract() < 0.5 { 1.0 } else { -1.0 };
                *force += towards * 300.0 * 0.04 / 3.0 * if slow { 0.5 } else { 1.0 };
                *time = t;
            }
            log
        })
        .into();
    let map = friction_map(&rig, &logs.iter().collect::<Vec<_>>()).expect("a map");
    assert!(map.speed_inside_recordings && map.speed_n_s_per_m.established, "{:?}", map.speed_n_s_per_m);
    assert!((map.speed_n_s_per_m.value - 300.0).abs() < 45.0, "{:?}", map.speed_n_s_per_m);
    assert!((map.friction_n.value - 9.0).abs() < 0.6, "{:?}", map.friction_n);
}

#[test]
fn friction_refuses_logs_without_force_and_names_them() {
    let done = plant_sim(&[
        "friction",
        "--rig",
        "examples/rigs/cylinder-vertical.toml",
        "--map",
        "examples/mappings/cylinder-vertical.toml",
        "--log",
        "examples/data/cylinder-vertical/strokes.csv",
        "--out",
        "out/never",
    ]);
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(2), "{said}");
    assert!(said.contains("strokes.csv") && said.contains("f_ext_n"), "{said}");
}

#[test]
fn a_simulated_log_without_noise_has_no_gap_and_shows_the_leak_it_was_made_with() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let leaky = folder.path().join("leaky.toml");
    let mut rig = std::fs::read_to_string("../rigs/paper-a.toml").expect("the paper's rig");
    rig.push_str("\n[effects.leak-chamber-a]\nconductance_kg_per_s_pa = 3.0e-10\n");
    std::fs::write(&leaky, rig).expect("a rig");
    for (made_with, verdict, causes) in
        [("rigs/paper-a.toml", "no-gap", vec![]), (text(&leaky), "explained", vec!["leak-chamber-a"])]
    {
        let (log, out) = (folder.path().join("log.csv"), folder.path().join("out"));
        let input = "examples/inputs/steps-and-sine.csv";
        let done = plant_sim(&["simulate", "--rig", made_with, "--input", input, "--out", text(&log)]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let done = plant_sim(&["diagnose", "--rig", "rigs/paper-a.toml", "--log", text(&log), "--out", text(&out)]);
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let json = json(&out.join("diagnosis.json"));
        assert_eq!(json["verdict"], verdict, "{made_with}");
        let named: Vec<_> = json["causes"].as_array().expect("causes").iter().map(|c| c["id"].clone()).collect();
        assert_eq!(named, causes, "{made_with}");
    }
}
