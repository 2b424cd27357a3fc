//! `plant-sim synthesize` and `plant-sim experiment` from the outside.

use crate::{program, root};
use rig_files::{Column, Log};
use std::path::Path;
use std::process::Output;

fn plant_sim(folder: &Path, arguments: &[&str]) -> Output {
    program(folder)
        .args([arguments[0], "--rig"])
        .arg(root().join("rigs/paper-c.toml"))
        .args(&arguments[1..])
        .output()
        .expect("plant-sim starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_same_seed_gives_the_same_log_and_the_truth_is_told_only_on_request() {
    let folder = tempfile::tempdir().expect("a folder");
    let hidden = ["synthesize", "--hidden", "2", "--seed", "5", "--duration", "3", "--nominal-error", "0.02", "--out"];
    let first = plant_sim(folder.path(), &[&hidden[..], &["one.csv"]].concat());
    assert!(first.status.success(), "{}", text(&first.stderr));
    let second = plant_sim(folder.path(), &[&hidden[..], &["two.csv", "--truth", "truth.toml"]].concat());
    assert!(second.status.success(), "{}", text(&second.stderr));
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("written");
    assert_eq!(read("one.csv"), read("two.csv"));
    let truth = read("truth.toml");
    assert_eq!(truth.matches("[effects.").count(), 2, "{truth}");
    for effect in plant_model::Effect::ALL {
        assert!(!text(&first.stdout).contains(effect.id()), "{}", text(&first.stdout));
    }
}

/// The rig of the other tests, as a file of its own, with the effects written below it.
fn rig_with(folder: &Path, effects: &str) {
    let rig = std::fs::read_to_string(root().join("rigs/paper-c.toml")).expect("shipped");
    std::fs::write(folder.join("rig.toml"), rig + effects).expect("written");
}

fn of_its_own(folder: &Path, arguments: &str) -> Output {
    program(folder)
        .args("synthesize --rig rig.toml --seed 4 --duration 3".split(' '))
        .args(arguments.split_whitespace())
        .output()
        .expect("plant-sim starts")
}

#[test]
fn effects_that_the_rig_file_states_are_in_the_log_and_chosen_and_hidden_ones_come_in_addition() {
    let folder = tempfile::tempdir().expect("a folder");
    const STATED: &str = "\n[effects.pressure-a-offset]\noffset_pa = 50000.0\n";
    const CHOSEN: &str = "--effect pressure-b-offset:offset_pa=30000";
    // What the pressure sensors show of a rig that has hardly moved yet.
    let shown = |effects: &str, arguments: &str| {
        rig_with(folder.path(), effects);
        let done = of_its_own(folder.path(), &format!("{arguments} --out log.csv --truth truth.toml"));
        assert!(done.status.success(), "{}", text(&done.stderr));
        let log = Log::read(&folder.path().join("log.csv")).expect("a log that reads");
        [Column::PA, Column::PB].map(|column| log.column(column).expect("recorded")[..5].iter().sum::<f64>() / 5.0)
    };
    let [a, b] = shown("", "");
    for (arguments, more) in [("", [5.0e4, 0.0]), (CHOSEN, [5.0e4, 3.0e4])] {
        let [with_a, with_b] = shown(STATED, arguments);
        assert!((with_a - a - more[0]).abs() < 1.0e4 && (with_b - b - more[1]).abs() < 1.0e4, "{with_a} {with_b}");
    }
    // Beside one that is stated all others can be hidden, and no more.
    let others = plant_model::Effect::ALL.len() - 1;
    shown(STATED, "--hidden 2");
    let truth = std::fs::read_to_string(folder.path().join("truth.toml")).expect("written");
    assert_eq!(truth.matches("[effects.").count(), 3, "{truth}");
    assert_eq!(truth.matches("[effects.pressure-a-offset]\noffset_pa = 50000.0").count(), 1, "{truth}");
    let refused = of_its_own(folder.path(), &format!("--hidden {} --out none.csv", others + 1));
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains(&format!("only {others} effects")), "{}", text(&refused.stderr));
}

#[test]
fn an_effect_that_would_be_there_twice_is_one_clear_error() {
    let folder = tempfile::tempdir().expect("a folder");
    rig_with(folder.path(), "\n[effects.valve-lag]\ntime_constant_s = 0.02\n");
    for (arguments, says) in [
        ("--effect valve-lag --out log.csv", "rig.toml states it already, under [effects.valve-lag]"),
        ("--effect payload-mass --effect payload-mass --out log.csv", "--effect payload-mass is given twice"),
    ] {
        let failed = of_its_own(folder.path(), arguments);
        assert_eq!(failed.status.code(), Some(2), "{arguments}");
        assert!(text(&failed.stderr).contains(says), "{}", text(&failed.stderr));
    }
    assert!(!folder.path().join("log.csv").exists());
}

#[test]
fn noise_losses_and_columns_are_as_asked() {
    let folder = tempfile::tempdir().expect("a folder");
    let words = "synthesize --effect valve-lag:time_constant_s=0.01 --seed 1 --duration 6 --jitter 0.1 --lost-rows 1 \
                 --blanks 0.5 --columns u_v,p_a_pa --out log.csv";
    let done = plant_sim(folder.path(), &words.split_whitespace().collect::<Vec<_>>());
    assert!(done.status.success(), "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("valve-lag:time_constant_s=0.01"));
    let log = Log::read(&folder.path().join("log.csv")).expect("a log that reads");
    assert!(log.column(Column::PB).is_none() && log.column(Column::PA).is_some());
    assert!(log.len() < 6000 && !log.gaps().is_empty());
    let steps: Vec<f64> = log.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(steps.iter().any(|step| *step < 0.95e-3) && steps.iter().any(|step| *step > 1.05e-3));
    // 12 bits over 10 bar.
    let pressures = log.column(Column::PA).expect("recorded");
    let code = pressures.iter().find(|p| p.is_finite()).expect("a sample") / 1e6 * 4095.0;
    assert!((code - code.round()).abs() < 1e-6);
}

#[test]
fn a_bad_request_is_one_clear_error_and_no_file() {
    let folder = tempfile::tempdir().expect("a folder");
    for (effect, says) in [
        ("valve-leg", "no effect is called `valve-leg`"),
        ("valve-lag:tau=1", "it has: time_constant_s"),
        ("valve-lag:time_constant_s=ten", "write a number from 0 to 0.2"),
        ("valve-lag:time_constant_s=7", "write a number from 0 to 0.2"),
    ] {
        let failed = plant_sim(folder.path(), &["synthesize", "--effect", effect, "--out", "log.csv"]);
        assert_eq!(failed.status.code(), Some(2), "{effect}");
        assert!(text(&failed.stderr).contains(says), "{}", text(&failed.stderr));
    }
    assert!(!folder.path().join("log.csv").exists());
}

#[test]
fn the_recommended_sequence_states_its_purpose_and_keeps_within_the_rig() {
    let folder = tempfile::tempdir().expect("a folder");
    let done = plant_sim(folder.path(), &["experiment", "--out", "ref.csv"]);
    assert!(done.status.success(), "{}", text(&done.stderr));
    for word in ["leaks", "dead zone", "delay", "friction", "V/m"] {
        assert!(text(&done.stdout).contains(word), "{word}");
    }
    let table = std::fs::read_to_string(folder.path().join("ref.csv")).expect("written");
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("t_s,y_ref_m,u_v"));
    let (mut rows, mut open, mut closed) = (0, 0, 0);
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        assert_eq!(fields.len(), 3);
        rows += 1;
        if fields[1].is_empty() {
            open += 1;
        } else {
            closed += 1;
            assert!(fields[1].parse::<f64>().expect("a number").abs() <= 0.5 * 0.1746);
        }
        assert!(fields[2].parse::<f64>().expect("a number").abs() <= 5.0);
    }
    assert!(rows == 40_000 && open > 5_000 && closed > 15_000);
}
