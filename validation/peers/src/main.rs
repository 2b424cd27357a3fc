//! Three seconds of open loop at a 1 kHz tick by `plant-model`, by diffsol and by Runge-Kutta 4 at 100 us: time and
//! accuracy side by side, interleaved in one run, best of several. `cargo run --release` in this folder.
//!
//! A workspace of its own: diffsol brings a hundred crates, which nothing else needs.

mod library;

use library::Method;
use plant_model::{Effects, Plant, Rig, Simulator, State, Stepper, Tolerance};
use std::hint::black_box;
use std::time::{Duration, Instant};
use validation::{NUMBER_OF_STATES, OpenLoop, Reference, sampled, state};

const TICK_S: f64 = 1.0e-3;
const TICKS: usize = 3000;
const ROUNDS: usize = 15;

/// Position in m and pressures in Pa after every tick.
type Trace = Vec<[f64; 3]>;

fn observed(x: &[f64; NUMBER_OF_STATES]) -> [f64; 3] {
    [x[state::Y], x[state::P_A], x[state::P_B]]
}

fn simulator(rig: &Rig<f64>, stepper: Stepper<f64>, commands: &[f64]) -> Trace {
    let plant = Plant::new(rig, &Effects::none()).expect("the paper's rigs are valid");
    let p = rig.equilibrium_pressure_pa();
    let mut simulator = Simulator::<f64>::from_state(plant, plant.state_at_rest(0.0, p, p), stepper);
    commands
        .iter()
        .map(|u| {
            simulator.advance(*u, TICK_S);
            let s = simulator.state();
            [s.y_m, s.p_a_pa, s.p_b_pa]
        })
        .collect()
}

/// Classic Runge-Kutta at 100 us on `plant-model`'s right-hand side.
fn runge_kutta(rig: &Rig<f64>, commands: &[f64]) -> Trace {
    const PER_TICK: u32 = 10;
    let h = TICK_S / f64::from(PER_TICK);
    let plant = Plant::new(rig, &Effects::none()).expect("the paper's rigs are valid");
    let p = rig.equilibrium_pressure_pa();
    let mut s = plant.state_at_rest(0.0, p, p);
    let moved = |s: &State<f64>, k: &State<f64>, h: f64| State {
        y_m: s.y_m + h * k.y_m,
        v_m_per_s: s.v_m_per_s + h * k.v_m_per_s,
        p_a_pa: s.p_a_pa + h * k.p_a_pa,
        p_b_pa: s.p_b_pa + h * k.p_b_pa,
        z_m: s.z_m + h * k.z_m,
        ..*s
    };
    commands
        .iter()
        .map(|u| {
            let inputs = plant.inputs(*u);
            for _ in 0..PER_TICK {
                let k1 = plant.derivative(&s, &inputs);
                let k2 = plant.derivative(&moved(&s, &k1, 0.5 * h), &inputs);
                let k3 = plant.derivative(&moved(&s, &k2, 0.5 * h), &inputs);
                let k4 = plant.derivative(&moved(&s, &k3, h), &inputs);
                let s1 = moved(&s, &k1, h / 6.0);
                let s2 = moved(&s1, &k2, h / 3.0);
                let s3 = moved(&s2, &k3, h / 3.0);
                s = moved(&s3, &k4, h / 6.0);
            }
            [s.y_m, s.p_a_pa, s.p_b_pa]
        })
        .collect()
}

fn distance(found: &Trace, truth: &Trace) -> (f64, f64) {
    found.iter().zip(truth).fold((0.0, 0.0), |(y, p): (f64, f64), (f, t)| {
        (y.max((f[0] - t[0]).abs()), p.max((f[1] - t[1]).abs()).max((f[2] - t[2]).abs()))
    })
}

fn main() {
    let cases = [
        ("a", Rig::<f64>::paper_a(), Reference::case_a()),
        ("b", Rig::paper_b(), Reference::case_b()),
        ("c", Rig::paper_c(), Reference::case_c()),
    ];
    println!("| case, input | integrator | times real time | y within, m | pressures within, Pa |");
    println!("| --- | --- | --- | --- | --- |");
    for (name, rig, reference) in &cases {
        for input in OpenLoop::ALL {
            let commands = sampled(input, TICKS, TICK_S);
            // An empty trace where diffsol gives up.
            let solve = |method, tolerance| -> Trace {
                let solved = library::simulate(reference, method, tolerance, reference.start(), &commands, TICK_S);
                solved.unwrap_or_default().iter().map(observed).collect()
            };
            let own = |method, tolerance| -> Trace {
                let solved = reference.simulate(method, tolerance, reference.start(), &commands, TICK_S);
                solved.expect("the equations are integrable").iter().map(observed).collect()
            };
            let truth = own(validation::Method::DormandPrince, 1e-10);
            // The truth of the tests and a library that shares nothing with it: the same to a thousandth of what is tested.
            let (y, p) = distance(&solve(Method::Tsit45, 1e-10), &truth);
            assert!(y < 1e-9 && p < 0.01, "case {name}, {input:?}: diffsol differs by {y:.1e} m, {p:.1e} Pa");
            let standard = || simulator(rig, Stepper::adaptive(&Tolerance::standard()), &commands);
            let equal = || simulator(rig, Stepper::equal_steps(1), &commands);
            let rk4 = || runge_kutta(rig, &commands);
            let dormand_prince = || own(validation::Method::DormandPrince, 1e-6);
            let tsit45 = || solve(Method::Tsit45, 1e-6);
            let esdirk34 = || solve(Method::Esdirk34, 1e-6);
            let bdf = || solve(Method::Bdf, 1e-6);
            let contenders: [(&str, &dyn Fn() -> Trace, usize); 7] = [
                ("plant-model, standard tolerance", &standard, ROUNDS),
                ("plant-model, one step a tick", &equal, ROUNDS),
                ("Runge-Kutta 4 at 100 us", &rk4, ROUNDS),
                ("Dormand-Prince of the tests, 1e-6", &dormand_prince, ROUNDS),
                ("diffsol tsit45, 1e-6", &tsit45, 3),
                ("diffsol esdirk34, 1e-6", &esdirk34, 2),
                ("diffsol BDF, 1e-6", &bdf, 2),
            ];
            let mut best = [Duration::MAX; 7];
            for round in 0..ROUNDS {
                for (slot, (_, run, rounds)) in best.iter_mut().zip(&contenders) {
                    if round < *rounds {
                        let start = Instant::now();
                        black_box(run());
                        *slot = (*slot).min(start.elapsed());
                    }
                }
            }
            for (time, (title, run, _)) in best.iter().zip(&contenders) {
                let found = run();
                if found.len() < TICKS {
                    println!("| {name}, {input:?} | {title} | gives up | | |");
                    continue;
                }
                let (y, p) = distance(&found, &truth);
                let factor = TICKS as f64 * TICK_S / time.as_secs_f64();
                println!("| {name}, {input:?} | {title} | {factor:.0} | {y:.1e} | {p:.1e} |");
            }
        }
    }
}
