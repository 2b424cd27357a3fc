//! `plant-sim board --emulated` and `run --elf`: the commissioning of `docs/commissioning.md` walked from beginning to end, without a
//! board. Skipped with a message where the target is not installed, and without POSITIONER_TESTS=all.

use board_link::{Command, Generator, Reply};
use monitor::MonitorParameters;
use plant_sim::emulated::commission;
use plant_sim::emulated::session::Session;
use plant_sim::telemetry::Remark;
use plant_sim::{LoopSettings, controller};
use rig_files::RigFile;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{self, Output, Stdio};
use test_stages::firmware::build_for_target;
use test_stages::skipped;

fn elf() -> Option<PathBuf> {
    build_for_target("firmware").map_err(|why| skipped("commissioning", &why)).ok()
}

fn plant_sim(arguments: &[&str], input: &str) -> Output {
    let mut child = process::Command::new(env!("CARGO_BIN_EXE_plant-sim"))
        .args(arguments)
        .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(".."))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("plant-sim runs");
    child.stdin.take().expect("standard input").write_all(input.as_bytes()).expect("it reads");
    child.wait_with_output().expect("it ends")
}

/// What came out between one line of the input and the next.
#[track_caller]
fn answer<'t>(output: &'t str, line: &str) -> &'t str {
    let begin = output.find(&format!("> {line}\n")).unwrap_or_else(|| panic!("`{line}` was not echoed:\n{output}"));
    let rest = &output[begin + 2 + line.len()..];
    &rest[..rest.find("\n> ").unwrap_or(rest.len())]
}

#[test]
fn the_whole_commissioning_can_be_walked_without_a_board() {
    let Some(elf) = elf() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let (log, elf) = (folder.path().join("run.csv"), elf.display().to_string());
    let log_name = log.display().to_string();
    let arguments = ["board", "--emulated", &elf, "--rig", "rigs/real-mpye.toml", "--log", &log_name];
    let output = plant_sim(&arguments, include_str!("commissioning.txt"));
    let (said, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    println!("{said}\n{errors}");
    assert!(output.status.success(), "{said}\n{errors}");
    for (line, words) in [
        ("status 1", "state        safe:"),
        ("status 2", "state        run (bench)"),
        ("meter 1", "valve +0.00"),
        ("status 3", "state        idle"),
        ("search", "dead zone, right +0.4"),
        ("search", "dead zone, left  -0.4"),
        ("status 4", "state        run"),
        ("status 5", "state        idle"),
        ("status 6", "state        run"),
        ("status 7", "state        safe:supply-low"),
    ] {
        // The lines of the walk that are looked at carry a number behind the comment sign.
        let place = said.find(&format!("# {line}\n")).unwrap_or_else(|| panic!("no `{line}` in\n{said}"));
        let rest = &said[place..];
        let end = rest.find("\n> ").unwrap_or(rest.len());
        assert!(rest[..end].contains(words), "`{line}` wants `{words}`:\n{}", &rest[..end]);
    }
    assert!(answer(&said, "get gain_v_per_m").trim().starts_with('8'), "the gain is found in flash");
    let log = rig_files::Log::read(&log).expect("the telemetry is a log");
    let end_m = log.y_m.iter().rev().find(|y| y.is_finite()).copied().unwrap_or_default();
    assert!(log.t_s.len() > 10_000, "{} rows", log.t_s.len());
    assert!((-0.2..0.2).contains(&end_m), "{end_m}");
}

#[test]
fn a_refused_line_is_told_and_the_rest_is_carried_out() {
    let Some(elf) = elf() else { return };
    let elf = elf.display().to_string();
    let output = plant_sim(&["board", "--emulated", &elf], "disarm\nset gain_v_per_m 3\nnonsense\nget gain_v_per_m\n");
    let said = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(answer(&said, "disarm").contains("refused in this state"), "{said}");
    assert!(answer(&said, "nonsense").contains("nonsense"), "{said}");
    assert_eq!(answer(&said, "get gain_v_per_m").trim(), "3");
    let output = plant_sim(&["board", "--emulated", "README.md"], "");
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn the_step_of_the_paper_runs_on_the_firmware_as_on_this_computer() {
    let Some(elf) = elf() else { return };
    let elf = elf.display().to_string();
    let folder = tempfile::tempdir().expect("a folder");
    let mut ends = Vec::new();
    for more in [&[][..], &["--elf", &elf]] {
        let out = folder.path().join(more.len().to_string());
        let out_name = out.display().to_string();
        let mut arguments = vec!["run", "--rig", "rigs/paper-b.toml", "--duration", "2", "--logs", "--out", &out_name];
        arguments.extend(more);
        let output = plant_sim(&arguments, "");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let mut logs = std::fs::read_dir(&out).expect("logs").filter_map(|entry| Some(entry.ok()?.path()));
        let path = logs.find(|path| path.to_string_lossy().ends_with("true.csv")).expect("true states");
        let log = rig_files::Log::read(&path).expect("a log");
        assert!((1_990..2_010).contains(&log.t_s.len()), "{} rows", log.t_s.len());
        ends.push((log.y_m[300], log.y_m[1_900]));
        let telemetry = path.with_file_name(path.file_name().unwrap().to_string_lossy().replace("-true", ""));
        let telemetry = rig_files::Log::read(&telemetry).expect("a log");
        assert!(telemetry.t_s.len() >= 2_000, "{} rows", telemetry.t_s.len());
    }
    let [(early, late), (early_elf, late_elf)] = ends[..] else { panic!("two runs") };
    // Other noise, and a reference that arrives some ticks later over the serial line.
    assert!((late - late_elf).abs() < 5e-4, "{late} m and {late_elf} m");
    assert!((early - early_elf).abs() < 2e-3, "{early} m and {early_elf} m");
}

#[test]
fn what_the_firmware_has_learned_is_in_its_telemetry_and_outlives_power_off_only_by_command() {
    let Some(elf) = elf() else { return };
    let bytes = std::fs::read(&elf).expect("firmware");
    let rig = RigFile::paper_b();
    let parameters = controller::parameters(&rig);
    let settings = LoopSettings::default();
    let noise = settings.noise.of_code(&rig.io, settings.oversampling, settings.raw_bits);
    let mut session = Session::start(&bytes, "firmware", &rig, &noise, 1).expect("powers up");
    let numbers = commission::settings(&rig.rig, &parameters, settings.monitor, &MonitorParameters::default());
    commission::apply(session.board(), &numbers.expect("numbers of the board")).expect("applied");

    let learned = |session: &mut Session| match session.client().expect("a session").ask(Command::Learned) {
        Ok(Reply::Learned(values)) => values,
        other => panic!("{other:?}"),
    };
    let done = |session: &mut Session, command| {
        assert_eq!(session.client().expect("a session").ask(command), Ok(Reply::Done), "{command:?}");
    };
    let moves = |session: &mut Session| {
        session.wait(0.3).expect("runs");
        done(session, Command::Arm);
        done(session, Command::Generate(Generator::Hold { position_um: 40_000 }));
        session.wait(1.0).expect("runs");
    };
    let restart = |session: &mut Session| {
        session.power_cycle().expect("starts");
        session.forget_telemetry();
    };
    let told = |session: &mut Session| -> Vec<_> {
        let (_, remarks) = session.telemetry();
        remarks
            .into_iter()
            .filter_map(|remark| if let Remark::Learned(_, values) = remark { Some(values) } else { None })
            .collect()
    };

    restart(&mut session);
    let fresh = learned(&mut session);
    moves(&mut session);
    let at_rest = learned(&mut session);
    assert_ne!(at_rest.now, fresh.now);
    done(&mut session, Command::Disarm);
    session.forget_telemetry();
    session.wait(2.2).expect("runs");
    let after = learned(&mut session);
    let lines = told(&mut session);
    println!("{lines:?}");
    assert!(lines.len() >= 2, "one a second");
    assert!(
        lines.iter().all(|line| *line == after.now),
        "telemetry says what the law holds, and idle it learns nothing"
    );
    restart(&mut session);
    assert_eq!(learned(&mut session), fresh, "not kept without the command");

    moves(&mut session);
    done(&mut session, Command::Disarm);
    let kept = learned(&mut session).now;
    done(&mut session, Command::Keep);
    restart(&mut session);
    let found = learned(&mut session);
    assert_eq!((found.now, found.kept, found.refused), (kept, Some(kept), None));
    done(&mut session, Command::Forget);
    restart(&mut session);
    assert_eq!(learned(&mut session), fresh);
}
