//! Whatever arrives on the line, only a whole, intact, fresh request changes anything.

use board_link::{
    Accumulator, Admission, Command, FRAME_BYTES, FrameError, Generator, PROTOCOL_VERSION, Parameter, Refusal, Reply,
    Request, Response, Session, Shape, encode,
};
use proptest::prelude::*;

fn commands() -> impl Strategy<Value = Command> {
    let parameter = (0..Parameter::ALL.len()).prop_map(|index| Parameter::ALL[index]);
    prop_oneof![
        any::<u32>().prop_map(|nonce| Command::Hello { nonce }),
        Just(Command::Version),
        Just(Command::Status),
        Just(Command::Arm),
        Just(Command::Disarm),
        Just(Command::Acknowledge),
        any::<i32>().prop_map(|position_um| Command::Generate(Generator::Hold { position_um })),
        (any::<i32>(), any::<i32>(), any::<u32>()).prop_map(|(centre_um, amplitude_um, period_ms)| {
            Command::Generate(Generator::Repeat { shape: Shape::Sine, centre_um, amplitude_um, period_ms })
        }),
        parameter.clone().prop_map(Command::Get),
        (parameter.clone(), -1.0e9_f32..1.0e9).prop_map(|(key, value)| Command::Set(key, value)),
        Just(Command::Begin),
        (parameter, -1.0e9_f32..1.0e9).prop_map(|(key, value)| Command::Stage(key, value)),
        Just(Command::Apply),
        Just(Command::Save),
        Just(Command::Learned),
        Just(Command::Keep),
        Just(Command::Forget),
        any::<bool>().prop_map(|on| Command::Bench { on }),
        Just(Command::LastFault),
        Just(Command::Bootloader),
        Just(Command::Samples),
    ]
}

fn request(session: u32, sequence: u32, command: Command) -> Request {
    Request { version: PROTOCOL_VERSION, session, sequence, command }
}

fn frame(request: &Request) -> Vec<u8> {
    encode(request, &mut [0; FRAME_BYTES]).expect("requests are short").to_vec()
}

fn feed(accumulator: &mut Accumulator, bytes: &[u8]) -> Vec<Result<Request, FrameError>> {
    bytes.iter().filter_map(|byte| accumulator.push(*byte)).collect()
}

proptest! {
    #[test]
    fn a_request_survives_the_line(session: u32, sequence: u32, command in commands()) {
        let sent = request(session, sequence, command);
        prop_assert_eq!(feed(&mut Accumulator::new(), &frame(&sent)), vec![Ok(sent)]);
    }

    #[test]
    fn a_frame_cut_anywhere_is_no_request_and_the_next_one_arrives(
        command in commands(), next in commands(), keep in 0.0..1.0,
    ) {
        let cut = frame(&request(1, 1, command));
        // At least the closing zero is lost.
        let kept = ((cut.len() - 1) as f64 * keep) as usize;
        let mut accumulator = Accumulator::new();
        prop_assert!(feed(&mut accumulator, &cut[..kept]).is_empty());
        let whole = request(1, 2, next);
        let arrived = feed(&mut accumulator, &frame(&whole));
        prop_assert_eq!(arrived.last(), Some(&Ok(whole)));
        prop_assert!(arrived[..arrived.len() - 1].iter().all(Result::is_err));
    }

    #[test]
    fn a_flipped_bit_never_yields_another_request(command in commands(), place in 0.0..1.0, bit in 0..8_u32) {
        let sent = request(7, 9, command);
        let mut bytes = frame(&sent);
        let index = 1 + ((bytes.len() - 2) as f64 * place) as usize;
        bytes[index] ^= 1 << bit;
        for arrived in feed(&mut Accumulator::new(), &bytes).into_iter().flatten() {
            prop_assert_eq!(arrived, sent);
        }
    }

    #[test]
    fn noise_never_becomes_a_request(bytes in proptest::collection::vec(any::<u8>(), 0..2000)) {
        prop_assert!(feed(&mut Accumulator::new(), &bytes).iter().all(Result::is_err));
    }

    #[test]
    fn an_oversized_frame_is_refused_whole(length in FRAME_BYTES + 1..3 * FRAME_BYTES, command in commands()) {
        let mut accumulator = Accumulator::new();
        let mut bytes = vec![0x55; length];
        bytes.push(0);
        prop_assert_eq!(feed(&mut accumulator, &bytes), vec![Err(FrameError::TooLong)]);
        let whole = request(1, 2, command);
        prop_assert_eq!(feed(&mut accumulator, &frame(&whole)), vec![Ok(whole)]);
    }

    #[test]
    fn a_request_is_carried_out_once_however_often_it_arrives(copies in 1..10_usize, command in commands()) {
        prop_assume!(!matches!(command, Command::Hello { .. }));
        let mut session = Session::new();
        let number = open(&mut session);
        let sent = request(number, 5, command);
        let mut carried_out = 0;
        for _ in 0..copies {
            if let Admission::Execute(_) = session.admit(&sent, 0) {
                carried_out += 1;
                session.answered(Ok(Reply::Done));
            }
        }
        prop_assert_eq!(carried_out, 1);
    }

    #[test]
    fn a_recorded_request_does_nothing_later(old in commands(), gap in 1..1000_u32) {
        prop_assume!(!matches!(old, Command::Hello { .. }));
        let mut session = Session::new();
        let number = open(&mut session);
        prop_assert!(matches!(session.admit(&request(number, 10 + gap, Command::Status), 0), Admission::Execute(_)));
        session.answered(Ok(Reply::Done));
        let refused = |admission| matches!(admission, Admission::Answer(Response { result: Err(_), .. }));
        prop_assert!(refused(session.admit(&request(number, 10, old), 0)));
        let second = open(&mut session);
        prop_assert_ne!(number, second);
        prop_assert!(refused(session.admit(&request(number, 10 + gap + 1, old), 0)));
    }
}

fn open(session: &mut Session) -> u32 {
    match session.admit(&request(0, 0, Command::Hello { nonce: 3 }), 12345) {
        Admission::Answer(Response { session, result: Ok(Reply::Done), .. }) => session,
        other => panic!("hello must be answered: {other:?}"),
    }
}

#[test]
fn another_protocol_version_is_refused_by_name_and_changes_nothing() {
    let mut session = Session::new();
    let number = open(&mut session);
    let foreign = Request { version: PROTOCOL_VERSION + 1, ..request(number, 1, Command::Arm) };
    let Admission::Answer(answer) = session.admit(&foreign, 0) else { panic!("must not be carried out") };
    assert_eq!(answer.result, Err(Refusal::Version));
    assert_eq!(answer.version, PROTOCOL_VERSION);
}

#[test]
fn a_lost_answer_can_be_had_again() {
    let mut session = Session::new();
    let number = open(&mut session);
    let ask = request(number, 1, Command::Get(Parameter::Gain));
    assert!(matches!(session.admit(&ask, 0), Admission::Execute(Command::Get(Parameter::Gain))));
    let first = session.answered(Ok(Reply::Value(4.0)));
    assert_eq!(session.admit(&ask, 0), Admission::Answer(first));
}

#[test]
fn the_longest_answer_fits_a_frame() {
    let text = core::iter::repeat_n('x', 160).collect::<String>();
    let longest = Response {
        version: PROTOCOL_VERSION,
        session: u32::MAX,
        sequence: u32::MAX,
        result: Ok(Reply::Text(text.as_str().try_into().expect("160 bytes"))),
    };
    assert!(encode(&longest, &mut [0; FRAME_BYTES]).is_ok());
    let sample = board_link::Sample { tick: u32::MAX, codes: [u16::MAX; 4], held: u16::MAX, mode: u16::MAX };
    let samples =
        Response { result: Ok(Reply::Samples(core::iter::repeat_n(sample, board_link::SAMPLES).collect())), ..longest };
    assert!(encode(&samples, &mut [0; FRAME_BYTES]).is_ok());
    let all = [f32::MAX; control::QUANTITIES];
    let refused = Some(board_link::KeptError::Limits(u8::MAX));
    let learned = board_link::LearnedValues { now: all, nominal: all, kept: Some(all), refused };
    assert!(encode(&Response { result: Ok(Reply::Learned(learned)), ..samples }, &mut [0; FRAME_BYTES]).is_ok());
}

#[test]
fn parameters_have_distinct_names_and_numbers_and_admissible_defaults() {
    for (index, parameter) in Parameter::ALL.into_iter().enumerate() {
        let info = parameter.info();
        assert_eq!(parameter.check(info.default), Ok(()), "{}", info.name);
        assert!(
            !info.limits.optional || info.limits.low > 0.0,
            "{}: 0 cannot both be a value and mean none",
            info.name
        );
        assert_eq!(Parameter::from_number(parameter.number()), Some(parameter));
        assert_eq!(Parameter::from_name(info.name), Some(parameter));
        assert!(parameter.check(f32::NAN).is_err());
        assert!(Parameter::ALL[..index].iter().all(|other| other.number() < parameter.number()), "{}", info.name);
    }
}
