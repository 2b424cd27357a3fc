//! Cost of one right-hand side and of one simulated millisecond. `cargo bench -p plant-model`.

use plant_model::{Effects, Plant, Rig, Simulator, State};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

const TICKS: u64 = 3000;

fn commands(sliding: bool) -> Vec<f64> {
    (0..TICKS)
        .map(|k| {
            let t = k as f64 * 1.0e-3;
            if sliding {
                0.8 * (TAU * t).cos() + 0.4 * (TAU * 2.3 * t + 0.4).sin()
            } else {
                0.06 * (TAU * 1.1 * t).sin()
            }
        })
        .collect()
}

/// Seconds of the fastest of fifteen runs: what the machine can do when nothing disturbs it.
fn fastest_s(mut run: impl FnMut()) -> f64 {
    let time_s = |_| {
        let start = Instant::now();
        run();
        start.elapsed().as_secs_f64()
    };
    (0..15).map(time_s).fold(f64::INFINITY, f64::min)
}

fn right_hand_side() {
    const CALLS: u32 = 100_000;
    let plant = Plant::new(&Rig::<f64>::paper_a(), &Effects::none()).expect("the paper's rig is valid");
    let inputs = plant.inputs(1.0);
    for (name, v) in [("sliding", 0.3), ("presliding", 0.003)] {
        let state = State { v_m_per_s: v, z_m: 4.0e-5, ..plant.state_at_rest(0.1, 4.0e5, 3.0e5) };
        let time_s = fastest_s(|| {
            for _ in 0..CALLS {
                black_box(plant.derivative(black_box(&state), black_box(&inputs)));
            }
        });
        println!("right-hand side, {name}: {:.1} ns", 1.0e9 * time_s / f64::from(CALLS));
    }
}

fn open_loop() {
    for (name, rig) in [("a", Rig::<f64>::paper_a()), ("b", Rig::paper_b()), ("c", Rig::paper_c())] {
        for (motion, sliding) in [("sliding", true), ("stick-slip", false)] {
            let commands = commands(sliding);
            let time_s = fastest_s(|| {
                let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).expect("valid");
                for u in &commands {
                    simulator.advance(*u, 1.0e-3);
                }
                black_box(simulator.state());
            });
            let real_time = TICKS as f64 * 1.0e-3 / time_s;
            println!("case ({name}), {motion}, 3 s at 1 kHz: {:.0} us, {real_time:.0} times real time", 1.0e6 * time_s);
        }
    }
}

fn main() {
    right_hand_side();
    open_loop();
}
