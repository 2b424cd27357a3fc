//! The desktop talks to the firmware's own desk and control loop, over a line that loses and damages frames.

use crate::root;
use board_link::{
    Accumulator, Admission, Command, FRAME_BYTES, Generator, Parameter, Refusal, Reply, Request, Session, encode,
};
use control::ExternalFaults;
use firmware_core::{Action, ControlLoop, Desk, Settings, Snapshot};
use plant_sim::board::{BoardError, Client};
use plant_sim::commission::transfer::{self, TransferError};
use plant_sim::commission::{from_rig, parameter_file};
use rig_files::RigFile;
use std::io::{Read, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

/// A board without hardware: the loop runs two ticks for every order. `damage` sees every answer before it is sent.
fn board(mut line: UnixStream, mut damage: impl FnMut(u32, &mut Vec<u8>) + Send + 'static) {
    std::thread::spawn(move || {
        let settings = Settings::default();
        let mut control_loop = ControlLoop::new(settings.setup().expect("defaults"), None);
        let mut desk = Desk::new(settings, "test-board", "1.2.3", "".try_into().expect("empty"));
        let (snapshot, mut session, mut accumulator) = (Snapshot::new(), Session::new(), Accumulator::new());
        let run = |control_loop: &mut ControlLoop, ticks: u32| {
            for n in 0..ticks {
                let noise = (n % 3) as u16;
                let codes = [32_767 + noise, 23_710 + noise, 23_712, 45_870];
                let tick = control_loop.tick(codes, ExternalFaults::default(), true);
                control_loop.conclude();
                snapshot.publish(&tick.record, control_loop);
            }
            snapshot.mode()
        };
        run(&mut control_loop, 200);
        let (mut byte, mut answers) = ([0], 0);
        while line.read_exact(&mut byte).is_ok() {
            let Some(Ok(request)) = accumulator.push::<Request>(byte[0]) else { continue };
            let answer = match session.admit(&request, 77) {
                Admission::Answer(answer) => answer,
                Admission::Execute(command) => {
                    let snapshot_now = Snapshot::new();
                    let tick = control_loop.tick([32_767, 23_710, 23_712, 45_870], ExternalFaults::default(), true);
                    snapshot_now.publish(&tick.record, &control_loop);
                    let result = desk.decide(command, &snapshot_now, 0).and_then(|action| match action {
                        Action::Reply(reply) => Ok(reply),
                        Action::Order(order, outcome) => {
                            control_loop.order(&order);
                            if outcome.shown_by(run(&mut control_loop, 2)) {
                                Ok(Reply::Done)
                            } else {
                                Err(Refusal::State)
                            }
                        }
                        Action::Save | Action::Keep(_) | Action::Restart | Action::Bootloader | Action::Samples => {
                            Ok(Reply::Done)
                        }
                    });
                    session.answered(result)
                }
            };
            let mut frame = encode(&answer, &mut [0; FRAME_BYTES]).expect("fits").to_vec();
            answers += 1;
            damage(answers, &mut frame);
            if line.write_all(&frame).is_err() {
                return;
            }
        }
    });
}

/// How long to wait for an answer of the board above, which comes at once.
const WAIT: Duration = Duration::from_millis(80);

fn client(damage: impl FnMut(u32, &mut Vec<u8>) + Send + 'static) -> Client<UnixStream> {
    let (here, there) = UnixStream::pair().expect("sockets");
    here.set_read_timeout(Some(Duration::from_millis(20))).expect("time-out");
    board(there, damage);
    Client::open_waiting(here, 5, WAIT).expect("session")
}

#[test]
fn a_session_arms_moves_reads_parameters_and_disarms() {
    let mut client = client(|_, _| ());
    let Ok(Reply::Version(version)) = client.ask(Command::Version) else { panic!("version") };
    assert_eq!(version.board, "test-board");
    assert_eq!(client.ask(Command::Get(Parameter::Gain)), Ok(Reply::Value(4.0)));
    assert_eq!(client.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(client.ask(Command::Generate(Generator::Hold { position_um: 10_000 })), Ok(Reply::Done));
    let Ok(Reply::Status(status)) = client.ask(Command::Status) else { panic!("status") };
    assert_eq!((status.state.as_str(), status.setpoint_um), ("run", 10_000));
    assert_eq!(client.ask(Command::Set(Parameter::Gain, 5.0)), Err(BoardError::Refused(Refusal::State)));
    assert_eq!(client.ask(Command::Disarm), Ok(Reply::Done));
}

#[test]
fn answers_that_are_lost_or_damaged_are_asked_for_again_and_nothing_is_done_twice() {
    let mut client = client(|count, frame| match count % 3 {
        1 => {}
        2 => frame.clear(),
        _ => frame[4] ^= 0x10,
    });
    // Were it carried out twice, the second arming would be refused.
    assert_eq!(client.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(client.ask(Command::Disarm), Ok(Reply::Done));
}

#[test]
fn a_silent_board_is_reported_as_such() {
    let (here, _there) = UnixStream::pair().expect("sockets");
    here.set_read_timeout(Some(Duration::from_millis(20))).expect("time-out");
    assert!(matches!(Client::open_waiting(here, 1, WAIT).map(|_| ()), Err(BoardError::Silent)));
}

#[test]
fn a_rig_file_is_applied_as_a_whole_and_what_it_does_not_say_stays() {
    use Parameter as P;
    let mut client = client(|_, _| ());
    transfer::change(&mut client, &[(P::Gain, 7.5), (P::Monitor, 1.0)]).expect("accepted");
    let rig = RigFile::paper_c();
    let before = transfer::read(&mut client).expect("answers");
    let found = from_rig::from_rig(&rig, &before).expect("possible");
    assert_eq!(found.notes, Vec::<String>::new());
    let changed = transfer::change(&mut client, &found.changes).expect("accepted");
    assert!(changed.iter().any(|(parameter, _)| *parameter == P::Area), "{changed:?}");
    let after = transfer::read(&mut client).expect("answers");
    assert_eq!((after.get(P::Gain), after.get(P::Monitor)), (7.5, 1.0));
    assert_eq!(after.get(P::Stroke), rig.rig.cylinder.stroke_m as f32);
    assert_eq!(after.get(P::PositionLow), rig.io.position_range_m[0] as f32);
    // The range of the setpoint was as wide as the sensor's, and still is.
    assert_eq!(after.get(P::SetpointLow), rig.io.position_range_m[0] as f32);
    // Once more: nothing is left to change.
    assert_eq!(transfer::change(&mut client, &found.changes), Ok(vec![]));
}

#[test]
fn every_rig_file_of_the_project_can_be_applied() {
    let mut client = client(|_, _| ());
    for entry in std::fs::read_dir(root().join("rigs")).expect("rigs") {
        let path = entry.expect("a file").path();
        let rig = RigFile::read(&path).expect("readable");
        let before = transfer::read(&mut client).expect("answers");
        let found = from_rig::from_rig(&rig, &before).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let done = transfer::change(&mut client, &found.changes);
        assert!(done.is_ok(), "{}: {done:?}", path.display());
        println!("{}: {:?}", path.display(), found.notes);
    }
}

#[test]
fn what_a_diagnosis_found_goes_into_the_numbers_of_the_board() {
    use plant_model::effects::Effect;
    let mut rig = RigFile::paper_a();
    rig.effects.set(Effect::PayloadMass, &[14.0]);
    rig.effects.set(Effect::FillCoefficient, &[0.5]);
    rig.effects.set(Effect::CoulombFriction, &[2.0]);
    rig.effects.set(Effect::ValveDeadZone, &[0.4, -0.3]);
    rig.effects.set(Effect::LeakCrossPiston, &[1.0e-10]);
    let found = from_rig::from_rig(&rig, &Settings::default()).expect("possible");
    let value = |parameter| found.changes.iter().find(|(p, _)| *p == parameter).map(|(_, value)| *value);
    assert_eq!(value(Parameter::Mass), Some(14.0));
    assert_eq!(value(Parameter::FillCoefficient), Some((0.5 * 0.69501e-8) as f32));
    assert_eq!(value(Parameter::Coulomb), Some((2.0 * 23.103) as f32));
    assert_eq!(value(Parameter::StaticFriction), value(Parameter::Coulomb));
    assert_eq!((value(Parameter::DeadZoneRight), value(Parameter::DeadZoneLeft)), (Some(0.4), Some(-0.3)));
    assert!(matches!(&found.notes[..], [note] if note.contains("leak-cross-piston")), "{:?}", found.notes);
}

#[test]
fn a_refusal_names_the_key_that_stands_in_the_way_its_value_and_the_remedy() {
    let mut client = client(|_, _| ());
    for (changes, words) in [
        (&[(Parameter::PositionLow, -0.2)][..], &["`setpoint_low_m` = -0.5", "position_range_m", "at once"][..]),
        (&[(Parameter::Coulomb, 30.0)], &["`static_n` = 24", "coulomb_n"]),
        (
            &[(Parameter::FillConductance, 2.0e-8)],
            &["`fill_coefficient_kg_per_s_pa` = 0.0000000069501", "conductances"],
        ),
        (&[(Parameter::Gain, -1.0)], &["`gain_v_per_m` = -1", "0 to 10000"]),
    ] {
        let Err(TransferError::Refused(text)) = transfer::change(&mut client, changes) else {
            panic!("{changes:?} must be refused")
        };
        for word in words {
            assert!(text.contains(word), "{changes:?}: expected {word:?} in {text}");
        }
    }
}

#[test]
fn a_line_that_breaks_at_any_frame_of_a_change_leaves_the_old_parameters() {
    let changes = [
        (Parameter::PositionLow, -0.2),
        (Parameter::PositionHigh, 0.2),
        (Parameter::SetpointLow, -0.2),
        (Parameter::SetpointHigh, 0.2),
    ];
    for stages in 0..changes.len() {
        let mut client = client(|_, _| ());
        let before = transfer::read(&mut client).expect("answers");
        assert_eq!(client.ask(Command::Begin), Ok(Reply::Done));
        for (parameter, value) in &changes[..stages] {
            assert_eq!(client.ask(Command::Stage(*parameter, *value)), Ok(Reply::Done));
        }
        assert_eq!(transfer::read(&mut client), Ok(before));
        // Whoever comes next begins anew.
        assert_eq!(transfer::change(&mut client, &changes).map(|changed| changed.len()), Ok(changes.len()));
    }
    // Some answers are lost: asked for again, nothing is done twice or left out.
    let mut lossy = client(|count, frame| {
        if count % 16 == 5 {
            frame.clear();
        }
    });
    assert_eq!(transfer::change(&mut lossy, &changes).map(|changed| changed.len()), Ok(changes.len()));
}

#[test]
fn what_is_written_to_a_file_can_be_applied_to_another_board() {
    let mut first = client(|_, _| ());
    let settings = transfer::read(&mut first).expect("answers");
    let found = from_rig::from_rig(&RigFile::paper_b(), &settings).expect("possible");
    transfer::change(&mut first, &found.changes).expect("accepted");
    let settings = transfer::read(&mut first).expect("answers");
    let text = parameter_file::text(&settings, "a test");
    let mut second = client(|_, _| ());
    transfer::change(&mut second, &parameter_file::parse(&text, "p.toml").expect("readable")).expect("accepted");
    assert_eq!(transfer::read(&mut second), Ok(settings));
}
