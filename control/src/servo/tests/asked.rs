//! What the law asks for: feedback, friction of a target that turns round, the controlled stop.

use super::*;
use crate::servo::friction::Feedforward;

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
fn where_a_target_turns_round_the_force_has_set_out_by_half_its_way_at_full_flow() {
    let tuning = tuning();
    let (gains, coulomb) = (&tuning.friction, tuning.learning.coulomb);
    let (f_c, w) = (value(coulomb), std::f64::consts::PI);
    let full = 150.0;
    let mut feedforward = Feedforward::at(coulomb);
    let mut turned = None;
    for tick in 0..1000 {
        // A sine of 50 mm and 0.5 Hz turns after half a second.
        let t = f64::from(tick) * 1e-3;
        let (v, a) = (0.05 * w * (w * t).cos(), -0.05 * w * w * (w * t).sin());
        let aim = Motion { v: Velocity::from_num(v), a: Acceleration::from_num(a), ..Motion::default() };
        let rate = feedforward.rate(&aim, (coulomb, coulomb), Jerk::from_num(full), tuning.lag, (gains, &tuning.tick));
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
    let rate = feedforward.rate(
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
