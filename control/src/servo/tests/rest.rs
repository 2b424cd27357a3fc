//! A piston that stands: hold, stick, stall.

use super::*;
use crate::servo::hold::Means;

#[test]
fn hold_begins_after_a_rest_is_left_by_a_new_target_and_lets_force_drift_only_inwards() {
    let tuning = tuning();
    let (limits, scale, coulomb) = (&tuning.hold, ThresholdScale(1 << 24), tuning.learning.coulomb);
    let force = Acceleration::from_num(1);
    let now = Means { error: metres(5e-6), v: Velocity::ZERO, force };
    let mut hold = Hold::default();
    let mut ticks = 0;
    while !hold.decide(Position::ZERO, true, now, (Acceleration::ZERO, coulomb), (limits, scale)) {
        ticks += 1;
        assert!(ticks < 100, "{hold:?}");
    }
    assert!(ticks >= 9, "after {ticks} ticks");
    for _ in 0..limits.settle_ticks {
        hold.decide(Position::ZERO, true, now, (Acceleration::ZERO, coulomb), (limits, scale));
    }
    let far = Means { force: force + Acceleration::from_num(1), ..now };
    for _ in 0..200 {
        hold.decide(Position::ZERO, true, far, (Acceleration::ZERO, coulomb), (limits, scale));
    }
    assert!(hold.restoring_rate(limits) < 0, "the force drifts away from the middle of the friction band: {hold:?}");
    let near = Means { force: Acceleration::from_num(0.1), ..now };
    for _ in 0..200 {
        hold.decide(Position::ZERO, true, near, (Acceleration::ZERO, coulomb), (limits, scale));
    }
    assert_eq!(hold.restoring_rate(limits), 0, "the force drifts towards it: {hold:?}");
    assert!(!hold.decide(metres(1e-3), true, now, (Acceleration::ZERO, coulomb), (limits, scale)));
}

#[test]
fn a_piston_at_its_coulomb_friction_is_not_held() {
    let tuning = tuning();
    let (limits, scale, coulomb) = (&tuning.hold, ThresholdScale(1 << 24), tuning.learning.coulomb);
    let held_at = |force: f64, coulomb: Acceleration| {
        let now = Means { error: metres(5e-6), v: Velocity::ZERO, force: Acceleration::from_num(force) };
        let (mut hold, load) = (Hold::default(), Acceleration::from_num(0.3));
        // At rest after a hundred ticks, in which the means follow.
        (0..200).any(|tick| hold.decide(Position::ZERO, tick > 100, now, (load, coulomb), (limits, scale)))
    };
    let friction = value(coulomb);
    for (force, held) in [(0.85, true), (0.95, false), (1.2, false)] {
        assert_eq!(held_at(force * friction - 0.3, coulomb), held, "{force} of the friction");
        assert_eq!(held_at(-force * friction - 0.3, coulomb), held, "{force} of the friction, the other way");
    }
    assert!(held_at(-0.3, Acceleration::ZERO), "nothing holds a piston without friction, and nothing moves it");
}

#[test]
fn a_held_valve_stays_silent_while_the_force_comes_to_rest_and_whatever_its_noise_feigns() {
    let tuning = tuning();
    let (limits, scale, coulomb) = (&tuning.hold, ThresholdScale(1 << 24), tuning.learning.coulomb);
    let mut hold = Hold::default();
    let mut tick = |force: f64| {
        let now = Means { error: metres(5e-6), v: Velocity::ZERO, force: Acceleration::from_num(force) };
        hold.learn_noise(Acceleration::from_num(force - 1.0), limits);
        let held = hold.decide(Position::ZERO, true, now, (Acceleration::ZERO, coulomb), (limits, scale));
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
    let scale = ThresholdScale(1 << 24);
    let gains = (&tuning.stick, &tuning.law.lead, &tuning.tick);
    let mut stick = Stick::default();
    let mean = Means { error: metres(100e-6), ..Means::default() };
    let rates: Vec<Option<Jerk>> = (0..30).map(|_| stick.rate(true, &mean, Acceleration::ZERO, gains, scale)).collect();
    assert!(rates[..9].iter().all(Option::is_none) && rates[29].is_some_and(|rate| rate > 0), "{rates:?}");
    let moving = Means { v: Velocity::from_num(0.01), ..mean };
    assert_eq!(stick.rate(true, &moving, Acceleration::ZERO, gains, scale), None);
    assert_eq!(stick, Stick::default());
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
    // What is too much is let out again, and then the force grows by a fifth of what the supply gives in a second.
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
