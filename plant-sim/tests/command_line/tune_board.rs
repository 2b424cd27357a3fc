//! A board finds out about its rig: dead zone, moves, diagnosis, and the step before and after.

use crate::simulated_board::{Line, Simulated};
use board_link::Parameter;
use plant_sim::board::Client;
use plant_sim::commission::dead_zone::SearchError;
use plant_sim::commission::{from_rig, observe, transfer, tune};
use rig_files::RigFile;
use std::cell::RefCell;
use std::rc::Rc;
use test_stages::runs_long;

#[test]
fn a_board_finds_its_rigs_dead_zone_mass_and_friction_and_is_left_as_it_was() {
    if !runs_long("a board that finds out about its rig") {
        return;
    }
    let stated = RigFile::paper_b();
    let mut truth = stated.clone();
    (truth.rig.valve.dead_zone_right_v, truth.rig.valve.dead_zone_left_v) = (0.42, -0.38);
    truth.rig.load.mass_kg *= 1.4;
    truth.rig.friction.coulomb_n *= 1.8;
    truth.rig.friction.static_n *= 1.8;
    let board = Rc::new(RefCell::new(Simulated::new(&truth)));
    let mut client = Client::open(Line(Rc::clone(&board)), 1).expect("a session");
    let before = transfer::read(&mut client).expect("answers");
    let found = tune::explore(&mut client, &stated, &|| false, &mut |line| println!("{line}")).expect("explored");
    assert_eq!(transfer::read(&mut client), Ok(before));
    let [right, left] = [found.dead_zone.right, found.dead_zone.left];
    assert!((right.volts - 0.42).abs() < 0.02 && (left.volts + 0.38).abs() < 0.02, "{:?}", found.dead_zone);
    // Every request takes 8 ms here; 52 s of moves are some 6,000 rows.
    assert!(found.log.t_s.len() > 5000, "{} rows", found.log.t_s.len());
    let told = diagnosis::diagnose(&found.rig, &found.log, &|_| ()).expect("diagnosed");
    println!("{}", plant_sim::gap::summary(&told));
    let present = transfer::read(&mut client).expect("answers");
    let said = from_rig::from_rig(&told.extended_rig, &present).expect("possible").changes;
    let value =
        |key: Parameter| said.iter().find(|(parameter, _)| *parameter == key).map_or(f32::NAN, |(_, value)| *value);
    let near = |key: Parameter, true_value: f64| {
        let ratio = f64::from(value(key)) / true_value;
        println!("{}: {ratio:.3} of the truth", key.name());
        assert!((0.95..1.05).contains(&ratio), "{}: {ratio:.3} of the truth", key.name());
    };
    near(Parameter::Mass, truth.rig.load.mass_kg);
    // The moves have one mean pressure: friction that grows with it and a higher level are tied. What both say of sliding is not.
    let sliding_n = |file: &RigFile| {
        let plant = plant_model::Plant::new(&file.rig, &file.effects).expect("valid");
        let [p_a, p_b] = file.rig.equilibrium_pressures_pa();
        plant.friction_level(&plant_model::State { v_m_per_s: 0.1, ..plant.state_at_rest(0.0, p_a, p_b) }).force_n
    };
    let friction = sliding_n(&told.extended_rig) / sliding_n(&truth);
    println!("friction: {friction:.3} of the truth");
    assert!((0.95..1.05).contains(&friction), "friction: {friction:.3} of the truth");
    near(Parameter::FillCoefficient, truth.rig.valve.fill_coefficient_kg_per_s_pa);
    near(Parameter::ExhaustCoefficient, truth.rig.valve.exhaust_coefficient_kg_per_s_pa);
    let after = tune::apply(&mut client, &told.extended_rig, &found.dead_zone, &|| false).expect("applied");
    println!("before {:?}\nafter  {after:?}", found.before);
    let settled = |step: &tune::Step| step.settled_s.expect("settled");
    // The law that knows the mass and the friction plans a little slower, and passes its target less.
    assert!(settled(&after) <= 1.1 * settled(&found.before), "{after:?}");
    assert!(after.overshoot_m < found.before.overshoot_m, "{after:?}");
    assert!(after.error_m.abs() < 1.0e-4 && after.overshoot_m < 1.0e-3, "{after:?}");
}

#[test]
fn moves_that_are_broken_off_leave_the_board_idle_with_the_parameters_it_had() {
    let mut rig = RigFile::paper_b();
    (rig.rig.valve.dead_zone_right_v, rig.rig.valve.dead_zone_left_v) = (0.42, -0.38);
    let board = Rc::new(RefCell::new(Simulated::new(&rig)));
    let mut client = Client::open(Line(Rc::clone(&board)), 1).expect("a session");
    let before = transfer::read(&mut client).expect("answers");
    for looks in [5, 300, 1500, 3000] {
        let asked = std::cell::Cell::new(0);
        let abort = || {
            asked.set(asked.get() + 1);
            asked.get() > looks
        };
        let broken = tune::explore(&mut client, &rig, &abort, &mut |_| ());
        assert_eq!(broken.err(), Some(SearchError::Aborted), "after {looks} looks");
        assert_eq!(transfer::read(&mut client), Ok(before.clone()));
        assert_ne!(observe::status(&mut client).expect("answers").state, "run");
    }
}
