//! `plant-sim blind` scores any program that writes `diagnosis.json`.
use crate::program;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A diagnosis that looks at nothing: `$7` is the folder after `--out`.
fn fake(folder: &Path, json: &str) -> PathBuf {
    let path = folder.join("fake-diagnosis");
    let script =
        format!("#!/bin/sh\n[ \"$1\" = diagnose ] && mkdir -p \"$7\" && echo '{json}' > \"$7/diagnosis.json\"\n");
    std::fs::write(&path, script).expect("written");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("made executable");
    path
}

fn blind(folder: &Path, diagnosis: &Path, words: &str) -> Output {
    program(folder)
        .arg("blind")
        .arg("--diagnosis")
        .arg(diagnosis)
        .args(words.split_whitespace())
        .output()
        .expect("plant-sim starts")
}

const QUIET: &str = r#"{"verdict": "no-gap", "causes": [], "calibration": [], "gain": {}}"#;
const CONSTANT: &str =
    r#"{"verdict": "explained", "causes": [{"id": "dead-volume", "parameters": [], "ties": []}], "calibration": []}"#;

#[test]
fn a_diagnosis_that_is_always_silent_is_right_about_null_logs_alone() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = fake(folder.path(), QUIET);
    let words = "--class null,single --nominal exact --logs 2 --seed 3 --out results.md --jobs 2";
    let done = blind(folder.path(), &program, words);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let csv = std::fs::read_to_string(folder.path().join("results.csv")).expect("one line per case");
    assert_eq!(csv.matches(",quiet,no-gap").count(), 2, "{csv}");
    assert_eq!(csv.matches(",abstained,no-gap").count(), 2, "{csv}");
    let table = std::fs::read_to_string(folder.path().join("results.md")).expect("the tables");
    assert!(table.contains("--seed 3 --class null,single --nominal exact"), "{table}");
}

#[test]
fn tables_do_not_go_where_the_lines_of_the_cases_go() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = fake(folder.path(), QUIET);
    let done = blind(folder.path(), &program, "--class null --nominal exact --logs 1 --seed 3 --out results.csv");
    assert_eq!(done.status.code(), Some(2));
    let said = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(said.contains("--out") && said.contains("write .md"), "{said}");
    assert!(!folder.path().join("results.csv").exists());
}

#[test]
fn a_constant_diagnosis_raises_alarms_and_a_case_is_replayed_by_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = fake(folder.path(), CONSTANT);
    let done = blind(folder.path(), &program, "--class null --nominal 2% --logs 1 --seed 3 --out results.md");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let csv = std::fs::read_to_string(folder.path().join("results.csv")).expect("one line per case");
    assert!(csv.contains("false alarm"), "{csv}");
    let case = csv.lines().nth(1).and_then(|line| line.split(',').next()).expect("a case");
    let again = blind(folder.path(), &program, &format!("--case {case} --keep kept"));
    assert!(again.status.success(), "{}", String::from_utf8_lossy(&again.stderr));
    assert!(String::from_utf8_lossy(&again.stdout).contains("false alarm"));
    for kept in ["rig.toml", "log.csv", "truth.toml", "diagnosis.json"] {
        assert!(folder.path().join("kept").join(kept).exists(), "{kept}");
    }
}

#[test]
fn a_diagnosis_that_does_not_start_or_answers_nonsense_fails_its_cases() {
    let folder = tempfile::tempdir().expect("a folder");
    for program in [folder.path().join("nobody"), fake(folder.path(), "not json")] {
        let done = blind(folder.path(), &program, "--class null --nominal exact --logs 1 --seed 3 --out results.md");
        assert!(done.status.success());
        let csv = std::fs::read_to_string(folder.path().join("results.csv")).expect("one line per case");
        assert!(csv.contains(",failed,"), "{csv}");
    }
    for words in ["--class sinlge", "--logs 0"] {
        let wrong = blind(folder.path(), Path::new("nobody"), words);
        assert_eq!(wrong.status.code(), Some(2), "{words}");
    }
}
