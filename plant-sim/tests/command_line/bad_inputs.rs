//! What a user gets wrong: every case ends with exit status 2, one error that names the place and the remedy, and no output.

use crate::{plant_sim, root};
use std::path::Path;

/// A folder with good and bad files.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("writable");
    let rig = std::fs::read_to_string(root().join("rigs/paper-a.toml")).expect("the rig file");
    put("rig.toml", rig.as_bytes());
    put("negative.toml", rig.replace("mass_kg = 10.125", "mass_kg = -10.125").as_bytes());
    put("unknown.toml", rig.replace("mass_kg", "mas_kg").as_bytes());
    put("bar.toml", rig.replace("pressure_pa = 7.0e5", "pressure_pa = 7.0").as_bytes());
    put("empty.toml", b"");
    put("input.csv", b"t_s,u_v\n0,1\n0.001,1\n0.002,0\n");
    put("text.csv", b"t_s,u_v\n0,1\n0.001,five\n");
    put("nan.csv", b"t_s,u_v\n0,1\n0.001,NaN\n");
    put("blank.csv", b"t_s,u_v\n0,1\n0.001,\n");
    put("backwards.csv", b"t_s,u_v\n0,1\n-0.001,1\n");
    put("no-u.csv", b"t_s,y_m\n0,1\n0.001,1\n");
    put("semicolon.csv", b"t_s;u_v\n0;1\n");
    put("utf16.csv", b"\xFF\xFEt\0_\0s\0,\0");
    put("empty.csv", b"");
    put("header.csv", b"t_s,u_v\n");
    put("log.csv", b"t_s,y_m,u_v\n0,0,0\n0.001,0,0\n");
    put("gain.toml", b"gain_v_per_m = -1\n");
    put("ticks.toml", b"tick_hz = 2000\n");
    put("table.txt", b"0 1.0 3\n10 1.1 3\n20 x 3\n");
    put("good.txt", b"0 1.0 3\n10 1.1 3\n");
    let map = "[source]\nseparator = \"space\"\nheader = false\natmosphere_pa = 1.013e5\n[column.t_s]\nfrom = 1\nunit = \"ms\"\n\
               [column.y_m]\nfrom = 2\nunit = \"mm\"\n[column.p_a_pa]\nfrom = 3\nunit = \"bar\"\ngauge = true\n";
    put("map.toml", map.as_bytes());
    put("huge.csv", b"t_s,y_m,u_v\n0,0,0\n0.001,1e300,0\n");
    put("map-unit.toml", map.replace("\"mm\"", "\"parsec\"").as_bytes());
    put("map-column.toml", map.replace("from = 3", "from = 4").as_bytes());
    put("map-name.toml", map.replace("from = 3", "from = \"p\"").as_bytes());
    put("map-key.toml", map.replace("gauge", "gage").as_bytes());
    put("map-target.toml", map.replace("p_a_pa", "p_c_pa").as_bytes());
    put("map-time.toml", map.replace("[column.t_s]\nfrom = 1\nunit = \"ms\"\n", "").as_bytes());
    put("map-atmosphere.toml", map.replace("atmosphere_pa = 1.013e5\n", "").as_bytes());
    put("map-separator.toml", map.replace("\"space\"", "\"pipe\"").as_bytes());
    put("map-source.toml", map.replace("from = 2\n", "").as_bytes());
    put("map-comma.toml", map.replace("\"space\"", "\"comma\"\ndecimal_comma = true").as_bytes());
    folder
}

type Case = (&'static str, &'static [&'static str]);

/// Arguments (separated by blanks), and words that the error must contain.
const CASES: &[Case] = &[
    ("simulate --rig none.toml --input input.csv --out o.csv", &["none.toml", "cannot be read", "check the path"]),
    ("simulate --rig negative.toml --input input.csv --out o.csv", &["negative.toml, line", "load.mass_kg", "-10.125"]),
    ("simulate --rig unknown.toml --input input.csv --out o.csv", &["load.mas_kg", "did you mean `mass_kg`"]),
    ("simulate --rig bar.toml --input input.csv --out o.csv", &["supply.pressure_pa", "unit"]),
    ("simulate --rig empty.toml --input input.csv --out o.csv", &["empty.toml", "is empty"]),
    ("simulate --rig input.csv --input input.csv --out o.csv", &["input.csv, line 1", "TOML"]),
    ("simulate --rig rig.toml --input none.csv --out o.csv", &["none.csv", "cannot be read"]),
    ("simulate --rig rig.toml --input text.csv --out o.csv", &["text.csv, line 3", "`u_v`", "five"]),
    ("simulate --rig rig.toml --input nan.csv --out o.csv", &["nan.csv, line 3", "`u_v`", "finite"]),
    ("simulate --rig rig.toml --input blank.csv --out o.csv", &["blank.csv, line 3", "`u_v` is blank"]),
    ("simulate --rig rig.toml --input backwards.csv --out o.csv", &["backwards.csv, line 3", "`t_s`", "sort"]),
    ("simulate --rig rig.toml --input no-u.csv --out o.csv", &["no-u.csv, line 1", "`u_v` is missing"]),
    ("simulate --rig rig.toml --input semicolon.csv --out o.csv", &["semicolon.csv, line 1", "commas"]),
    ("simulate --rig rig.toml --input utf16.csv --out o.csv", &["utf16.csv", "UTF-16"]),
    ("simulate --rig rig.toml --input empty.csv --out o.csv", &["empty.csv", "is empty"]),
    ("simulate --rig rig.toml --input header.csv --out o.csv", &["header.csv", "no data"]),
    ("simulate --rig rig.toml --input rig.toml --out o.csv", &["rig.toml, line"]),
    (
        "simulate --rig rig.toml --input input.csv --out rig.toml/o.csv",
        &["rig.toml/o.csv", "a part of the path is a file"],
    ),
    ("simulate --rig rig.toml --input input.csv --out o.csv --initial y=0", &["--initial", "did you mean `y_m`"]),
    ("simulate --rig rig.toml --input input.csv --out o.csv --initial y_m=45", &["--initial", "end stops", "0.5"]),
    ("simulate --rig rig.toml --input input.csv --out o.csv --initial p_a_pa=3.6", &["--initial", "1 bar is 1e5"]),
    ("simulate --rig rig.toml --input input.csv --out o.csv --initial z_m=1", &["--initial", "bristles"]),
    ("simulate --rig rig.toml --input input.csv --out o.csv --initial y_m=nan", &["--initial", "finite"]),
    ("simulate --rig rig.toml --input input.csv --out o.csv --initial y_m=0,y_m=0", &["--initial", "twice"]),
    ("simulate --rig rig.toml --input input.csv", &["--out"]),
    ("controller --rig rig.toml", &["--stdio"]),
    ("controller --rig negative.toml --stdio", &["negative.toml, line", "load.mass_kg"]),
    ("controller --rig rig.toml --config gain.toml --stdio", &["gain.toml, line 1", "gain_v_per_m", "-1"]),
    ("controller --rig rig.toml --config none.toml --stdio", &["none.toml", "cannot be read"]),
    ("run --rig none.toml --out o", &["none.toml", "check the path"]),
    ("run --rig rig.toml --target 45 --out o", &["--target"]),
    ("run --rig rig.toml --target 0.6 --out o", &["--target 0.6", "end stops"]),
    ("run --rig rig.toml --target 0 --out o", &["--target 0"]),
    ("run --rig rig.toml --duration -1 --out o", &["--duration"]),
    ("run --rig rig.toml --duration nan --out o", &["--duration"]),
    ("run --rig rig.toml --gain -4 --out o", &["gain"]),
    ("sweep --rig rig.toml --out o", &["--vary KEY=LOW:HIGH"]),
    ("sweep --rig rig.toml --vary load.mas_kg=1:2 --out o", &["did you mean `load.mass_kg`"]),
    ("sweep --rig rig.toml --vary mass_kg=2:1 --out o", &["lower end comes first"]),
    ("sweep --rig rig.toml --vary mass_kg=1 --out o", &["KEY=LOW:HIGH"]),
    ("sweep --rig rig.toml --vary mass_kg=1:2:0 --out o", &["KEY=LOW:HIGH"]),
    ("sweep --rig rig.toml --vary mass_kg=-1:1:3 --duration 0.1 --out o", &["load.mass_kg", "refused"]),
    ("sweep --rig rig.toml --vary mass_kg=1:2 --vary load.mass_kg=1:2 --out o", &["load.mass_kg twice"]),
    ("sweep --rig rig.toml --vary mass_kg=1:2:99999999 --out o", &["more than"]),
    ("sweep --rig rig.toml --samples 0 --out o", &["--samples 0"]),
    ("plot none.csv", &["none.csv", "cannot be read"]),
    ("plot input.csv", &["input.csv, line 1", "`y_m` is missing"]),
    ("import --map none.toml --from good.txt --out o.csv", &["none.toml", "cannot be read"]),
    ("import --map map.toml --from none.txt --out o.csv", &["none.txt", "cannot be read"]),
    ("import --map map.toml --from empty.csv --out o.csv", &["empty.csv", "is empty"]),
    ("import --map map.toml --from table.txt --out o.csv", &["table.txt, line 3", "column 2", "`x`"]),
    ("import --map map-unit.toml --from good.txt --out o.csv", &["map-unit.toml, line", "parsec", "mm"]),
    ("import --map map-column.toml --from good.txt --out o.csv", &["good.txt, line 1", "column 4"]),
    ("import --map map-name.toml --from good.txt --out o.csv", &["map-name.toml, line", "no header"]),
    ("import --map map-key.toml --from good.txt --out o.csv", &["column.p_a_pa.gage", "did you mean `gauge`"]),
    ("import --map map-target.toml --from good.txt --out o.csv", &["column.p_c_pa", "did you mean"]),
    ("import --map map-time.toml --from good.txt --out o.csv", &["`column.t_s` is missing", "[column.t_s]"]),
    ("import --map map-atmosphere.toml --from good.txt --out o.csv", &["column.p_a_pa.gauge", "atmosphere_pa"]),
    ("import --map map-separator.toml --from good.txt --out o.csv", &["source.separator", "pipe", "semicolon"]),
    ("import --map map-source.toml --from good.txt --out o.csv", &["column.y_m", "no source"]),
    ("import --map map-comma.toml --from good.txt --out o.csv", &["decimal_comma", "separator"]),
    ("import --map map.toml --out o.csv", &["--from"]),
    ("import --suggest good.txt --map map.toml", &["--map", "cannot be used"]),
    ("import --suggest good.txt --out map.toml", &["map.toml: is there already", "--out"]),
    ("import --suggest header.csv --out o.toml", &["header.csv", "no table of numbers"]),
    ("import --suggest none.csv --out o.toml", &["none.csv", "check the path"]),
    ("plot --map map.toml table.txt --out o.html", &["table.txt, line 3", "column 2", "`x`"]),
    // What is read is not written over.
    ("simulate --rig rig.toml --input input.csv --out input.csv", &["input.csv: is read", "another name"]),
    ("simulate --rig rig.toml --input input.csv --out ./rig.toml", &["./rig.toml: is read"]),
    ("import --map map.toml --from good.txt --out good.txt", &["good.txt: is read", "another name"]),
    ("import --map map.toml --from good.txt --out map.toml", &["map.toml: is read"]),
    ("plot log.csv --out log.csv", &["log.csv: is read"]),
    ("plot log.csv --rig rig.toml --svg rig.toml", &["rig.toml: is read"]),
    ("record --elf none --from log.csv --out log.csv", &["log.csv: is read"]),
    ("synthesize --rig rig.toml --out rig.toml", &["rig.toml: is read"]),
    ("experiment --rig rig.toml --out rig.toml", &["rig.toml: is read"]),
    // Folders for files, and files for folders.
    ("simulate --rig . --input input.csv --out o.csv", &[".: cannot be read", "name a file, not a folder"]),
    ("simulate --rig rig.toml --input input.csv --out .", &[".: cannot be written", "name a file, not a folder"]),
    ("plot log.csv --svg . --out o.html", &[".: cannot be written", "name a file, not a folder"]),
    ("synthesize --rig rig.toml --truth rig.toml/t.toml --out o.csv", &["rig.toml/t.toml: cannot be written"]),
    ("check . --rig rig.toml", &["name a file, not a folder"]),
    ("sweep --rig rig.toml --vary mass_kg=1:2 --out rig.toml", &["rig.toml: cannot be written", "part of the path"]),
    (
        "diagnose --rig rig.toml --log log.csv --out rig.toml/o",
        &["rig.toml/o/", "cannot be written", "part of the path"],
    ),
    // Numbers are echoed so that they can be read.
    ("check huge.csv --rig rig.toml", &["y_m runs over 1.000e300 m, 1.000e300 strokes"]),
    ("simulate --rig rig.toml --input input.csv --out o.csv --initial y_m=1e300", &["y_m = 1e300 is beyond"]),
    ("sweep --rig rig.toml --vary mass_kg=2:3:2 --target -1e300 --out o", &["--target -1e300", "end stops"]),
    ("sweep --rig rig.toml --vary mass_kg=2:3:2 --target 0 --out o", &["--target 0", "choose another"]),
    ("sweep --rig rig.toml --vary target_m=-0.1:0.1:11 --out o", &["--vary target_m", "choose another"]),
    ("sweep --rig rig.toml --vary target_m=0.1:9:3 --out o", &["--vary target_m 9", "end stops"]),
    (
        "sweep --rig rig.toml --vary friction.static_n=10:40:31 --out o",
        &["friction.static_n = 10 is refused", "narrow"],
    ),
    (
        "sweep --rig rig.toml --vary mass_kg=2:3:2 --config ticks.toml --out o",
        &["ticks.toml", "line 1", "tick_hz", "[io]"],
    ),
    ("run --rig rig.toml --config ticks.toml --out o", &["ticks.toml", "line 1", "tick_hz", "[io]"]),
    ("sweep --rig rig.toml --vary mass_kg=1e300:1e301:2 --duration 0.1 --out o", &["load.mass_kg = 1e300 must be"]),
    ("run --rig rig.toml --gain 1e6 --out o", &["--gain 1e6 must lie from 0 to 10000 (V/m)"]),
    ("rig --bore -32 --rod 12 --stroke 200 --mass 4 --flow 700", &["--bore -32 must lie from 4 to 400 mm"]),
    ("rig --bore 1e300 --rod 12 --stroke 200 --mass 4 --flow 700", &["--bore 1e300 must lie"]),
    ("rig --bore 32mm --rod 12 --stroke 200 --mass 4 --flow 700", &["--bore", "32mm", "without its unit"]),
    (
        "rig --bore 32 --rod 12 --stroke 200 --mass 4 --flow 700 --position-range 0 1e300",
        &["--position-range 0 1e300", "5e299 mm"],
    ),
    ("rig --bore 32 --rod 12 --stroke 200 --mass 4 --flow 700 --spring 10 1e300", &["--spring 10 1e300"]),
    ("synthesize --rig rig.toml --duration 1 --lost-rows 1e300 --out o.csv", &["--lost-rows 1e300 loses every row"]),
    ("run --rig rig.toml --seed -1 --out o", &["--seed", "invalid value '-1'"]),
    ("synthesize --rig rig.toml --duration -5 --out o.csv", &["--duration", "from 1 to 3600 seconds"]),
    ("check --rig rig.toml", &["LOG", "--log"]),
    ("check log.csv --log log.csv --rig rig.toml", &["--log", "cannot be used with"]),
    ("frobnicate", &["frobnicate"]),
];

#[test]
fn every_bad_input_exits_with_2_and_names_place_and_remedy() {
    let folder = folder();
    let before = names(folder.path());
    for (line, words) in CASES {
        let arguments: Vec<&str> = line.split(' ').collect();
        let output = plant_sim(&arguments, folder.path());
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {error}");
        assert!(error.starts_with("error: "), "{line}: {error}");
        assert!(!error.contains("panicked"), "{line}: {error}");
        for word in *words {
            assert!(error.contains(word), "{line}: expected {word:?} in: {error}");
        }
        let mut after = names(folder.path());
        // An output folder may exist, with nothing in it.
        after.retain(|name| name != "o" || names(&folder.path().join("o")) != Vec::<String>::new());
        assert_eq!(after, before, "{line} left something behind");
    }
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("readable")
        .map(|entry| entry.expect("readable").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn a_volume_a_thousand_times_off_is_questioned_before_it_is_believed() {
    let folder = folder();
    let rig = std::fs::read_to_string(folder.path().join("rig.toml")).expect("the rig file");
    let wrong = rig.replace("volume_a0_m3 = 2.5e-4", "volume_a0_m3 = 2.5e-1");
    assert_ne!(wrong, rig);
    std::fs::write(folder.path().join("wrong.toml"), wrong).expect("writable");
    for (file, questioned) in [("rig.toml", false), ("wrong.toml", true)] {
        let arguments = ["simulate", "--rig", file, "--input", "input.csv", "--out", "o.csv"];
        let output = plant_sim(&arguments, folder.path());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(said.contains("warning: wrong.toml: `cylinder.volume_a0_m3`"), questioned, "{said}");
    }
}

#[test]
fn a_failed_run_leaves_the_previous_result_as_it_was() {
    let folder = folder();
    let good = plant_sim(&["simulate", "--rig", "rig.toml", "--input", "input.csv", "--out", "o.csv"], folder.path());
    assert!(good.status.success());
    let before = std::fs::read(folder.path().join("o.csv")).expect("written");
    let bad = plant_sim(&["simulate", "--rig", "rig.toml", "--input", "text.csv", "--out", "o.csv"], folder.path());
    assert_eq!(bad.status.code(), Some(2));
    assert_eq!(std::fs::read(folder.path().join("o.csv")).expect("still there"), before);
}
