//! Calibration and the search for the dead zone, on a board with a simulated cylinder.

use crate::simulated_board::{Line, Simulated};
use board_link::Parameter;
use plant_sim::board::Client;
use plant_sim::commission::calibrate::{Calibration, CalibrationError, Channel, measure};
use plant_sim::commission::dead_zone::{Search, SearchError, search};
use plant_sim::commission::observe::{self, status};
use plant_sim::commission::{from_rig, transfer};
use rig_files::RigFile;
use std::cell::RefCell;
use std::rc::Rc;

fn board(rig: &RigFile) -> (Rc<RefCell<Simulated>>, Client<Line>) {
    let board = Rc::new(RefCell::new(Simulated::new(rig)));
    let client = Client::open(Line(Rc::clone(&board)), 1).expect("a session");
    (board, client)
}

fn place(board: &Rc<RefCell<Simulated>>, rig: &RigFile, y_m: f64, p_pa: [f64; 2]) {
    board.borrow_mut().place(rig, y_m, p_pa);
}

fn implausible<T: std::fmt::Debug>(result: Result<T, CalibrationError>) -> String {
    match result {
        Err(CalibrationError::Implausible(sentence)) => sentence,
        other => panic!("must be refused: {other:?}"),
    }
}

#[test]
fn two_points_make_the_reading_of_a_sensor_right_over_its_whole_range() {
    let rig = RigFile::paper_a();
    let (board, mut client) = board(&rig);
    board.borrow_mut().sensors = [[0.012, 0.96], [8.0e3, 1.03], [-5.0e3, 0.98], [2.0e3, 1.01]];
    let p = rig.rig.equilibrium_pressure_pa();
    let points = [-0.3, 0.25].map(|y_m| {
        place(&board, &rig, y_m, [p, p]);
        measure(&mut client, Channel::Position, y_m).expect("at rest")
    });
    let settings = transfer::read(&mut client).expect("answers");
    let found = Calibration::of(&settings, Channel::Position, points).expect("plausible");
    println!("{found:?}");
    transfer::change(&mut client, &found.changes(&settings)).expect("fits together");

    let settings = transfer::read(&mut client).expect("answers");
    for y_m in [-0.4, 0.0, 0.35] {
        place(&board, &rig, y_m, [p, p]);
        let seen = observe::ticks(&mut client, 300).expect("answers").quantity(&settings, 0).mean;
        assert!((seen - y_m).abs() < 1.0e-4, "{seen} at {y_m}");
    }
    // The range of the setpoint was as wide as the sensor's, and still is.
    let [[low, high], ..] = settings.control_parameters().calibrated_ranges();
    assert_eq!(
        [settings.get(Parameter::SetpointLow), settings.get(Parameter::SetpointHigh)],
        [low as f32, high as f32]
    );

    // Another channel: the first one keeps its own.
    // Half a DAC code lets air through, the more the higher the pressure; from 6 bar it is refused as a drift.
    let points = [1.5e5, 3.5e5].map(|p_a| {
        place(&board, &rig, 0.0, [p_a, p_a]);
        measure(&mut client, Channel::PressureB, p_a).expect("at rest")
    });
    let found = Calibration::of(&settings, Channel::PressureB, points).expect("plausible");
    transfer::change(&mut client, &found.changes(&settings)).expect("fits together");
    let settings = transfer::read(&mut client).expect("answers");
    place(&board, &rig, 0.0, [4.0e5, 4.0e5]);
    let seen = observe::ticks(&mut client, 300).expect("answers");
    // Half a DAC code lets a little air through meanwhile; uncalibrated they would be 13 and 20 kPa off.
    assert!((seen.quantity(&settings, 2).mean - 4.0e5).abs() < 2.0e3);
    assert!((seen.quantity(&settings, 1).mean - 4.2e5).abs() < 2.0e3, "A is not calibrated yet");
}

#[test]
fn points_that_are_no_calibration_are_refused_with_the_remedy_and_change_nothing() {
    let rig = RigFile::paper_a();
    let (board, mut client) = board(&rig);
    let p = rig.rig.equilibrium_pressure_pa();
    let before = transfer::read(&mut client).expect("answers");
    let mut point = |y_m: f64, value: f64| {
        place(&board, &rig, y_m, [p, p]);
        measure(&mut client, Channel::Position, value)
    };
    let [left, near, right] = [-0.3, -0.27, 0.3].map(|y_m| point(y_m, y_m).expect("at rest"));
    let of = |points| implausible(Calibration::of(&before, Channel::Position, points));
    assert!(of([left, near]).contains("almost the same"));
    let exchanged = [left, right].map(|point| plant_sim::commission::calibrate::Point { value: -point.value, ..point });
    assert!(of(exchanged).contains("exchanged"));
    let millimetres =
        [left, right].map(|point| plant_sim::commission::calibrate::Point { value: 1.0e3 * point.value, ..point });
    assert!(of(millimetres).contains("`position_low_m`"));
    // At the end of the converter, and in motion.
    assert!(implausible(point(0.5, 0.5)).contains("broken wire"));
    board.borrow_mut().plant = {
        let plant = plant_model::Plant::new(&rig.rig, &rig.effects).expect("a rig");
        let state = plant_model::State { v_m_per_s: 0.1, ..plant.state_at_rest(-0.2, p, p) };
        let stepper = plant_model::Stepper::adaptive(&plant_model::Tolerance::standard());
        plant_model::Simulator::from_state(plant, state, stepper)
    };
    assert!(implausible(measure(&mut client, Channel::Position, 0.0)).contains("does not rest"));
    assert_eq!(transfer::read(&mut client), Ok(before));
}

fn rig_with_dead_zone(right_v: f64, left_v: f64) -> RigFile {
    let mut rig = RigFile::paper_a();
    (rig.rig.valve.dead_zone_right_v, rig.rig.valve.dead_zone_left_v) = (right_v, left_v);
    rig
}

/// A board that knows the rig, but for its dead zone.
fn searched(
    rig: &RigFile,
    how: &Search,
    abort: &dyn Fn() -> bool,
) -> (Result<plant_sim::commission::dead_zone::DeadZone, SearchError>, f64) {
    let (board, mut client) = board(rig);
    let present = transfer::read(&mut client).expect("answers");
    let mut stated = rig.clone();
    (stated.rig.valve.dead_zone_right_v, stated.rig.valve.dead_zone_left_v) = (0.0, 0.0);
    let changes = from_rig::from_rig(&stated, &present).expect("possible").changes;
    transfer::change(&mut client, &changes).expect("accepted");
    board.borrow_mut().run(300);
    let before = transfer::read(&mut client).expect("answers");
    let found = search(&mut client, how, abort, &mut |line| println!("{line}"));
    assert_eq!(transfer::read(&mut client), Ok(before), "the parameters are put back after {found:?}");
    assert_ne!(status(&mut client).expect("answers").state, "run", "{found:?}");
    let moved = board.borrow().plant.state().y_m.abs();
    (found, moved)
}

#[test]
fn a_dead_zone_is_found_within_its_stated_uncertainty_by_moves_of_a_tenth_of_the_range() {
    for (right_v, left_v) in [(0.42, -0.38), (0.15, -0.6), (0.7, -0.05)] {
        let rig = rig_with_dead_zone(right_v, left_v);
        let (found, moved) = searched(&rig, &Search::default(), &|| false);
        let found = found.expect("found");
        println!("{right_v} {left_v}: {found:?}, moved {moved} m");
        for (edge, truth) in [(found.right, right_v), (found.left, left_v)] {
            assert!((edge.volts - truth).abs() <= edge.uncertainty_v + 0.01, "{edge:?} instead of {truth}");
            assert!(edge.uncertainty_v <= 0.03, "{edge:?}");
            assert!(edge.safe_v().abs() <= truth.abs() + 0.01, "{edge:?} would compensate more than {truth}");
        }
        assert!(moved < 0.1, "{moved}");
    }
}

#[test]
fn a_valve_that_lets_air_through_at_mid_is_told_and_the_board_left_as_it_was() {
    let (found, _) = searched(&rig_with_dead_zone(0.7, 0.05), &Search::default(), &|| false);
    // At mid it drifts off; how far it has come when the search looks decides what is told.
    let told = |why: &str| why.contains("come to rest") || why.contains("safe:position");
    assert!(matches!(&found, Err(SearchError::NotFound(why)) if told(why)), "{found:?}");
}

#[test]
fn a_search_without_air_or_with_crossed_ports_says_so_and_leaves_the_board_as_it_was() {
    let mut wide = rig_with_dead_zone(3.0, -3.0);
    let (found, _) = searched(&wide, &Search::default(), &|| false);
    assert!(matches!(&found, Err(SearchError::NotFound(why)) if why.contains("is the air on")), "{found:?}");
    // Crossed ports: the valve's ends of the range are exchanged.
    (wide.rig.valve.dead_zone_right_v, wide.rig.valve.dead_zone_left_v) = (0.4, -0.4);
    wide.io.valve_range_v = [-5.0, 5.0];
    let (board, mut client) = board(&wide);
    board.borrow_mut().valve = rig_files::Converter::new([5.0, -5.0], 12);
    let found = search(&mut client, &Search::default(), &|| false, &mut |_| ());
    assert!(matches!(&found, Err(SearchError::NotFound(why)) if why.contains("exchanged")), "{found:?}");
}

#[test]
fn a_search_that_is_broken_off_ends_idle_with_the_parameters_it_had() {
    let asked = std::cell::Cell::new(0);
    let abort = || {
        asked.set(asked.get() + 1);
        asked.get() > 10
    };
    let (found, _) = searched(&rig_with_dead_zone(0.4, -0.4), &Search::default(), &abort);
    assert_eq!(found, Err(SearchError::Aborted));
}
