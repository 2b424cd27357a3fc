//! One file of the law at a time, against its equation in f64.

use super::air::Chambers;
use super::friction::FrictionAhead;
use super::hold::Means;
use super::learned::{MEASURED_AGAINST, Quantity};
use super::observer::{Estimate, Opening};
use super::*;
use crate::config::Config;
use crate::parameters::{Key, LawChoice, Parameters};
use crate::quantities::Velocity;
use fixed::types::I6F26;

/// Tick rate of most tests, 1/s.
const HZ: u32 = 1000;

fn tuning() -> Tuning {
    tuning_at(HZ)
}

fn tuning_at(tick_hz: u32) -> Tuning {
    let p = Parameters {
        tick_hz,
        law: LawChoice::Servo,
        dead_zone_right_v: 0.42,
        dead_zone_left_v: -0.42,
        ..Parameters::default()
    };
    Config::from_parameters(&p).expect("valid").servo.expect("the positioning law")
}

fn metres(y: f64) -> Position {
    Position::from_num(y)
}

fn value<T: Fixed>(x: T) -> f64 {
    x.to_num()
}

#[test]
fn stiffness_and_slopes_are_those_of_the_equations() {
    let tuning = tuning();
    let Chambers { lengths, flow, atmosphere, .. } = tuning.chambers;
    let [l_a, l_b] = lengths.map(value);
    let [fill, exhaust] = flow[0].map(value);
    let atmosphere = value(atmosphere[0]);
    assert_eq!(flow[0], flow[1]);
    for (y, f) in [(0.0, [17.0, 18.0, 34.0]), (0.3, [30.0, 6.0, 34.0]), (-0.4, [10.0, 33.9, 34.0])] {
        let air = tuning.chambers.air(metres(y), f.map(Acceleration::from_num));
        let [f_a, f_b, f_sup] = f;
        let stiffness = 1.4 * (f_a / (l_a + y) + f_b / (l_b - y));
        assert!((value(air.stiffness) / stiffness - 1.0).abs() < 1e-3, "{air:?}, {stiffness}");
        let drive = |x: f64| x.max(0.03 * f_sup);
        let slope = fill * drive(f_sup - f_a) / (l_a + y) + exhaust * drive(f_b - atmosphere) / (l_b - y);
        assert!((value(air.slope_fill_a) / slope - 1.0).abs() < 1e-3, "{air:?}, {slope}");
        let slope = fill * drive(f_sup - f_b) / (l_b - y) + exhaust * drive(f_a - atmosphere) / (l_a + y);
        assert!((value(air.slope_fill_b) / slope - 1.0).abs() < 1e-3, "{air:?}, {slope}");
    }
}

#[test]
fn a_missing_pressure_follows_from_the_other_and_the_modelled_force() {
    let chambers = tuning().chambers;
    let [force, a, supply] = [5.0, 18.0, 34.0].map(Acceleration::from_num);
    assert_eq!(chambers.complete([Some(a), None], supply, force)[1], a - force);
    assert_eq!(chambers.complete([None, Some(a)], supply, force)[0], a + force);
    let [a, b, _] = chambers.complete([None, None], supply, force);
    assert!((a - b).abs_diff(force) <= Acceleration::DELTA, "{a} {b}");
    // Never above the supply or below the atmosphere.
    let [a, b, _] = chambers.complete([None, None], supply, Acceleration::from_num(500));
    assert_eq!([a, b], [supply, chambers.atmosphere[1]]);
}

#[test]
fn the_command_for_an_angle_opens_the_valve_by_that_angle_and_crosses_the_dead_zone_on_a_line() {
    let tuning = tuning();
    let (valve, model) = (&tuning.valve, ValveModel::nominal(&tuning.valve));
    for step in -140..=140 {
        let theta = f64::from(step) / 100.0;
        let [u, w] = valve.command(&model, Angle::from_num(theta));
        assert!((value(w) - theta.tan() / 2.0).abs() < 2e-6, "{theta}: {w}");
        if step != 0 {
            let back = value(angle::angle(valve.effective(&model, u)));
            assert!((back - theta).abs() < 2e-6, "{theta}: {u} V opens by {back}");
        }
    }
    let half = value(valve.command(&model, Angle::from_num(0.005))[0]);
    assert!((half - 0.21 - 0.0025).abs() < 1e-3, "{half} V in the middle of the line");
    assert_eq!(valve.command(&model, Angle::MAX)[0], Voltage::from_num(5), "never beyond the valve's range");
}

#[test]
fn a_move_ends_on_its_target_without_passing_it_and_within_its_limits() {
    let tuning = tuning();
    for target in [1e-4, 1e-3, 0.045, 0.3, -0.4] {
        let mut motion = Motion::default();
        let aim = standing(target);
        for _ in 0..3000 {
            motion = motion.arrived(&aim.motion, &tuning.limits);
            let jerk =
                if motion == aim.motion { Jerk::ZERO } else { motion.jerk_towards(&aim, &tuning.limits, I6F26::ONE) };
            motion = motion.after(jerk, &tuning.tick);
            let y = value(motion.position());
            assert!(value(jerk).abs() < 1.2 * 94.78 * 1.001, "{jerk}");
            assert!(value(motion.a).abs() < 9.328 * 1.001 && value(motion.v).abs() < 1.3917 * 1.002, "{motion:?}");
            assert!(y * target.signum() <= target.abs() + 2e-6, "{y} beyond {target}");
        }
        assert_eq!(motion, aim.motion, "towards {target}");
    }
}

#[test]
fn whatever_limits_are_accepted_a_move_ends_within_some_micrometres_of_its_target() {
    let (mut accepted, mut refused) = (0, 0);
    for acceleration in [0.01, 0.1, 1.0, 9.3, 50.0, 500.0, 5000.0] {
        for jerk in [0.1, 1.0, 10.0, 95.0, 1000.0, 1.0e4, 4.4e4, 2.0e6] {
            for speed in [1.0e-3, 0.1, 1.4, 50.0] {
                let p = Parameters {
                    law: LawChoice::Servo,
                    servo_acceleration_m_per_s2: acceleration,
                    servo_jerk_m_per_s3: jerk,
                    servo_speed_m_per_s: speed,
                    ..Parameters::default()
                };
                let Ok(config) = Config::from_parameters(&p) else {
                    refused += 1;
                    continue;
                };
                accepted += 1;
                let tuning = config.servo.expect("the positioning law");
                let (target, mut motion) = (1.0e-3, Motion::default());
                let aim = standing(target);
                // As long as the slowest of these may take, twice.
                let ticks = 2.0
                    * (1.0 / f64::from(speed)
                        + (1.0 / f64::from(acceleration)).sqrt()
                        + (8.0 / f64::from(jerk)).cbrt());
                for _ in 0..(1000.0 * ticks) as u32 {
                    motion = motion.arrived(&aim.motion, &tuning.limits);
                    motion = motion.after(motion.jerk_towards(&aim, &tuning.limits, I6F26::ONE), &tuning.tick);
                }
                let off = value(motion.position()) - target;
                assert!(off.abs() < 20e-6, "{acceleration} m/s2, {jerk} m/s3, {speed} m/s: {off} m off");
            }
        }
    }
    assert!(accepted > 20 && refused > 20, "{accepted} of {}", accepted + refused);
}

#[test]
fn a_target_changed_in_mid_move_is_reached_too() {
    let tuning = tuning();
    let mut motion = Motion::default();
    for tick in 0..3000 {
        let target = if tick < 150 { 0.3 } else { -0.02 };
        let aim = standing(target);
        motion = motion.arrived(&aim.motion, &tuning.limits);
        motion = motion.after(motion.jerk_towards(&aim, &tuning.limits, I6F26::ONE), &tuning.tick);
    }
    assert!((value(motion.position()) + 0.02).abs() < 2e-6, "{motion:?}");
}

/// A new target that stands.
fn standing(y: f64) -> reference::Aim {
    let (motion, target) = (Motion::at(metres(y)), metres(y));
    reference::Aim { motion, jerk: Jerk::ZERO, used: I6F26::ZERO, new: true, target }
}

#[test]
fn a_sine_that_a_slow_sender_holds_has_its_own_velocity_too() {
    let tuning = tuning();
    let w = core::f64::consts::PI;
    for (every, within_m, within_m_per_s) in [(2, 2e-5, 0.004), (5, 1e-4, 0.01), (20, 6e-4, 0.03)] {
        let mut stream = Stream::at(Position::ZERO);
        for tick in 0..2000_u32 {
            let sent = metres(0.05 * (w * f64::from(tick / every * every) * 1e-3).sin());
            let next = f64::from(tick + 1) * 1e-3;
            let motion = stream.take(sent, &tuning.stream, &tuning.tick).motion;
            let (y, v) = (value(motion.position()), motion.v);
            if tick > 500 {
                assert!((y - 0.05 * (w * next).sin()).abs() < within_m, "every {every} ms: {y} at {next}");
                let wrong = value(v) - 0.05 * w * (w * next).cos();
                assert!(wrong.abs() < within_m_per_s, "every {every} ms: {wrong} at {next}");
            }
        }
    }
}

#[test]
fn a_target_within_20_um_of_where_it_stands_is_the_same_and_one_that_stops_stands_within_25_ms() {
    let tuning = tuning();
    let mut stream = Stream::at(metres(0.01));
    let mut take = |y: f64| stream.take(metres(y), &tuning.stream, &tuning.tick);
    for tick in 0..100 {
        assert_eq!(take(0.01 + if tick % 2 == 0 { 15e-6 } else { -15e-6 }), standing(0.01));
    }
    // A ramp that ends in noise.
    let mut aim = standing(0.01);
    for tick in 0..150 {
        aim = take(0.01 + 1e-4 * f64::from(tick));
    }
    assert!((value(aim.motion.v) - 0.1).abs() < 1e-3, "{aim:?}");
    let stands =
        (0..60).map(|tick| take(0.025 + if tick % 2 == 0 { 5e-6 } else { -5e-6 })).position(|aim| aim.motion.v == 0);
    assert!(stands.is_some_and(|ticks| ticks <= 26), "{stands:?}");
}

#[test]
fn what_friction_cannot_be_is_load_and_moves_both_ways_tell_the_load_from_friction() {
    let tuning = tuning();
    let (_, start, ..) = tuning.start.parts();
    let (mut body, mut estimate) = (start, Estimate::default());
    let (load, excess) = (-5.0, 0.3);
    for tick in 0..20_000_u32 {
        // The disturbance that a rig with this load and this much more friction than compensated shows.
        let side = if tick / 200 % 2 == 0 { 1.0 } else { -1.0 };
        estimate.v = Velocity::from_num(0.1 * side);
        let missing =
            value(start.coulomb) + excess - value(body.coulomb) - 0.1 * (value(body.viscous) - value(start.viscous));
        estimate.disturbance = Acceleration::from_num(load - missing * side);
        learning::learn_body(&mut body, &mut estimate, false, &tuning.learning);
    }
    assert!((value(estimate.load) - load).abs() < 0.1, "{estimate:?}");
    let friction = |body: &Body| value(body.coulomb) + 0.1 * value(body.viscous);
    assert!((friction(&body) - friction(&start) - excess).abs() < 0.05, "{body:?}");
}

#[test]
fn a_step_has_no_velocity_and_a_sine_has_its_own() {
    let tuning = tuning();
    let mut stream = Stream::at(Position::ZERO);
    for _ in 0..5 {
        assert_eq!(stream.take(metres(0.045), &tuning.stream, &tuning.tick), standing(0.045));
    }
    let mut stream = Stream::at(Position::ZERO);
    let w = core::f64::consts::PI;
    for tick in 0..2000 {
        let (now, next) = (f64::from(tick) * 1e-3, f64::from(tick + 1) * 1e-3);
        let aim = stream.take(metres(0.05 * (w * now).sin()), &tuning.stream, &tuning.tick);
        if tick > 200 {
            let motion = aim.motion;
            assert!((value(motion.position()) - 0.05 * (w * next).sin()).abs() < 2e-6, "{motion:?} at {next}");
            assert!((value(motion.v) - 0.05 * w * (w * next).cos()).abs() < 2e-3, "{motion:?} at {next}");
        }
    }
}

#[test]
fn a_target_is_new_until_the_reference_is_within_a_tenth_of_a_millimetre_and_again_once_it_jumps() {
    let tuning = tuning();
    let read = Readings { y: Position::ZERO, chambers: [None; 2], supply: None };
    for (off_m, new) in [(1e-3, true), (0.05e-3, false)] {
        let (mut state, target) = (ServoState::default(), metres(off_m));
        tuning.step(&mut state, Stage::Begin, target, &read);
        assert_eq!(state.stream.take(target, &tuning.stream, &tuning.tick).new, new, "{off_m} m");
        assert!(state.stream.take(metres(0.01), &tuning.stream, &tuning.tick).new);
    }
}

#[test]
fn the_observer_finds_velocity_and_disturbance_of_a_motion_that_it_did_not_expect() {
    let tuning = tuning();
    let (mut estimate, valve) = (Estimate::default(), ValveModel::nominal(&tuning.valve));
    let rest = tuning.chambers.rest;
    let air = tuning.chambers.air(Position::ZERO, [rest[0], rest[1], tuning.chambers.nominal_supply]);
    let (_, body, lag, ..) = tuning.start.parts();
    for tick in 0..400 {
        estimate.correct(metres(0.1e-3 * f64::from(tick)), Some(Acceleration::ZERO), &tuning.observer);
        let valve = (&tuning.valve, &valve);
        estimate.predict(Voltage::ZERO, &air, valve, (lag, &body), (&tuning.observer, &tuning.tick));
    }
    assert!((value(estimate.v) - 0.1).abs() < 1e-3, "{estimate:?}");
    assert!((value(estimate.y) - 0.04).abs() < 1e-5, "one tick ahead: {estimate:?}");
    // What moves the piston against friction without force in the chambers is a disturbance.
    let friction = value(body.coulomb) + value(body.viscous) * 0.1;
    assert!((value(estimate.disturbance) / friction - 1.0).abs() < 0.2, "{estimate:?} against {friction}");
}

#[test]
fn hold_begins_after_a_rest_is_left_by_a_new_target_and_lets_force_drift_only_inwards() {
    let tuning = tuning();
    let (limits, caution, coulomb) = (&tuning.hold, Caution(1 << 24), tuning.learning.coulomb);
    let force = Acceleration::from_num(1);
    let now = Means { error: metres(5e-6), v: Velocity::ZERO, force };
    let mut hold = Hold::default();
    let mut ticks = 0;
    while !hold.decide(Position::ZERO, true, now, (Acceleration::ZERO, coulomb), (limits, caution)) {
        ticks += 1;
        assert!(ticks < 100, "{hold:?}");
    }
    assert!(ticks >= 9, "after {ticks} ticks");
    for _ in 0..limits.settle_ticks {
        hold.decide(Position::ZERO, true, now, (Acceleration::ZERO, coulomb), (limits, caution));
    }
    let far = Means { force: force + Acceleration::from_num(1), ..now };
    for _ in 0..200 {
        hold.decide(Position::ZERO, true, far, (Acceleration::ZERO, coulomb), (limits, caution));
    }
    assert!(hold.restoring_rate(limits) < 0, "the force drifts away from the middle of the friction band: {hold:?}");
    let near = Means { force: Acceleration::from_num(0.1), ..now };
    for _ in 0..200 {
        hold.decide(Position::ZERO, true, near, (Acceleration::ZERO, coulomb), (limits, caution));
    }
    assert_eq!(hold.restoring_rate(limits), 0, "the force drifts towards it: {hold:?}");
    assert!(!hold.decide(metres(1e-3), true, now, (Acceleration::ZERO, coulomb), (limits, caution)));
}

#[test]
fn a_piston_at_its_coulomb_friction_is_not_held() {
    let tuning = tuning();
    let (limits, caution, coulomb) = (&tuning.hold, Caution(1 << 24), tuning.learning.coulomb);
    let held_at = |force: f64, coulomb: Acceleration| {
        let now = Means { error: metres(5e-6), v: Velocity::ZERO, force: Acceleration::from_num(force) };
        let (mut hold, load) = (Hold::default(), Acceleration::from_num(0.3));
        // At rest after a hundred ticks, in which the means follow.
        (0..200).any(|tick| hold.decide(Position::ZERO, tick > 100, now, (load, coulomb), (limits, caution)))
    };
    let friction = value(coulomb);
    for (force, held) in [(0.85, true), (0.95, false), (1.2, false)] {
        assert_eq!(held_at(force * friction - 0.3, coulomb), held, "{force} of the friction");
        assert_eq!(held_at(-force * friction - 0.3, coulomb), held, "{force} of the friction, the other way");
    }
    assert!(held_at(-0.3, Acceleration::ZERO), "nothing holds a piston without friction, and nothing moves it");
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
            state.hold.decide(Position::ZERO, resting, now, forces, (&tuning.hold, Caution(1 << 24)));
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

#[test]
fn less_bandwidth_takes_its_cube_of_the_position_its_square_of_the_velocity_and_itself_of_the_acceleration() {
    let gains = tuning().law.feedback;
    let (full, half) = (gains.at(Ratio::ONE), gains.at(Ratio::from_num(0.5)));
    let none = (Acceleration::ZERO, Velocity::ZERO, Position::ZERO);
    for (errors, expected) in [
        ((Acceleration::from_num(10), none.1, none.2), 0.5),
        ((none.0, Velocity::from_num(0.1), none.2), 0.25),
        ((none.0, none.1, metres(1e-3)), 0.125),
    ] {
        let [whole, part] = [full, half].map(|parts| gains.jerk(parts, errors));
        assert!((part as f64 / whole as f64 - expected).abs() < 1e-4, "{part} of {whole}");
    }
    let w = 68.10603;
    assert!((gains.jerk(full, (none.0, none.1, metres(1e-3))) as f64 / 256.0 / (w * w * w * 1e-3) - 1.0).abs() < 1e-4);
}

#[test]
fn a_blocked_piston_is_told_by_its_force_and_pushed_on_slowly_until_it_moves() {
    let tuning = tuning();
    let limits = &tuning.stall;
    let (friction, tick_s) = (value(tuning.learning.coulomb), 1.0 / f64::from(HZ));
    let mut stall = stall::Stall::at(metres(0.01), Acceleration::ZERO);
    let force = |f: f64| Acceleration::from_num(f);
    // As much as friction may take, for as long as it likes.
    for _ in 0..1000 {
        stall.see(metres(0.0101), force(2.9 * friction), limits);
        assert!(!stall.suspected(limits) && stall.rate(metres(0.02), force(2.9 * friction), limits).is_none());
    }
    for n in 0..30 {
        assert!(stall.rate(metres(0.02), force(5.0 * friction), limits).is_none(), "after {n} ms");
        stall.see(metres(0.0101), force(5.0 * friction), limits);
    }
    // The excess is let out again, and then the force grows by a fifth of what the supply gives in a second.
    let first = value(stall.rate(metres(0.02), force(5.0 * friction), limits).expect("blocked"));
    assert!(first < 0.0, "{first} m/s3");
    for _ in 0..999 {
        stall.see(metres(0.0101), force(3.0 * friction), limits);
        stall.rate(metres(0.02), force(3.0 * friction), limits).expect("blocked");
    }
    let rate = value(stall.rate(metres(0.02), force(3.0 * friction), limits).expect("blocked"));
    let grown = rate / (68.10603 / 1.5);
    let supply = 4.849383e-5 * 6.0e5;
    assert!((grown - 1001.0 * tick_s * supply / 5.0).abs() < 0.02 * supply / 5.0, "{grown} m/s2");
    // It lets go of it for a target on the other side, and when it moves.
    let mut other = stall;
    assert!(other.rate(metres(-0.02), force(4.0 * friction), limits).is_none() && !other.suspected(limits));
    stall.see(metres(0.0103), force(4.0 * friction), limits);
    assert!(!stall.suspected(limits) && stall.rate(metres(0.02), force(4.0 * friction), limits).is_none());
}

#[test]
fn bristles_stiffer_than_the_format_hold_no_more_than_the_coulomb_friction() {
    for stiffness in [1.0e7, 3.0e8, 1.0e9] {
        let p = Parameters { law: LawChoice::Servo, servo_bristle_per_s2: stiffness, ..Parameters::default() };
        let tuning = Config::from_parameters(&p).expect("valid").servo.expect("the positioning law");
        let (_, body, lag, ..) = tuning.start.parts();
        let air = tuning.chambers.air(Position::ZERO, [tuning.chambers.rest[0]; 3]);
        let mut estimate = Estimate::default();
        for tick in 0..2000_u32 {
            // To and fro within and beyond what friction holds.
            estimate.force = Acceleration::from_num(4.0 * (f64::from(tick) / 50.0).sin());
            let _ = estimate.predict(
                tuning.valve.centre,
                &air,
                (&tuning.valve, &ValveModel::nominal(&tuning.valve)),
                (lag, &body),
                (&tuning.observer, &tuning.tick),
            );
            assert!(estimate.bristle.saturating_abs() <= body.coulomb, "{stiffness}: {estimate:?}");
        }
    }
}

#[test]
fn a_pressure_that_is_measured_again_teaches_nothing_of_what_the_model_made_of_it_meanwhile() {
    let tuning = tuning();
    let mut state = ServoState::default();
    let readings = |force: f64, measured: bool| {
        let p_a = (17.0 + force) / 4.849383e-5;
        let pressures = [p_a, 17.0 / 4.849383e-5].map(|p: f64| measured.then(|| Pressure::from_num(p)));
        Readings { y: Position::ZERO, chambers: pressures, supply: None }
    };
    tuning.step(&mut state, Stage::Begin, Position::ZERO, &readings(0.0, true));
    for _ in 0..200 {
        tuning.step(&mut state, Stage::Run, metres(1e-5), &readings(0.0, false));
        tuning.learn(&mut state);
    }
    let before = tuning.learned(&state);
    tuning.step(&mut state, Stage::Run, metres(1e-5), &readings(2.0, true));
    tuning.learn(&mut state);
    assert!((value(state.estimate.force) - 2.0).abs() < 0.1, "{:?}", state.estimate);
    for (then, now) in before.bits.into_iter().zip(tuning.learned(&state).bits).take(5) {
        assert!((then - now).abs() <= then.abs() / 1000, "{before:?}, {state:?}");
    }
}

#[test]
fn where_a_target_turns_round_the_force_has_set_out_by_half_its_way_at_full_flow() {
    let tuning = tuning();
    let (gains, coulomb) = (&tuning.friction, tuning.learning.coulomb);
    let (f_c, w) = (value(coulomb), std::f64::consts::PI);
    let full = 150.0;
    let mut ahead = FrictionAhead::at(coulomb);
    let mut turned = None;
    for tick in 0..1000 {
        // A sine of 50 mm and 0.5 Hz turns after half a second.
        let t = f64::from(tick) * 1e-3;
        let (v, a) = (0.05 * w * (w * t).cos(), -0.05 * w * w * (w * t).sin());
        let aim = Motion { v: Velocity::from_num(v), a: Acceleration::from_num(a), ..Motion::default() };
        let rate = ahead.rate(&aim, (coulomb, coulomb), Jerk::from_num(full), tuning.lag, (gains, &tuning.tick));
        if turned.is_none() && rate < 0 {
            turned = Some(t);
        }
        if tick == 0 {
            assert_eq!(rate, 0, "nothing to lead while the piston slides on");
        }
    }
    let lead = 0.5 - turned.expect("the target turns");
    let expected = f_c / full + value(tuning.lag) * 1e-3 + 1.5e-3;
    assert!((lead - expected).abs() < 1.5e-3, "{lead} s instead of {expected}");
    // From one end to the other, and by the gain of half over the dead zone what is missing.
    let rate = ahead.rate(
        &Motion { v: Velocity::from_num(-0.1), ..Motion::default() },
        (coulomb, coulomb),
        Jerk::from_num(full),
        tuning.lag,
        (gains, &tuning.tick),
    );
    let expected = -2.0 * f_c * 0.5 / (value(tuning.lag) * 1e-3 + 1.5e-3);
    assert!((value(rate) / expected - 1.0).abs() < 1e-3, "{rate} instead of {expected}");
}

#[test]
fn a_held_valve_stays_silent_while_the_force_comes_to_rest_and_whatever_its_noise_feigns() {
    let tuning = tuning();
    let (limits, caution, coulomb) = (&tuning.hold, Caution(1 << 24), tuning.learning.coulomb);
    let mut hold = Hold::default();
    let mut tick = |force: f64| {
        let now = Means { error: metres(5e-6), v: Velocity::ZERO, force: Acceleration::from_num(force) };
        hold.learn_noise(Acceleration::from_num(force - 1.0), limits);
        let held = hold.decide(Position::ZERO, true, now, (Acceleration::ZERO, coulomb), (limits, caution));
        if held { hold.restoring_rate(limits) } else { Jerk::ZERO }
    };
    // The valve is still closing when hold begins: the force goes on by more than it may drift.
    let drift = value(limits.drift);
    for tick_s in (0..400).map(|n| f64::from(n) * 1e-3) {
        assert_eq!(tick(1.0 - 2.0 * drift * (-tick_s / 5e-3).exp()), 0, "after {tick_s} s");
    }
    // Means of such noise pass the drift some hundred times in this time; half a second is for learning it.
    let mut random = 1_u32;
    for n in 0..20_000 {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let noise = 2.0 * f64::from(random) / f64::from(u32::MAX) - 1.0;
        let rate = tick(1.0 + 3f64.sqrt() * 1.5 * drift * noise);
        assert!(rate == 0 || n < 500, "after {n} ticks of noise");
    }
}

#[test]
fn the_force_is_led_towards_the_target_only_while_the_piston_sticks() {
    let tuning = tuning();
    let caution = Caution(1 << 24);
    let gains = (&tuning.stick, &tuning.law.lead, &tuning.tick);
    let mut stick = Stick::default();
    let mean = Means { error: metres(100e-6), ..Means::default() };
    let rates: Vec<Option<Jerk>> =
        (0..30).map(|_| stick.rate(true, &mean, Acceleration::ZERO, gains, caution)).collect();
    assert!(rates[..9].iter().all(Option::is_none) && rates[29].is_some_and(|rate| rate > 0), "{rates:?}");
    let moving = Means { v: Velocity::from_num(0.01), ..mean };
    assert_eq!(stick.rate(true, &moving, Acceleration::ZERO, gains, caution), None);
    assert_eq!(stick, Stick::default());
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
fn a_run_begins_with_the_means_of_its_first_samples_and_without_a_velocity() {
    let tuning = tuning();
    let start = metres(0.02);
    let mut estimate = Estimate { y: start, force: Acceleration::ZERO, ..Estimate::default() };
    let samples = [40e-6, -20e-6, 10e-6, -50e-6];
    for (k, noise) in samples.iter().enumerate() {
        let force = Acceleration::from_num(noise * 1e5);
        estimate.correct_standing(metres(0.02 + noise), Some(force), k as u16 + 1);
    }
    let mean = samples.iter().sum::<f64>() / samples.len() as f64;
    assert!((value(estimate.y) - 0.02 - mean).abs() < 2e-7, "{estimate:?}");
    assert!((value(estimate.force) - mean * 1e5).abs() < 1e-4 && estimate.v == 0, "{estimate:?}");
    assert!((value(estimate.force) + value(estimate.disturbance)).abs() < 1e-6, "the piston stands: {estimate:?}");
    assert_eq!(tuning.standing_ticks, 8);
}

#[test]
fn without_pressures_a_run_begins_with_less_friction_since_too_much_is_hardly_unlearned() {
    let tuning = tuning();
    let begun = |chambers: [Option<Pressure>; 2]| {
        let mut state = ServoState::default();
        let readings = Readings { y: Position::ZERO, chambers, supply: None };
        tuning.step(&mut state, Stage::Begin, Position::ZERO, &readings);
        value(state.body.coulomb) / value(tuning.learning.coulomb)
    };
    let measured = Some(Pressure::from_num(3));
    assert!((begun([measured; 2]) - 0.92).abs() < 1e-3);
    assert!((begun([measured, None]) - 0.8).abs() < 1e-3 && (begun([None; 2]) - 0.8).abs() < 1e-3);
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
fn the_law_refuses_a_tick_too_slow_for_it_and_limits_that_do_not_fit_each_other() {
    let refused = |change: fn(&mut Parameters)| {
        let mut p = Parameters { law: LawChoice::Servo, ..Parameters::default() };
        change(&mut p);
        Config::from_parameters(&p).expect_err("refused").key
    };
    assert_eq!(refused(|p| p.tick_hz = 200), "tick_hz");
    assert_eq!(refused(|p| p.servo_jerk_m_per_s3 = 1.0e4), "servo_jerk_m_per_s3");
    assert_eq!(refused(|p| p.servo_observer_rad_per_s = 600.0), "servo_observer_rad_per_s");
    assert_eq!(refused(|p| p.servo_area_m2_per_kg = 0.5), "servo_area_m2_per_kg");
}

#[test]
fn the_jerk_of_a_move_changes_its_side_a_few_times_only_at_any_tick_rate() {
    for tick_hz in [1000, 3000, 10_000, 20_000] {
        let tuning = tuning_at(tick_hz);
        let aim = standing(0.045);
        let (mut motion, mut sides, mut last) = (Motion::default(), 0, 0);
        for _ in 0..tick_hz {
            motion = motion.arrived(&aim.motion, &tuning.limits);
            let jerk = motion.jerk_towards(&aim, &tuning.limits, I6F26::ONE);
            // Half of the limit, so that the small corrections of a planned jerk do not count.
            let side = i32::from(jerk > 40) - i32::from(jerk < -40);
            sides += u32::from(side != 0 && side != last);
            last = if side == 0 { last } else { side };
            motion = motion.after(jerk, &tuning.tick);
        }
        assert_eq!(motion, aim.motion, "{tick_hz}");
        assert!((3..=5).contains(&sides), "at {tick_hz} ticks a second the jerk changed its side {sides} times");
    }
}

#[test]
fn along_the_speed_limit_the_jerk_does_not_alternate() {
    for tick_hz in [1000, 3000, 10_000] {
        let tuning = tuning_at(tick_hz);
        let aim = standing(-0.4);
        let (mut motion, mut sides, mut last, mut fastest) = (Motion::default(), 0, Jerk::ZERO, 0.0_f64);
        while motion != aim.motion {
            let jerk = motion.jerk_towards(&aim, &tuning.limits, I6F26::ONE);
            // A thousandth of the limit.
            if jerk.saturating_abs() > Jerk::lit("0.08") {
                sides += u32::from((jerk > 0) != (last > 0));
                last = jerk;
            }
            motion = motion.after(jerk, &tuning.tick).arrived(&aim.motion, &tuning.limits);
            fastest = fastest.max(value(motion.v).abs());
        }
        assert!((fastest / 1.3917 - 1.0).abs() < 1e-3, "the limit of 1.39 m/s was not reached: {fastest}");
        assert!((3..=8).contains(&sides), "at {tick_hz} ticks a second the jerk changed its side {sides} times");
    }
}

#[test]
fn what_was_learned_is_begun_with_again_within_its_limits_and_nothing_else_is() {
    for quantity in Quantity::ALL {
        let index = usize::from(quantity.number());
        let mut tuning = tuning();
        let nominal = tuning.nominal().values(HZ);
        // The load may be what the supply holds.
        let [low, high] =
            quantity.limits().map_or([-29.096, 29.096], |limits| limits.map(|part| part * f64::from(nominal[index])));
        let [low, high] = [low, high].map(|end| end as f32);
        for (value, fits) in [
            (low - 0.001 * low.abs(), false),
            (low + 0.001 * low.abs(), true),
            (nominal[index], true),
            (high * 0.999, true),
            (high * 1.001, false),
            // What kept values lack is nominal where it was not learned once.
            (f32::NAN, quantity.is_newer()),
            (f32::INFINITY, false),
        ] {
            let before = tuning.start;
            let mut values = nominal;
            values[index] = value;
            let taken = tuning.start_from(&values, HZ);
            assert_eq!(taken, if fits { Ok(()) } else { Err(quantity) }, "{} {value}", quantity.name());
            if fits {
                let found = tuning.start.values(HZ)[index];
                let value = if value.is_nan() { nominal[index] } else { value };
                assert!((found - value).abs() <= 2e-5 + 1e-4 * value.abs(), "{}: {found}", quantity.name());
            } else {
                assert_eq!(tuning.start, before);
            }
        }
        // The very ends, as learning leaves them, go out and in again.
        for end in tuning.limits() {
            assert_eq!(tuning.start_from(&end.values(HZ), HZ), Ok(()));
            assert_eq!(tuning.start.values(HZ), end.values(HZ));
        }
    }
}

#[test]
fn every_parameter_of_the_law_is_the_rigs_or_says_how_fast_it_moves() {
    let others: Vec<&str> = Key::ALL
        .into_iter()
        .filter(|key| !MEASURED_AGAINST.contains(key))
        .map(|key| key.row().key)
        .filter(|key| key.starts_with("servo_"))
        .collect();
    let speeds = ["speed_m_per_s", "acceleration_m_per_s2", "jerk_m_per_s3", "bandwidth_rad_per_s"];
    let following = ["observer_rad_per_s", "force_rate_per_s", "lead_s"];
    assert_eq!(
        others,
        [&speeds[..], &following[..]].concat().iter().map(|key| format!("servo_{key}")).collect::<Vec<_>>()
    );
}

#[test]
fn a_controlled_stop_asks_for_the_rate_that_brings_the_force_to_that_at_rest_and_for_no_other_side() {
    let mut tuning = tuning();
    // With a rod and a load the force at rest is not zero.
    tuning.chambers.rest[1] = tuning.chambers.rest[0].saturating_sub(Acceleration::from_num(3));
    let state = ServoState { valve: ValveModel::nominal(&tuning.valve), ..ServoState::default() };
    let air = tuning.chambers.air(Position::ZERO, [tuning.chambers.rest[0]; 3]);
    for force in [-20.0, -1.0, 0.0, 2.9, 3.0, 3.1, 7.0, 20.0, 200.0] {
        let forces = [17.0 + force, 17.0, 34.0].map(Acceleration::from_num);
        let [_, w] = equalise::command(&tuning, &ServoState { forces, ..state }, &air);
        let rate = 0.15 * 68.10603 * (3.0 - force);
        let slope = value(if rate >= 0.0 { air.slope_fill_a } else { air.slope_fill_b });
        let most = value(tuning.valve.most_angle(&state.valve));
        let theta = (rate / slope).clamp(-most, most);
        assert!((value(w) - theta.tan() / 2.0).abs() < 1e-4 * (1.0 + theta.tan().abs()), "{force}: {w} V, {theta}");
    }
}
