//! The desktop talks to the firmware's own desk and control loop, over a line that loses and damages frames.

use board_link::{
    Accumulator, Admission, Command, FRAME_BYTES, Generator, Parameter, Refusal, Reply, Request, Session, encode,
};
use control::ExternalFaults;
use firmware_core::{Action, ControlLoop, Desk, Settings, Snapshot};
use plant_sim::board::{BoardError, Client};
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
                control_loop.watch();
                snapshot.publish(&tick.record, control_loop.bench());
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
                    snapshot_now.publish(&tick.record, control_loop.bench());
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
                        Action::Save | Action::Restart => Ok(Reply::Done),
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

fn client(damage: impl FnMut(u32, &mut Vec<u8>) + Send + 'static) -> Client<UnixStream> {
    let (here, there) = UnixStream::pair().expect("sockets");
    here.set_read_timeout(Some(Duration::from_millis(20))).expect("time-out");
    board(there, damage);
    Client::open(here, 5).expect("session")
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
    assert!(matches!(Client::open(here, 1).map(|_| ()), Err(BoardError::Silent)));
}
