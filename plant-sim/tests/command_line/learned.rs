//! What the positioning law learns: shown, frozen without motion, kept over power-off only by command, never beyond its limits.

use crate::simulated_board::{Line, Simulated};
use board_link::{Command, Generator, KeptError, LearnedValues, Parameter, Refusal, Reply};
use control::Quantity;
use firmware_core::Kept;
use plant_sim::board::{BoardError, Client};
use plant_sim::commission::{from_rig, transfer};
use plant_sim::{ClosedLoop, LoopSettings, controller};
use rig_files::RigFile;
use std::cell::RefCell;
use std::rc::Rc;

struct Bench {
    board: Rc<RefCell<Simulated>>,
    client: Client<Line>,
}

impl Bench {
    /// A board that was told what the rig file says, at a rig that differs from it, idle.
    fn new() -> Self {
        let mut stated = RigFile::paper_b();
        (stated.rig.valve.dead_zone_right_v, stated.rig.valve.dead_zone_left_v) = (0.42, -0.42);
        let mut truth = stated.clone();
        truth.rig.valve.fill_coefficient_kg_per_s_pa *= 0.8;
        truth.rig.valve.exhaust_coefficient_kg_per_s_pa *= 0.8;
        truth.rig.friction.coulomb_n *= 1.2;
        truth.rig.friction.static_n *= 1.2;
        let board = Rc::new(RefCell::new(Simulated::new(&truth)));
        // With which docs/control-law.md measures: the valve is silent at rest.
        board.borrow_mut().noise = [2.0e-5, 400.0, 400.0, 400.0];
        let mut client = Client::open(Line(Rc::clone(&board)), 1).expect("a session");
        let present = transfer::read(&mut client).expect("answers");
        let mut changes = from_rig::from_rig(&stated, &present).expect("a rig").changes;
        // The monitor does not know that the rig differs.
        changes.extend([(Parameter::Law, 1.0), (Parameter::Monitor, 0.0)]);
        transfer::change(&mut client, &changes).expect("taken");
        client.ask(Command::Save).expect("saved");
        board.borrow_mut().run(300);
        Self { board, client }
    }

    fn ask(&mut self, command: Command) -> Result<Reply, BoardError> {
        self.client.ask(command)
    }

    fn done(&mut self, command: Command) {
        assert_eq!(self.ask(command), Ok(Reply::Done), "{command:?}");
    }

    fn learned(&mut self) -> LearnedValues {
        match self.ask(Command::Learned) {
            Ok(Reply::Learned(values)) => values,
            other => panic!("{other:?}"),
        }
    }

    /// Moves there and back and ends idle, at rest.
    fn moves(&mut self) {
        self.done(Command::Arm);
        for position_um in [50_000, -50_000, 30_000, 0] {
            self.done(Command::Generate(Generator::Hold { position_um }));
            self.board.borrow_mut().run(1500);
        }
        self.done(Command::Disarm);
    }
}

#[test]
fn what_is_learned_is_forgotten_at_a_restart_unless_it_was_kept_by_command() {
    let mut bench = Bench::new();
    let fresh = bench.learned();
    assert_eq!((fresh.kept, fresh.refused), (None, None));
    bench.moves();
    let learned = bench.learned();
    println!("{fresh:?}\n{learned:?}");
    // Both flows and the friction have come nearer to the rig's: 0.8, 0.8 and 1.2 of what the file says.
    for (index, truth) in [(0, 0.8), (1, 0.8), (5, 1.2)] {
        let off = |values: &LearnedValues| (values.now[index] / fresh.nominal[index] - truth).abs();
        assert!(off(&learned) < 0.8 * off(&fresh), "{}: {learned:?}", Quantity::ALL[index].name());
    }
    // Saving the parameters does not keep it.
    bench.done(Command::Save);
    bench.done(Command::Restart);
    assert_eq!(bench.learned(), fresh);

    bench.moves();
    let learned = bench.learned();
    bench.done(Command::Keep);
    assert_eq!(bench.learned(), LearnedValues { kept: Some(learned.now), ..learned });
    bench.done(Command::Restart);
    assert_eq!(bench.learned(), LearnedValues { kept: Some(learned.now), ..learned }, "begun with, to the last bit");
    // And a run really begins there: it learns on from the first tick, by a hundredth or two, and without what was kept it would begin at 1.
    bench.done(Command::Arm);
    assert!((bench.learned().now[0] - learned.now[0]).abs() < 0.05);
    bench.done(Command::Disarm);

    bench.done(Command::Forget);
    bench.done(Command::Restart);
    assert_eq!(bench.learned(), fresh);
}

#[test]
fn nothing_is_learned_while_the_piston_rests() {
    let mut bench = Bench::new();
    let fresh = bench.learned();
    bench.done(Command::Arm);
    bench.done(Command::Generate(Generator::Hold { position_um: 50_000 }));
    bench.board.borrow_mut().run(2500);
    let moved = bench.learned();
    assert_ne!(moved.now, fresh.now);
    bench.board.borrow_mut().run(3000);
    assert_eq!(bench.learned(), moved);
}

#[test]
fn what_is_learned_changes_only_while_the_valve_acts() {
    // Longer than lag, delay and the force's correction take to die away: ten time constants of the slowest, 375/s.
    const BEHIND: u32 = 30;
    for rig in [RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()] {
        let parameters = controller::parameters(&rig);
        let mut positioner = ClosedLoop::new(&rig, &parameters, &LoopSettings::default()).expect("valid");
        let (mut code, mut silent, mut checked) = (0, 0, 0);
        let mut before = positioner.learned().expect("the positioning law").now;
        for tick in 0..10_000 {
            let seen = positioner.tick(0.04);
            silent = if seen.dac == code { silent + 1 } else { 0 };
            code = seen.dac;
            let now = positioner.learned().expect("the positioning law").now;
            if silent > BEHIND {
                checked += 1;
                assert_eq!(now, before, "{}, tick {tick}", rig.name);
            }
            before = now;
        }
        assert!(checked > 5000, "{}: the valve is silent in {checked} ticks", rig.name);
    }
}

#[test]
fn what_is_kept_is_refused_with_other_parameters_of_the_rig_and_beyond_the_limits() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(Command::Keep), Err(BoardError::Refused(Refusal::NothingLearned)));
    let fresh = bench.learned();
    bench.moves();
    let kept = bench.learned().now;
    bench.done(Command::Keep);

    let Ok(Reply::Value(friction)) = bench.ask(Command::Get(Parameter::ServoCoulomb)) else { panic!("a value") };
    bench.done(Command::Set(Parameter::ServoCoulomb, 1.1 * friction));
    bench.done(Command::Save);
    bench.done(Command::Restart);
    let other = bench.learned();
    assert_eq!((other.kept, other.refused), (Some(kept), Some(KeptError::OtherParameters)));
    assert_eq!(other.now[..4], fresh.now[..4], "nominal values");
    // The parameter is set right again: so is what was kept.
    bench.done(Command::Set(Parameter::ServoCoulomb, friction));
    let again = bench.learned();
    assert_eq!((again.now, again.refused), (kept, None));
    bench.done(Command::Save);

    for quantity in Quantity::ALL {
        let index = usize::from(quantity.number());
        let nominal = fresh.nominal[index];
        let beyond = match quantity.limits() {
            Some([least, most]) => [0.99 * least as f32 * nominal, 1.01 * most as f32 * nominal],
            // More than the supply holds, in m/s2.
            None => [-1000.0, 1000.0],
        };
        for beyond in beyond {
            let mut values = kept;
            values[index] = beyond;
            {
                let mut board = bench.board.borrow_mut();
                let rig = board.flash.rig_check();
                board.flash.kept = Some(Kept { rig, values });
                board.restart();
            }
            let found = bench.learned();
            assert_eq!(found.refused, Some(KeptError::Limits(quantity.number())), "{} {beyond}", quantity.name());
            assert_eq!(found.now, fresh.now);
        }
    }
}
