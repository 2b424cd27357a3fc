//! What a run learns.

use super::*;
use crate::servo::hold::Means;
use crate::servo::learned::Quantity;
use crate::servo::observer::{Estimate, Opening};

#[test]
fn what_friction_cannot_be_is_load_and_moves_both_ways_tell_the_load_from_friction() {
    let tuning = tuning();
    let (_, start, ..) = tuning.start.parts();
    let (mut body, mut estimate) = (start, Estimate::default());
    let (load, more) = (-5.0, 0.3);
    for tick in 0..20_000_u32 {
        // The disturbance that a rig with this load and this much more friction than compensated shows.
        let side = if tick / 200 % 2 == 0 { 1.0 } else { -1.0 };
        estimate.v = Velocity::from_num(0.1 * side);
        let missing =
            value(start.coulomb) + more - value(body.coulomb) - 0.1 * (value(body.viscous) - value(start.viscous));
        estimate.disturbance = Acceleration::from_num(load - missing * side);
        learning::learn_body(&mut body, &mut estimate, false, &tuning.learning);
    }
    assert!((value(estimate.load) - load).abs() < 0.1, "{estimate:?}");
    let friction = |body: &Body| value(body.coulomb) + 0.1 * value(body.viscous);
    assert!((friction(&body) - friction(&start) - more).abs() < 0.05, "{body:?}");
}

#[test]
fn slow_motion_towards_a_standing_target_teaches_coulomb_friction_and_no_more_of_it_where_the_piston_slips() {
    let mut tuning = tuning();
    let (_, start, ..) = tuning.start.parts();
    let learned = |tuning: &Tuning, disturbance: f64, v: f64| {
        let mut body = start;
        let disturbance = Acceleration::from_num(disturbance);
        let mut estimate = Estimate { v: Velocity::from_num(v), disturbance, ..Estimate::default() };
        learning::learn_body(&mut body, &mut estimate, true, &tuning.learning);
        assert_eq!((body.viscous, body.mass), (start.viscous, start.mass), "slow motion says nothing of them");
        let [coulomb, given_up] = [body.coulomb - start.coulomb, estimate.disturbance - disturbance].map(value);
        // What is learned is no longer a disturbance.
        assert!((coulomb - given_up * v.signum()).abs() < 1e-6, "{coulomb} {given_up}");
        coulomb
    };
    // 40/s over a millisecond.
    for (disturbance, v, wanted) in [(-0.5, 0.01, 0.02), (0.5, 0.01, -0.02), (0.5, -0.01, 0.02), (-0.5, -0.01, -0.02)] {
        assert!((learned(&tuning, disturbance, v) - wanted).abs() < 1e-4, "{disturbance} {v}");
    }
    tuning.learning.slips = true;
    assert_eq!(learned(&tuning, -0.5, 0.01), 0.0, "what holds it back may be static friction");
    assert!(learned(&tuning, 0.5, 0.01) < 0.0);
}

#[test]
fn gain_zone_lag_and_friction_are_learned_the_right_way_and_never_beyond_their_bounds() {
    let tuning = tuning();
    let rest = tuning.chambers.rest;
    let air = tuning.chambers.air(Position::ZERO, [rest[0], rest[1], tuning.chambers.nominal_supply]);
    let mut valve = ValveModel::nominal(&tuning.valve);
    let open = |w: f64| {
        let w = Voltage::from_num(w);
        Opening { w, theta: angle::angle(w) }
    };
    let wrong = Jerk::from_num(20);
    let learn = |valve: &mut ValveModel, opening: &Opening| {
        learning::learn_valve((&tuning.valve, valve), wrong, opening, &air, &tuning.learning);
    };
    learn(&mut valve, &open(1.0));
    assert!(valve.gains[0] > 1 && valve.gains[1] == 1, "more force than expected, filling A: {valve:?}");
    learn(&mut valve, &open(0.1));
    assert!(valve.zones[0] < tuning.valve.zones[0] && valve.zones[1] == tuning.valve.zones[1], "{valve:?}");
    for _ in 0..100_000 {
        learn(&mut valve, &open(1.0));
        learn(&mut valve, &open(0.1));
    }
    assert!((value(valve.gains[0]) - 1.8).abs() < 1e-6 && (value(valve.zones[0]) - 0.315).abs() < 1e-6, "{valve:?}");
    let before = valve;
    learn(&mut valve, &open(0.0));
    assert_eq!(valve, before, "a closed valve tells nothing");

    let (_, start, ..) = tuning.start.parts();
    let mut body = start;
    let mut estimate =
        Estimate { v: Velocity::from_num(0.1), disturbance: Acceleration::from_num(-1), ..Estimate::default() };
    let sum = |body: &Body, estimate: &Estimate| {
        value(body.coulomb) + 0.1 * value(body.viscous) - value(estimate.disturbance)
    };
    let whole = sum(&body, &estimate);
    learning::learn_body(&mut body, &mut estimate, false, &tuning.learning);
    assert!(body.coulomb > start.coulomb && body.viscous > start.viscous, "{body:?}");
    assert!((sum(&body, &estimate) - whole).abs() < 1e-4, "what is learned is no longer a disturbance");
    let (before, slow) = (body, Estimate { v: Velocity::from_num(0.01), ..estimate });
    learning::learn_body(&mut body, &mut slow.clone(), false, &tuning.learning);
    assert_eq!(body, before, "a piston that may stick tells nothing");

    let mut lag = Lag::of(tuning.lag);
    for tick in 0..2000 {
        // The force stays behind a rising angle.
        let theta = Angle::from_num(f64::from(tick % 20) * 0.05);
        let behind = if tick % 20 == 0 { Jerk::from_num(200) } else { Jerk::from_num(-10) };
        lag.learn(behind, theta, air.slope_fill_a, &tuning.learning);
    }
    assert!(lag.ticks > tuning.lag && value(lag.ticks) <= 3.5 * 1.7 + 1e-3, "{lag:?}");
}

#[test]
fn friction_is_unlearned_each_time_that_the_target_is_passed_again_and_never_twice_for_one_pass() {
    let tuning = tuning();
    let mut state = ServoState::default();
    state.body.coulomb = tuning.learning.coulomb;
    let mut pass = |side: f64, resting: bool| {
        let now = Means { error: metres(side * 3e-4), v: Velocity::from_num(0.01), force: Acceleration::ZERO };
        for _ in 0..30 {
            let forces = (Acceleration::ZERO, state.body.coulomb);
            state.hold.decide(Position::ZERO, resting, now, forces, (&tuning.hold, ThresholdScale(1 << 24)));
            tuning.learn(&mut state);
            // A loop that has left its run goes on concluding its ticks.
            tuning.learn(&mut state);
        }
        value(state.body.coulomb) / value(tuning.learning.coulomb)
    };
    assert_eq!(pass(1.0, true), 1.0);
    assert_eq!(pass(-1.0, true), 1.0, "an overshoot is no limit cycle");
    assert!((pass(1.0, true) - 0.9).abs() < 1e-3);
    assert!((pass(-1.0, true) - 0.81).abs() < 1e-3);
    let still = pass(-1.0, false);
    assert!((still - 0.81).abs() < 1e-3 && pass(1.0, true) == still, "a target that moves is passed for other reasons");
    for _ in 0..30 {
        pass(-1.0, true);
        pass(1.0, true);
    }
    assert!((pass(-1.0, true) - 0.3).abs() < 1e-3, "the least that can be learned");
}

#[test]
fn a_piston_that_goes_on_swinging_about_a_standing_target_gives_up_bandwidth_down_to_its_least() {
    let tuning = tuning();
    let mut state = ServoState { bandwidth: Ratio::ONE, ..ServoState::default() };
    let mut pass = |counts: bool, side: f64| {
        for _ in 0..3 {
            (state.stays, state.hold.mean.error) = (counts, metres(side * 3e-4));
            tuning.learn(&mut state);
            // A loop that has left its run goes on concluding its ticks.
            tuning.learn(&mut state);
        }
        value(state.bandwidth)
    };
    let swing = |pass: &mut dyn FnMut(bool, f64) -> f64, often: u32| {
        (0..often).map(|k| pass(true, if k % 2 == 0 { 1.0 } else { -1.0 })).last().expect("a swing")
    };
    // The first time on a side is no pass.
    assert_eq!(swing(&mut pass, 9), 1.0);
    pass(false, 1.0);
    assert_eq!(swing(&mut pass, 9), 1.0, "another target is not the same swing");
    assert!((pass(true, -1.0) - 0.9).abs() < 1e-6);
    assert!((pass(true, 1.0) - 0.81).abs() < 1e-6);
    assert!((pass(true, 1.0) - 0.81).abs() < 1e-6, "no pass");
    let [least, _] = Quantity::Bandwidth.parts();
    assert!((swing(&mut pass, 40) - least).abs() < 1e-6, "the least");
}
