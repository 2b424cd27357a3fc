//! The commands do what the formats promise.

use crate::{program, root};
use control::Parameters;
use plant_model::{Effects, Rig, Simulator};
use plant_sim::controller;
use plant_sim::monitoring::{self, MonitorAction};
use plant_sim::stdio::Coprocess;
use plant_sim::{ClosedLoop, LoopSettings};
use proptest::prelude::*;
use rig_files::{Column, Log, RigFile};
use std::io::Write;
use std::process::{Command, Stdio};

fn plant_sim() -> Command {
    program(&root())
}

#[test]
fn simulate_writes_one_row_per_input_row_with_the_documented_columns() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("o.csv");
    let status = plant_sim()
        .args(["simulate", "--rig", "rigs/paper-b.toml", "--input", "examples/inputs/steps-and-sine.csv", "--out"])
        .arg(&out)
        .status()
        .expect("runs");
    assert!(status.success());
    let text = std::fs::read_to_string(&out).expect("written");
    assert!(text.starts_with("t_s,u_v,y_m,v_m_per_s,p_a_pa,p_b_pa,z_m\n"));
    let log = Log::read(&out).expect("a log");
    assert_eq!(log.len(), 3000);
    assert_eq!((log.t_s[0], log.y_m[0]), (0.0, 0.0));
    let start = Rig::<f64>::paper_b().equilibrium_pressure_pa();
    assert_eq!(log.column(Column::PA).expect("pressure")[0], start);

    // The same through the library: the command adds nothing of its own.
    let mut simulator = Simulator::<f64>::new(&Rig::paper_b(), &Effects::none()).expect("valid");
    let u_v = log.column(Column::U).expect("command");
    for (u_v, times) in u_v.iter().zip(log.t_s.windows(2)) {
        simulator.advance(*u_v, times[1] - times[0]);
    }
    assert_eq!(log.y_m[2999], simulator.state().y_m);
}

#[test]
fn simulate_starts_where_it_is_told_and_holds_each_command_until_the_next_row() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (input, out) = (folder.path().join("i.csv"), folder.path().join("o.csv"));
    std::fs::write(&input, "t_s,u_v\n0,2\n0.5,0\n1.5,0\n").expect("written");
    let initial = "y_m=-0.1, p_a_pa=4e5, v_m_per_s=0.02";
    let run = plant_sim()
        .args(["simulate", "--rig", "rigs/paper-a.toml", "--initial", initial, "--input"])
        .arg(&input)
        .arg("--out")
        .arg(&out)
        .output()
        .expect("runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let log = Log::read(&out).expect("a log");
    assert_eq!((log.y_m[0], log.column(Column::PA).expect("pressure")[0]), (-0.1, 4e5));
    assert_eq!(log.column(Column::V).expect("velocity")[0], 0.02);
    assert!(log.y_m[1] > 0.0, "half a second at 2 V moves the piston far");
}

#[test]
fn check_prints_its_findings_as_json_and_takes_the_log_in_either_way() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let log = folder.path().join("log.csv");
    // Without the pressure of B something is left to tell.
    let synthesize = "synthesize --rig rigs/paper-a.toml --duration 4 --seed 3 --columns u_v,p_a_pa --out".split(' ');
    assert!(plant_sim().args(synthesize).arg(&log).output().expect("runs").status.success());
    let check = |before: &[&str], log: &std::path::Path, json: &[&str]| {
        let mut command = plant_sim();
        command.args(["check", "--rig", "rigs/paper-a.toml"]).args(before).arg(log).args(json).output().expect("runs")
    };
    let run = check(&["--log"], &log, &["--json"]);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(check(&[], &log, &["--json"]).stdout, run.stdout);
    assert_eq!(check(&["--log"], &log, &[]).stdout, check(&[], &log, &[]).stdout);

    let found: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON and nothing else");
    let list = |key: &str| found[key].as_array().cloned().unwrap_or_default();
    assert!(list("findings").iter().all(|flaw| flaw["weight"] == "loss" && flaw["problem"].is_string()));
    let supply = list("knowledge").into_iter().find(|k| k["name"] == "supply.pressure_pa").expect("the supply");
    assert!(supply["std_error"].is_number() && supply["compared_with"].is_number(), "{supply}");
    assert!(supply["told"].is_boolean(), "{supply}");
    let next = &found["next_experiment"];
    assert!(next["from_s"].is_number() && next["mostly"].is_array(), "{next}");
    assert!(next["parts"][0]["purpose"].is_string(), "{next}");

    // A contradiction is told to both kinds of reader.
    let text = std::fs::read_to_string(&log).expect("a log");
    let mm = folder.path().join("mm.csv");
    let in_mm = text.lines().enumerate().map(|(at, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
        let y = text.lines().next().and_then(|head| head.split(',').position(|name| name == "y_m")).expect("y_m");
        if at > 0
            && let Ok(y_m) = cells[y].parse::<f64>()
        {
            cells[y] = (y_m * 1.0e3).to_string();
        }
        cells.join(",") + "\n"
    });
    std::fs::write(&mm, in_mm.collect::<String>()).expect("written");
    let run = check(&[], &mm, &["--json"]);
    assert_eq!(run.status.code(), Some(2));
    let found: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON and nothing else");
    assert_eq!(found["findings"][0]["weight"], "contradiction");
    assert!(String::from_utf8_lossy(&run.stderr).contains("give y_m in metres"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_result_that_cannot_be_printed_or_kept_is_no_success() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let full = std::fs::File::options().write(true).open("/dev/full").expect("exists on Linux");
    let words = ["experiment", "--rig", "rigs/paper-a.toml"];
    let run = plant_sim().args(words).stdout(full).output().expect("runs");
    assert_eq!(run.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&run.stderr).contains("could not be printed"));

    // A folder that cannot be made is refused before anything is computed.
    let file = folder.path().join("file");
    std::fs::write(&file, "").expect("written");
    let run = plant_sim().args(["run", "--out"]).arg(file.join("out")).output().expect("runs");
    assert_eq!(run.status.code(), Some(2));
    assert!(run.stdout.is_empty(), "{}", String::from_utf8_lossy(&run.stdout));
}

#[test]
fn without_arguments_the_three_cylinders_run_and_the_report_says_where_it_is() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = program(folder.path()).output().expect("runs");
    assert!(run.status.success());
    let text = String::from_utf8_lossy(&run.stdout);
    for words in ["paper case (a)", "paper case (b)", "paper case (c)", "Report:", "run.html"] {
        assert!(text.contains(words), "{words} is not in {text}");
    }
    let html = std::fs::read_to_string(folder.path().join("out/run.html")).expect("written");
    assert!(html.contains("uPlot") && html.ends_with("</html>\n"));
}

#[test]
fn both_real_recordings_become_logs_with_pressures_made_absolute() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let import = |map: &str, from: &str| {
        let out = folder.path().join("log.csv");
        let run = plant_sim().args(["import", "--map", map, "--from", from, "--out"]).arg(&out).output().expect("runs");
        assert!(run.status.success(), "{from}: {}", String::from_utf8_lossy(&run.stderr));
        Log::read(&out).expect("a log")
    };
    for bar in 1..=7 {
        let log = import(
            "examples/mappings/piston-friction.toml",
            &format!("examples/data/piston-friction/circle_{bar}bar.csv"),
        );
        let p = log.column(Column::PA).expect("pressure");
        let mean = p.iter().sum::<f64>() / p.len() as f64;
        assert!((mean - 1.013e5 - f64::from(bar) * 1e5).abs() < 0.15e5, "{bar} bar gauge is {mean} Pa absolute");
        assert!(log.column(Column::FExt).expect("force").iter().all(|force| *force < 0.0));
        // Recording 2 has none; recording 4 begins with one of 0.28 s.
        assert_eq!(log.gaps().is_empty(), bar == 2, "{bar} bar");
    }
    let strokes = import("examples/mappings/cylinder-vertical.toml", "examples/data/cylinder-vertical/strokes.csv");
    assert_eq!(strokes.len(), 10_000);
    assert!(strokes.y_m.iter().all(|y_m| y_m.abs() < 0.06));
    assert_eq!(strokes.column(Column::PB), None);
}

fn coprocess() -> Coprocess {
    let setup = monitoring::setup(&Parameters::default(), &RigFile::paper_a().rig, MonitorAction::Warn, 1);
    Coprocess::new(setup.expect("valid"), &Parameters::default())
}

/// What the co-process answers to these lines.
fn answers(lines: &[&str]) -> Vec<String> {
    let mut child = plant_sim()
        .args(["controller", "--rig", "rigs/paper-a.toml", "--stdio"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("runs");
    let mut input = child.stdin.take().expect("piped");
    writeln!(input, "{}", lines.join("\r\n")).expect("taken");
    drop(input);
    let output = child.wait_with_output().expect("ends with its input");
    assert!(output.status.success());
    String::from_utf8_lossy(&output.stdout).lines().map(str::to_string).collect()
}

#[test]
fn the_controller_answers_line_by_line_and_a_malformed_line_changes_nothing() {
    let good = "0.045 32768 23710 23710 45875";
    let malformed =
        ["", "0.045 32768 23710 23710", "nan 1 2 3 4", "0.045 -1 2 3 4", "0.045 65536 2 3 4", "0 1.5 2 3 4"];
    let (mixed, plain) = (answers(&[&[good][..], &malformed, &[good]].concat()), answers(&[good, good]));
    let [first, refused @ .., last] = &mixed[..] else { panic!("{mixed:?}") };
    assert_eq!(refused.len(), malformed.len());
    assert!(refused.iter().all(|answer| answer.starts_with("error ")), "{refused:?}");
    assert_eq!([first, last], [&plain[0], &plain[1]]);
    assert!(plain.iter().all(|answer| answer.ends_with(" run")), "{plain:?}");
    // What was learned is told without a tick.
    let told = answers(&["learned", good, "learned", good]);
    assert_eq!([&told[1], &told[3]], [&plain[0], &plain[1]]);
    assert!(told[0].starts_with("learned tick=0 flow_right=1 flow_left=1 dead_zone_right_v="), "{}", told[0]);
    assert!(told[2].starts_with("learned tick=1 flow_right="), "{}", told[2]);
}

#[test]
fn an_endless_line_is_refused_without_being_stored_and_the_next_is_served() {
    let mut input = vec![b'7'; 1_000_000];
    input.extend_from_slice(b"\n0.045 32768 23710 23710 45875");
    let mut answers = Vec::new();
    coprocess().serve(&input[..], &mut answers, |_| ()).expect("memory does not fail");
    let text = String::from_utf8(answers).expect("text");
    let answers: Vec<&str> = text.lines().collect();
    assert!(answers[0].starts_with("error the line is longer"), "{}", answers[0]);
    assert_eq!(answers[1], "2121 run");
}

/// Twelve hundred ticks of a move on a plant that fills twice as fast as the controller's rig file says: the last answer, and
/// the first tick in which the monitor disagreed.
fn answers_to_a_foreign_plant(monitor: MonitorAction) -> (String, Option<u64>) {
    let known = RigFile::paper_a();
    let mut foreign = known.clone();
    foreign.rig.valve.fill_coefficient_kg_per_s_pa *= 2.0;
    let parameters = controller::parameters(&known);
    let settings = LoopSettings { monitor: MonitorAction::Off, ..LoopSettings::default() };
    let mut plant = ClosedLoop::new(&foreign, &parameters, &settings).expect("a physical plant");
    let setup = monitoring::setup(&parameters, &known.rig, monitor, 1).expect("valid");
    let mut process = Coprocess::new(setup, &parameters);
    let (mut last, mut first_contradiction) = (String::new(), None);
    for _ in 0..1200 {
        plant.tick_with(|[position, a, b, supply]| {
            let (mut answer, line) = (Vec::new(), format!("0.2 {position} {a} {b} {supply}"));
            let contradicted = |tick| first_contradiction = Some(tick);
            process.serve(line.as_bytes(), &mut answer, contradicted).expect("memory does not fail");
            last = String::from_utf8(answer).expect("text");
            last.split(' ').next().and_then(|code| code.parse().ok()).expect("a code")
        });
    }
    (last, first_contradiction)
}

#[test]
fn a_foreign_plant_is_warned_of_once_and_driven_on_unless_the_monitor_is_asked_to_trip() {
    let (answer, warned) = answers_to_a_foreign_plant(MonitorAction::Warn);
    assert!(answer.ends_with(" run\n"), "{answer}");
    assert!(warned.is_some());
    let (answer, _) = answers_to_a_foreign_plant(MonitorAction::Trip);
    assert!(answer.ends_with(" safe:model-disagreement\n"), "{answer}");
    let (answer, warned) = answers_to_a_foreign_plant(MonitorAction::Off);
    assert!(answer.ends_with(" run\n") && warned.is_none(), "{answer}");
}

#[test]
fn a_run_whose_monitor_disagrees_says_so_and_what_can_be_done() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let rig = folder.path().join("leaky.toml");
    let text = std::fs::read_to_string(root().join("rigs/paper-a.toml")).expect("a rig");
    std::fs::write(&rig, text + "\n[effects.leak-chamber-a]\nconductance_kg_per_s_pa = 5e-9\n").expect("written");
    let run = |monitor: &str| {
        let mut command = plant_sim();
        command.args(["run", "--duration", "1", "--monitor", monitor, "--rig"]).arg(&rig);
        let output = command.arg("--out").arg(folder.path()).output().expect("runs");
        assert!(output.status.success());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let tripped = run("trip");
    assert!(tripped.contains("safe:model-disagreement") && tripped.contains("--monitor warn"), "{tripped}");
    let warned = run("warn");
    assert!(warned.contains("contradict") && !warned.contains("safe:"), "{warned}");
    assert_eq!(run("off"), "");
}

#[test]
fn a_dead_position_sensor_leads_to_a_latched_safe_state_with_its_reason() {
    let mut controller = coprocess();
    controller.answer("0.045 32768 23710 23710 45875");
    let answers: Vec<String> = (0..30).map(|_| controller.answer("0.045 0 23710 23710 45875")).collect();
    assert!(answers.last().is_some_and(|answer| answer.contains("safe:position-")), "{answers:?}");
    let after = controller.answer("0.045 32768 23710 23710 45875");
    assert!(after.contains("safe:position-"), "a good reading does not re-arm: {after}");
}

proptest! {
    #[test]
    fn any_line_gets_one_answer_and_an_error_changes_nothing(lines in proptest::collection::vec("[ -~\t]{0,40}|[0-9 .e+-]{0,40}|0\\.[0-9]{1,3}( [0-9]{1,6}){3,5}", 1..20)) {
        let mut controller = coprocess();
        for line in lines {
            let before = controller.state().clone();
            let answer = controller.answer(&line);
            prop_assert_eq!(answer.lines().count(), 1);
            if answer.starts_with("error ") {
                prop_assert_eq!(controller.state(), &before);
            } else {
                let (code, state) = answer.split_once(' ').expect("two words");
                prop_assert!(code.parse::<u16>().expect("a code") <= 4095);
                prop_assert!(state == "run" || state.starts_with("safe:"), "{}", state);
            }
        }
    }

    #[test]
    fn any_bytes_as_a_conversation_are_answered_line_by_line(bytes in proptest::collection::vec(any::<u8>(), 0..3000)) {
        let mut answers = Vec::new();
        coprocess().serve(&bytes[..], &mut answers, |_| ()).expect("memory does not fail");
        let lines = bytes.split(|byte| *byte == b'\n').count() - usize::from(bytes.last().is_none_or(|byte| *byte == b'\n'));
        prop_assert_eq!(String::from_utf8(answers).expect("text").lines().count(), lines);
    }

    #[test]
    fn any_mapping_over_any_table_gives_a_log_or_an_error(at in 0..200_usize, insert in "[ -~\n]{0,10}", comma in any::<bool>(), table in "([0-9.,;\"\t x-]{0,20}\n){0,6}") {
        let separator = if comma { "comma" } else { "space" };
        let good = format!("[source]\nseparator = \"{separator}\"\nheader = false\natmosphere_pa = 1e5\n[column.t_s]\nfrom = 1\n[column.y_m]\nfrom = 2\n[column.p_a_pa]\nfrom = 3\ngauge = true\n");
        let mut text = good.clone();
        text.insert_str(at.min(good.len()), &insert);
        if let Ok(mapping) = plant_sim::import::Mapping::parse(&text, "map.toml") {
            let _ = mapping.convert(table.as_bytes(), "table.txt");
        }
        let _ = RigFile::parse(&text, "rig.toml");
    }
}

#[test]
fn getting_started_shows_what_the_commands_print() {
    let page = include_str!("../../../docs/getting-started.md");
    let answer = answers(&["0.045 32768 23710 23710 45875"]).remove(0);
    let code = answer.split_whitespace().next().expect("a code");
    assert!(page.contains(&format!("# ({code}, 'run')")), "docs/getting-started.md documents another code than {code}");

    let out = std::env::temp_dir().join(format!("getting-started-{}", std::process::id()));
    let printed = plant_sim().arg("run").arg("--out").arg(&out).output().expect("the program runs");
    let printed = String::from_utf8(printed.stdout).expect("text");
    let _ = std::fs::remove_dir_all(&out);
    let tables = printed.split("\nReport:").next().expect("a part");
    let shown = page.split("```text\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a block of text");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/getting-started.md");
        std::fs::write(path, page.replacen(shown, tables, 1)).expect("the page is written");
        return;
    }
    assert_eq!(
        shown, tables,
        "docs/getting-started.md shows another table than `cargo run --release` prints; write it anew with `UPDATE_DOCS=1 cargo test -p \
         plant-sim --test command_line getting_started`"
    );
}
