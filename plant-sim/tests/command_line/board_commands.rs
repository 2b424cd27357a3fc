//! `plant-sim record` and `board` with what a user gets wrong: one error with a remedy, no panic, no half-written log.

use crate::{plant_sim, program, root};
use std::path::Path;
use std::process::Stdio;

#[track_caller]
fn refused(arguments: &[&str], folder: &Path, status: i32, says: &[&str]) {
    let output = plant_sim(arguments, folder);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {text}");
    for part in says {
        assert!(text.contains(part), "{arguments:?}: `{text}` does not say `{part}`");
    }
    assert!(!folder.join("run.csv").exists(), "{arguments:?} left a log behind");
}

#[test]
fn recording_from_what_is_no_firmware_or_no_stream_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    std::fs::write(at.join("text.elf"), "no firmware").expect("writable");
    // This very program is an ELF file, but it has no telemetry formats.
    std::fs::copy(env!("CARGO_BIN_EXE_plant-sim"), at.join("host.elf")).expect("copied");
    std::fs::write(at.join("stream.bin"), [1, 2, 3]).expect("writable");
    let record = |elf, from| ["record", "--quiet", "--out", "run.csv", "--elf", elf, "--from", from];
    refused(&record("nothing.elf", "stream.bin"), at, 2, &["nothing.elf"]);
    refused(&record("text.elf", "stream.bin"), at, 2, &["text.elf", "firmware"]);
    refused(&record("host.elf", "stream.bin"), at, 2, &["host.elf", "give the very file"]);
    let probe = ["record", "--out", "run.csv", "--elf", "text.elf", "--probe", "--from", "stream.bin"];
    refused(&probe, at, 2, &["--probe", "--from"]);
}

#[cfg(not(feature = "probe"))]
#[test]
fn a_probe_without_probe_support_names_the_feature() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::copy(env!("CARGO_BIN_EXE_plant-sim"), folder.path().join("host.elf")).expect("copied");
    for probe in [&["--probe"][..], &["--probe", "0483:374e", "--chip", "STM32G474RETx"]] {
        let arguments = [&["record", "--out", "run.csv", "--elf", "host.elf"], probe].concat();
        refused(&arguments, folder.path(), 2, &["--features probe"]);
    }
}

#[test]
fn a_board_that_is_not_there_and_words_it_does_not_know_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let board = |more: &[&'static str]| [&["board", "--port", "no-such-port"], more].concat();
    refused(&board(&["status"]), folder.path(), 1, &["no-such-port", "plugged in"]);
    refused(&board(&["get", "gain_v_per_n"]), folder.path(), 2, &["gain_v_per_m"]);
    refused(&board(&["set", "gain_v_per_m", "much"]), folder.path(), 2, &["much"]);
    refused(&board(&["set", "gain_v_per_m", "4", "monitor"]), folder.path(), 2, &["in turn"]);
    refused(&board(&["hold", "nan"]), folder.path(), 2, &["number"]);
    refused(&board(&["sine", "--period", "inf"]), folder.path(), 2, &["--period"]);
    refused(&board(&["bench", "maybe"]), folder.path(), 2, &["maybe"]);
}

#[test]
fn a_file_to_apply_is_refused_with_line_key_and_remedy_before_a_board_is_looked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    for (name, text, says) in [
        ("empty.toml", "# nothing yet", &["empty.toml", "board parameters --out"][..]),
        ("broken.toml", "gain_v_per_m = ", &["broken.toml", "line 1", "TOML"]),
        ("typo.toml", "gain_v_per_n = 4", &["typo.toml", "line 1", "gain_v_per_m"]),
        ("range.toml", "monitor = 1\ngain_v_per_m = -4", &["range.toml", "line 2", "0 to 10000"]),
        ("rig.toml", "[load]\nmass_kg = 5", &["rig.toml", "is missing"]),
    ] {
        std::fs::write(at.join(name), text).expect("writable");
        refused(&["board", "--port", "no-such-port", "apply", name], at, 2, says);
    }
    refused(&["board", "--port", "no-such-port", "apply", "no-such-file"], at, 2, &["no-such-file"]);
    refused(&["board", "--port", "no-such-port", "parameters", "--out", "p.toml"], at, 1, &["no-such-port"]);
    assert!(!at.join("p.toml").exists());
    refused(&["board", "--port", "no-such-port", "tune", "--rig", "typo.toml", "--out", "t"], at, 2, &["typo.toml"]);
    refused(
        &["board", "--port", "no-such-port", "update", "typo.toml"],
        at,
        2,
        &["no firmware for this chip", "cargo fw"],
    );
    refused(&["board", "--port", "no-such-port", "dead-zone", "--limit", "9"], at, 2, &["--limit"]);
    refused(&["board", "--port", "no-such-port", "calibrate", "position", "1", "1"], at, 2, &["two different"]);
}

#[test]
fn a_reader_that_goes_away_is_no_panic() {
    let mut child = program(&root())
        .args(["board", "parameters"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("ends");
    assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"), "{output:?}");
}

#[test]
fn the_list_of_parameters_shows_the_controllers_own_ranges_and_defaults() {
    let output = program(&root()).args(["board", "parameters"]).output().expect("runs");
    let list = String::from_utf8_lossy(&output.stdout).into_owned();
    for key in control::Key::ALL.into_iter().filter(|key| board_link::Parameter::from_name(key.row().key).is_some()) {
        let row = key.row();
        let line = list.lines().find(|line| line.split(' ').next() == Some(row.key)).expect(row.key);
        assert!(line.ends_with(key.meaning()), "{line}");
        // The board's own tick rate narrows these two.
        if !["tick_hz", "setpoint_acceleration_m_per_s2"].contains(&row.key) {
            assert!(line.contains(&format!("({}", row.limits)), "{line}");
        }
    }
}
