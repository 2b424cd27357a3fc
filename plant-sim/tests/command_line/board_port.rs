//! The commissioning of docs/commissioning.md as it is typed: the program, a terminal for a serial port, behind it the firmware's
//! desk and loop with a simulated cylinder.
use crate::simulated_board::Simulated;
use crate::{program, root};
use rig_files::RigFile;
use serialport::{SerialPort, TTYPort};
use std::io::{ErrorKind, Read, Write};
use std::process::Stdio;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// Where the piston is put, by hand, and the pressures of both chambers.
type Place = (f64, [f64; 2]);

struct Rig {
    port: String,
    places: Sender<Place>,
    placed: Receiver<()>,
    /// Keeps the port open between two programs.
    _open: TTYPort,
}

impl Rig {
    fn new(rig: RigFile, sensors: [[f64; 2]; 4]) -> Self {
        let (mut board_side, open) = TTYPort::pair().expect("a pair of terminals");
        let port = open.name().expect("a name");
        board_side.set_timeout(Duration::from_millis(5)).expect("a time-out");
        let (places, to_place) = channel::<Place>();
        let (done, placed) = channel();
        std::thread::spawn(move || {
            let mut board = Simulated::new(&rig);
            board.sensors = sensors;
            let mut bytes = [0; 256];
            loop {
                while let Ok((y_m, p_pa)) = to_place.try_recv() {
                    board.place(&rig, y_m, p_pa);
                    if done.send(()).is_err() {
                        return;
                    }
                }
                match board_side.read(&mut bytes) {
                    Ok(count) => board.take(&bytes[..count]),
                    Err(error) if error.kind() == ErrorKind::TimedOut => {}
                    Err(_) => return,
                }
                if board_side.write_all(&board.give(usize::MAX)).is_err() {
                    return;
                }
            }
        });
        Self { port, places, placed, _open: open }
    }

    fn place(&self, place: Place) {
        self.places.send(place).expect("the board lives");
        self.placed.recv().expect("the board lives");
    }

    /// Runs the program; `hand` is where the piston is put before each Enter. Returns what it printed.
    fn run(&self, arguments: &[&str], hand: &[Place], status: i32) -> String {
        let mut child = program(&root())
            .args(["board", "--port", &self.port])
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("runs");
        let (mut input, mut output) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
        let mut text = Vec::new();
        for place in hand {
            // Until it asks.
            while !text.ends_with(b"press Enter\n") {
                let mut byte = [0];
                assert_eq!(output.read(&mut byte).expect("readable"), 1, "{}", String::from_utf8_lossy(&text));
                text.extend(byte);
            }
            self.place(*place);
            input.write_all(b"\n").expect("it reads");
            text.push(b' ');
        }
        drop(input);
        output.read_to_end(&mut text).expect("readable");
        let mut error = String::new();
        child.stderr.take().expect("piped").read_to_string(&mut error).expect("readable");
        let code = child.wait().expect("ends").code();
        let text = String::from_utf8_lossy(&text).into_owned();
        println!("$ plant-sim board --port /dev/ttyACM0 {}\n{text}{error}", arguments.join(" "));
        assert_eq!(code, Some(status), "{arguments:?}: {text}{error}");
        text + &error
    }
}

#[track_caller]
fn says(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "expected `{word}` in {text}");
    }
}

#[test]
fn a_board_is_commissioned_as_the_page_says() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let mut truth = RigFile::paper_c();
    truth.io.position_range_m = [-0.1, 0.1];
    (truth.rig.valve.dead_zone_right_v, truth.rig.valve.dead_zone_left_v) = (0.42, -0.38);
    let mut stated = truth.clone();
    (stated.rig.valve.dead_zone_right_v, stated.rig.valve.dead_zone_left_v) = (0.0, 0.0);
    stated.write(std::path::Path::new(&path("rig.toml"))).expect("writable");
    let p = truth.rig.equilibrium_pressure_pa();
    let rig = Rig::new(truth, [[0.0012, 0.985], [4.0e3, 1.01], [-2.0e3, 0.99], [0.0, 1.0]]);

    says(&rig.run(&["status"], &[], 0), &["idle"]);
    let refused = rig.run(&["set", "position_low_m", "-0.1"], &[], 2);
    says(&refused, &["`setpoint_low_m` = -0.5", "nothing was changed", "apply"]);
    says(&rig.run(&["apply", &path("rig.toml"), "--save"], &[], 0), &["position_low_m", "in force now", "saved"]);
    let hand = [(-0.0873, [p, p]), (0.0873, [p, p])];
    let position = rig.run(&["calibrate", "position", "-0.0873", "0.0873", "--save"], &hand, 0);
    says(&position, &["position_gain", "position_offset_m", "in force, and saved"]);
    let hand = [(0.0, [1.013e5; 2]), (0.0, [6.0e5; 2])];
    let pressure = rig.run(&["calibrate", "pressure-a", "1.013e5", "6.0e5"], &hand, 0);
    let gain = pressure.lines().find_map(|line| line.strip_prefix("pressure_a_gain ")?.split_whitespace().next());
    // Three times the ±83 Pa of two averages, over 5 bar.
    assert!((gain.expect("a gain").parse::<f64>().unwrap() - 1.0 / 1.01).abs() < 5e-4, "{pressure}");
    rig.place((0.0, [p, p]));
    // It was moved faster than a piston can move.
    rig.run(&["acknowledge"], &[], 0);
    says(&rig.run(&["dead-zone", "--apply"], &[], 0), &["dead zone, right +0.4", "dead zone, left  -0.3", "in force"]);
    says(&rig.run(&["parameters", "--out", &path("board.toml")], &[], 0), &["parameters written"]);
    says(&rig.run(&["apply", &path("board.toml")], &[], 0), &["0 of", "were different"]);
    says(&rig.run(&["get", "pressure_b_gain"], &[], 0), &["1"]);
}

#[test]
fn a_calibration_that_nobody_answers_changes_nothing() {
    let rig = Rig::new(RigFile::paper_c(), [[0.0, 1.0]; 4]);
    says(&rig.run(&["calibrate", "position", "-0.08", "0.08"], &[], 2), &["nobody has pressed Enter"]);
    says(&rig.run(&["get", "position_gain"], &[], 0), &["1"]);
}
