//! The reference: moves within their limits.

use super::*;

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
