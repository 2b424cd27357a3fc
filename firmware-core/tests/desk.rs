//! The whole firmware without hardware: requests at the desk, orders to the loop, the simulated plant on the bench.

use board_link::{Command, Generator, Parameter, ParameterError, Refusal, Reply, Shape};
use control::{ExternalFaults, Mode, Reason};
use firmware_core::{Action, ControlLoop, Desk, OrderOutcome, Progress, Settings, Snapshot, Supervisor, Verdict};

/// Codes of a piston at mid-stroke with both chambers at 3.618 bar and 7 bar supply, with a little noise.
fn at_rest(tick: u32) -> [u16; 4] {
    let noise = (tick.wrapping_mul(2_654_435_761) >> 29) as u16;
    [32_767 + noise, 23_710 + noise, 23_712 + noise, 45_870 + noise]
}

struct Board {
    desk: Desk,
    control_loop: ControlLoop,
    snapshot: Snapshot,
    valve: u16,
}

impl Board {
    fn new() -> Self {
        let settings = Settings::default();
        let setup = settings.setup().expect("defaults fit together");
        Self {
            control_loop: ControlLoop::new(setup, None),
            desk: Desk::new(settings, "desk-test", "0.0.0", "".try_into().expect("empty")),
            snapshot: Snapshot::new(),
            valve: 0,
        }
    }

    fn run(&mut self, ticks: u32, mut codes: impl FnMut(u32) -> [u16; 4]) {
        for tick in 0..ticks {
            let tick = self.control_loop.tick(codes(tick), ExternalFaults::default(), true);
            self.control_loop.conclude();
            self.valve = tick.valve;
            self.snapshot.publish(&tick.record, &self.control_loop);
        }
    }

    fn ask(&mut self, command: Command) -> Result<Reply, Refusal> {
        match self.desk.decide(command, &self.snapshot, 0)? {
            Action::Reply(reply) => Ok(reply),
            Action::Order(order, outcome) => {
                self.control_loop.order(&order);
                let tick = self.control_loop.tick(at_rest(0), ExternalFaults::default(), true);
                self.snapshot.publish(&tick.record, &self.control_loop);
                if outcome.shown_by(self.snapshot.mode()) { Ok(Reply::Done) } else { Err(Refusal::State) }
            }
            Action::Keep(kept) => {
                self.desk.keep(kept);
                Ok(Reply::Done)
            }
            Action::Save | Action::Restart | Action::Bootloader | Action::Samples => Ok(Reply::Done),
        }
    }

    fn idle() -> Self {
        let mut board = Self::new();
        board.run(200, at_rest);
        assert_eq!(board.snapshot.mode(), Mode::Idle);
        board
    }
}

#[test]
fn a_board_boots_to_idle_is_armed_moves_and_is_disarmed() {
    let mut board = Board::idle();
    let mid = board.valve;
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 50_000 })), Ok(Reply::Done));
    board.run(2, at_rest);
    // 4 V/m times 50 mm is 0.2 V, 82 codes of 2.44 mV.
    assert!(board.valve.abs_diff(mid + 82) <= 2, "{} {}", board.valve, mid);
    assert_eq!(board.ask(Command::Disarm), Ok(Reply::Done));
    board.run(1, at_rest);
    assert_eq!(board.valve, mid);
}

#[test]
fn commands_are_refused_in_the_wrong_state() {
    let mut board = Board::new();
    assert_eq!(board.ask(Command::Arm), Err(Refusal::State));
    let mut board = Board::idle();
    assert_eq!(board.ask(Command::Disarm), Err(Refusal::State));
    assert_eq!(board.ask(Command::Acknowledge), Err(Refusal::State));
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    for command in [
        Command::Arm,
        Command::Set(Parameter::Gain, 5.0),
        Command::Defaults,
        Command::Save,
        Command::Keep,
        Command::Forget,
        Command::Bench { on: true },
        Command::Restart,
        Command::Bootloader,
    ] {
        assert_eq!(board.ask(command), Err(Refusal::State), "{command:?}");
    }
    assert_eq!(board.snapshot.mode(), Mode::Run);
}

#[test]
fn a_refused_parameter_changes_nothing() {
    let mut board = Board::idle();
    let before = board.desk.settings().clone();
    assert!(board.ask(Command::Set(Parameter::Gain, f32::NAN)).is_err());
    assert!(board.ask(Command::Set(Parameter::Gain, -1.0)).is_err());
    assert_eq!(board.ask(Command::Set(Parameter::PositionLow, 0.6)), refused_for(Parameter::PositionHigh));
    assert_eq!(board.ask(Command::Set(Parameter::StaticFriction, 1.0)), refused_for(Parameter::StaticFriction));
    // Another parameter stands in the way of this one.
    assert_eq!(board.ask(Command::Set(Parameter::PositionLow, -0.2)), refused_for(Parameter::SetpointLow));
    assert_eq!(board.desk.settings(), &before);
}

fn refused_for(key: Parameter) -> Result<Reply, Refusal> {
    Err(Refusal::Configuration(Some(key)))
}

/// Begins, stages, and says what came of applying.
fn at_once(board: &mut Board, changes: &[(Parameter, f32)]) -> Result<Reply, Refusal> {
    assert_eq!(board.ask(Command::Begin), Ok(Reply::Done));
    for (parameter, value) in changes {
        assert_eq!(board.ask(Command::Stage(*parameter, *value)), Ok(Reply::Done));
    }
    board.ask(Command::Apply)
}

#[test]
fn parameters_that_belong_together_change_at_once_in_any_order_or_not_at_all() {
    use Parameter as P;
    let mut board = Board::idle();
    let before = board.desk.settings().clone();
    // In this order each but the last would be refused alone.
    let shorter = [
        (P::PositionLow, -0.2),
        (P::PositionHigh, 0.2),
        (P::SetpointLow, -0.2),
        (P::SetpointHigh, 0.2),
        (P::StaticFriction, 12.0),
        (P::Coulomb, 10.0),
        (P::Breakaway, 1.0e-5),
    ];
    let mut wrong = shorter.to_vec();
    wrong.push((P::Coulomb, 15.0));
    assert_eq!(at_once(&mut board, &wrong), refused_for(P::StaticFriction));
    assert_eq!(board.desk.settings(), &before);
    assert_eq!(at_once(&mut board, &shorter), Ok(Reply::Done));
    for (parameter, value) in shorter {
        assert_eq!(board.ask(Command::Get(parameter)), Ok(Reply::Value(value)));
    }
}

#[test]
fn a_change_that_is_not_finished_changes_nothing() {
    let mut board = Board::idle();
    let before = board.desk.settings().clone();
    assert_eq!(board.ask(Command::Stage(Parameter::Gain, 5.0)), Err(Refusal::NotBegun));
    assert_eq!(board.ask(Command::Begin), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Stage(Parameter::Gain, 5.0)), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Stage(Parameter::Gain, -1.0)), Err(Refusal::Parameter(ParameterError::Range)));
    assert_eq!(board.desk.settings(), &before);
    // Another change in between: the first one began from values that are gone.
    assert_eq!(board.ask(Command::Set(Parameter::TelemetryEvery, 5.0)), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Apply), Err(Refusal::NotBegun));
    board.run(200, at_rest);
    // While running neither begins nor ends anything.
    assert_eq!(board.ask(Command::Begin), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Begin), Err(Refusal::State));
    assert_eq!(board.ask(Command::Apply), Err(Refusal::State));
    assert_eq!(board.ask(Command::Get(Parameter::Gain)), Ok(Reply::Value(4.0)));
}

#[test]
fn a_setpoint_given_before_arming_does_not_move_the_piston_when_armed() {
    let mut board = Board::idle();
    let mid = board.valve;
    assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 400_000 })), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    board.run(10, at_rest);
    assert!(board.valve.abs_diff(mid) <= 2, "{} {}", board.valve, mid);
}

#[test]
fn a_bare_board_with_floating_inputs_runs_on_the_bench_and_positions_the_simulated_piston() {
    let mut board = Board::new();
    board.run(300, |_| [0, 0, 0, 0]);
    assert!(matches!(board.snapshot.mode(), Mode::Safe(Reason::Range(_))));
    assert_eq!(board.ask(Command::Bench { on: true }), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Acknowledge), Ok(Reply::Done));
    board.run(300, |_| [0, 0, 0, 0]);
    assert_eq!(board.snapshot.mode(), Mode::Idle);
    let mid = board.valve;
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 45_000 })), Ok(Reply::Done));
    board.run(8_000, |_| [0, 0, 0, 0]);
    let position_m = f64::from(board.snapshot.read().codes[0]) / 65_535.0 - 0.5;
    assert!((position_m - 0.045).abs() < 0.010, "{position_m}");
    assert_eq!(board.snapshot.mode(), Mode::Run);
    assert_eq!(board.valve, mid, "the real valve stays at mid on the bench");
}

#[test]
fn bench_mode_is_reached_from_safe_by_a_board_whose_inputs_have_been_noisy() {
    let mut board = Board::new();
    // The noise of the inputs is known by then; the simulated sensors have none.
    board.run(600, at_rest);
    board.run(100, |_| [0, 0, 0, 0]);
    assert!(matches!(board.snapshot.mode(), Mode::Safe(Reason::Range(_))));
    assert_eq!(board.ask(Command::Bench { on: true }), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Acknowledge), Ok(Reply::Done));
    board.run(300, at_rest);
    assert_eq!(board.snapshot.mode(), Mode::Idle);
}

#[test]
fn every_generator_stays_within_its_bounds_and_starts_where_it_should() {
    let mut board = Board::idle();
    assert_eq!(board.ask(Command::Bench { on: true }), Ok(Reply::Done));
    for generator in [Shape::Step, Shape::Ramp, Shape::Sine, Shape::Identification].map(|shape| Generator::Repeat {
        shape,
        centre_um: 0,
        amplitude_um: 100_000,
        period_ms: 40_000,
    }) {
        board.run(300, at_rest);
        assert_eq!(board.snapshot.mode(), Mode::Idle, "before {generator:?}");
        assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
        assert_eq!(board.ask(Command::Generate(generator)), Ok(Reply::Done));
        let mut extremes = [i32::MAX, i32::MIN];
        for tick in 0..45_000 {
            board.run(1, |_| at_rest(tick));
            let um = board.snapshot.read().setpoint_um;
            extremes = [extremes[0].min(um), extremes[1].max(um)];
        }
        assert!(extremes[0] >= -100_001 && extremes[1] <= 100_001, "{generator:?}: {extremes:?}");
        assert!(extremes[1] >= 95_000, "{generator:?}: {extremes:?}");
        assert_eq!(board.ask(Command::Disarm), Ok(Reply::Done));
    }
}

#[test]
fn malformed_generators_are_refused() {
    let mut board = Board::idle();
    for generator in [
        Generator::Hold { position_um: i32::MIN },
        Generator::Repeat { shape: Shape::Step, centre_um: 0, amplitude_um: 1, period_ms: 0 },
        Generator::Repeat { shape: Shape::Ramp, centre_um: 0, amplitude_um: 1, period_ms: u32::MAX },
        Generator::Repeat { shape: Shape::Sine, centre_um: i32::MAX, amplitude_um: i32::MAX, period_ms: 1000 },
        Generator::Repeat { shape: Shape::Sine, centre_um: 0, amplitude_um: -1, period_ms: 1000 },
    ] {
        assert!(matches!(board.ask(Command::Generate(generator)), Err(Refusal::Generator(_))), "{generator:?}");
    }
}

#[test]
fn a_jammed_valve_is_found_by_the_monitor_within_20_ms_of_the_command() {
    let mut board = Board::idle();
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    // The valve is told to open by 0.8 V, and nothing happens in the cylinder.
    assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 200_000 })), Ok(Reply::Done));
    let mut ticks = 0;
    while board.snapshot.mode() == Mode::Run && ticks < 1000 {
        board.run(1, |_| at_rest(ticks));
        ticks += 1;
    }
    println!("tripped after {ticks} ticks");
    assert_eq!(board.snapshot.mode(), Mode::Safe(Reason::ModelDisagreement));
    assert!(ticks <= 20, "{ticks}");
}

#[test]
fn the_watchdog_is_fed_only_when_sampling_control_and_communication_all_move() {
    let all = Progress { sampling: 5, control: 5, communication: [1, 1] };
    assert_eq!(Supervisor::default().check(all), Verdict::Feed);
    for stopped in [
        Progress { sampling: 0, ..all },
        Progress { control: 0, ..all },
        Progress { communication: [0, 1], ..all },
        Progress { communication: [1, 0], ..all },
    ] {
        assert_ne!(Supervisor::default().check(stopped), Verdict::Feed, "{stopped:?}");
    }
}

#[test]
fn a_loop_that_stops_is_dead_after_two_checks_and_stays_dead() {
    let mut supervisor = Supervisor::default();
    let mut now = Progress { sampling: 5, control: 5, communication: [1, 1] };
    assert_eq!(supervisor.check(now), Verdict::Feed);
    now.communication = [2, 2];
    assert_eq!(supervisor.check(now), Verdict::Wait);
    now.communication = [3, 3];
    assert_eq!(supervisor.check(now), Verdict::LoopDead);
    now.sampling += 1;
    now.control += 1;
    now.communication = [4, 4];
    assert_eq!(supervisor.check(now), Verdict::LoopDead);
}

#[test]
fn an_order_that_was_not_carried_out_is_not_called_done() {
    assert!(!OrderOutcome::Running.shown_by(Mode::Idle));
    assert!(!OrderOutcome::NotSafe.shown_by(Mode::Safe(Reason::Overrun)));
}

#[test]
fn a_monitor_that_only_warns_counts_and_reports_the_beginning_of_a_contradiction_and_goes_on() {
    let mut board = Board::idle();
    assert_eq!(board.ask(Command::Set(Parameter::Monitor, 1.0)), Ok(Reply::Done));
    board.run(300, at_rest);
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 200_000 })), Ok(Reply::Done));
    let mut reports = 0;
    for tick in 0..100 {
        let tick = board.control_loop.tick(at_rest(tick), ExternalFaults::default(), true);
        reports += u32::from(tick.record.event && tick.record.disagreement);
        assert!(tick.record_due || !tick.record.event);
        board.control_loop.conclude();
    }
    assert_eq!((board.control_loop.mode(), reports), (Mode::Run, 1));
}

#[test]
fn the_monitors_tolerances_are_parameters_and_wide_ones_let_a_contradiction_pass() {
    let mut board = Board::idle();
    assert_eq!(
        board.ask(Command::Set(Parameter::MonitorPressure, 0.0)),
        Err(Refusal::Parameter(ParameterError::Range))
    );
    assert_eq!(board.ask(Command::Set(Parameter::MonitorPressure, 1.0e6)), Ok(Reply::Done));
    board.run(300, at_rest);
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 200_000 })), Ok(Reply::Done));
    board.run(1000, at_rest);
    assert_eq!(board.snapshot.mode(), Mode::Run);
}

#[test]
fn a_new_board_runs_with_the_defaults_that_the_controllers_page_lists() {
    let board = Settings::default().control_parameters();
    let listed = control::Parameters { setpoint_range_m: board.setpoint_range_m, ..control::Parameters::default() };
    assert_eq!(board, listed);
}

#[test]
fn a_tick_rate_for_the_next_start_must_fit_the_other_parameters_and_changes_nothing_before() {
    let mut board = Board::idle();
    // At 10 kHz this is less than a tick can add to the velocity.
    assert_eq!(board.ask(Command::Set(Parameter::SetpointAcceleration, 0.005)), Ok(Reply::Done));
    let refused = refused_for(Parameter::SetpointAcceleration);
    assert_eq!(board.ask(Command::Set(Parameter::TickHz, 10_000.0)), refused);
    assert_eq!(board.ask(Command::Get(Parameter::TickHz)), Ok(Reply::Value(1000.0)));
    assert_eq!(board.ask(Command::Set(Parameter::SetpointAcceleration, 0.0)), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Set(Parameter::TickHz, 10_000.0)), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Set(Parameter::SetpointAcceleration, 0.005)), refused);
    assert_eq!(board.desk.in_force().tick_hz(), 1000);
    assert_eq!(board.desk.settings().tick_hz(), 10_000);

    // The simulated plant lives at the timer's rate, too.
    let mut plain = Board::idle();
    for board in [&mut board, &mut plain] {
        assert_eq!(board.ask(Command::Bench { on: true }), Ok(Reply::Done));
        board.run(200, at_rest);
        assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
        assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 50_000 })), Ok(Reply::Done));
        board.run(100, at_rest);
    }
    assert_eq!(board.snapshot.read().codes, plain.snapshot.read().codes);
}

#[test]
fn only_what_the_positioning_law_has_learned_on_the_rig_itself_is_kept() {
    let mut board = Board::idle();
    for command in [Command::Learned, Command::Keep] {
        assert_eq!(board.ask(command), Err(Refusal::NothingLearned), "the paper's law: {command:?}");
    }
    assert_eq!(board.ask(Command::Set(Parameter::Law, 1.0)), Ok(Reply::Done));
    board.run(300, at_rest);
    let Ok(Reply::Learned(before)) = board.ask(Command::Learned) else { panic!("an answer") };
    assert_eq!((before.now[..5] == before.nominal[..5], before.kept, before.refused), (true, None, None));
    assert_eq!(board.ask(Command::Keep), Err(Refusal::NothingLearned), "it has not run");
    // On the bench it learns the simulated plant.
    assert_eq!(board.ask(Command::Bench { on: true }), Ok(Reply::Done));
    board.run(300, at_rest);
    assert_eq!(board.ask(Command::Arm), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Generate(Generator::Hold { position_um: 50_000 })), Ok(Reply::Done));
    board.run(600, at_rest);
    let Ok(Reply::Learned(after)) = board.ask(Command::Learned) else { panic!("an answer") };
    assert_ne!(after.now, before.now);
    assert_eq!(board.ask(Command::Disarm), Ok(Reply::Done));
    assert_eq!(board.ask(Command::Keep), Err(Refusal::State));
    assert_eq!(board.desk.settings().kept, None);
}
