//! Air and valve: stiffness, slopes, missing pressures, and the command for an angle.

use super::*;
use crate::servo::air::Chambers;

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
