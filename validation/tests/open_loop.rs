//! The simulator against the reference on the paper's three rigs.

use plant_model::{Effects, Rig, Simulator};
use validation::{Method, OpenLoop, Reference, sampled, state};

const TICK_S: f64 = 1.0e-3;

fn cases() -> [(&'static str, Rig<f64>, Reference); 3] {
    [
        ("(a)", Rig::paper_a(), Reference::case_a()),
        ("(b)", Rig::paper_b(), Reference::case_b()),
        ("(c)", Rig::paper_c(), Reference::case_c()),
    ]
}

/// Largest differences over three seconds: position in m, pressures in Pa.
fn distance(rig: &Rig<f64>, reference: &Reference, input: OpenLoop) -> (f64, f64) {
    let commands = sampled(input, 3000, TICK_S);
    let truth = reference.simulate(Method::DormandPrince, 1e-10, reference.start(), &commands, TICK_S).unwrap();
    let mut simulator = Simulator::<f64>::new(rig, &Effects::none()).unwrap();
    let (mut y, mut p) = (0.0f64, 0.0f64);
    let mut travel = 0.0f64;
    for (u, x) in commands.iter().zip(&truth) {
        simulator.advance(*u, TICK_S);
        let s = simulator.state();
        y = y.max((s.y_m - x[state::Y]).abs());
        p = p.max((s.p_a_pa - x[state::P_A]).abs()).max((s.p_b_pa - x[state::P_B]).abs());
        travel = travel.max(x[state::Y].abs());
    }
    assert!(travel > 1e-5 && travel < 0.49 * reference.stroke, "the input moves the piston by {travel} m");
    println!(
        "{input:?}: y within {y:.1e} m, pressures within {p:.1e} Pa, travel {travel:.2e} m, {} steps",
        simulator.stepper().steps()
    );
    (y, p)
}

#[test]
fn smooth_inputs_agree_with_the_reference_within_1_um_and_10_pa_over_3_s() {
    for (name, rig, reference) in cases() {
        let (y, p) = distance(&rig, &reference, OpenLoop::Smooth);
        assert!(y <= 1e-6 && p <= 10.0, "case {name}: {y} m, {p} Pa");
    }
}

#[test]
fn stick_slip_agrees_with_the_reference_within_1_um_and_10_pa_over_3_s() {
    for (name, rig, reference) in cases() {
        for input in [OpenLoop::StickSlip, OpenLoop::Steps] {
            let (y, p) = distance(&rig, &reference, input);
            assert!(y <= 1e-6 && p <= 10.0, "case {name}, {input:?}: {y} m, {p} Pa");
        }
    }
}

#[test]
fn the_reference_does_not_depend_on_the_solver() {
    let reference = Reference::case_a();
    let commands = sampled(OpenLoop::Steps, 300, TICK_S);
    let solve =
        |method, tolerance| reference.simulate(method, tolerance, reference.start(), &commands, TICK_S).unwrap();
    let explicit = solve(Method::DormandPrince, 1e-10);
    for (x, e) in solve(Method::ExtrapolatedEuler, 1e-10).iter().zip(&explicit) {
        assert!((x[state::Y] - e[state::Y]).abs() < 1e-9, "{x:?} {e:?}");
        assert!((x[state::P_A] - e[state::P_A]).abs() < 0.01, "{x:?} {e:?}");
    }
}
