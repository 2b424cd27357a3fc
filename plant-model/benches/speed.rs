//! Cost of one right-hand side and of one simulated millisecond. `cargo bench -p plant-model`.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use plant_model::{Effects, Plant, Rig, Simulator, State};
use std::f64::consts::TAU;
use std::hint::black_box;

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

fn right_hand_side(criterion: &mut Criterion) {
    let plant = Plant::new(&Rig::<f64>::paper_a(), &Effects::none()).expect("the paper's rig is valid");
    let inputs = plant.inputs(1.0);
    for (name, v) in [("sliding", 0.3), ("presliding", 0.003)] {
        let state = State { v_m_per_s: v, z_m: 4.0e-5, ..plant.state_at_rest(0.1, 4.0e5, 3.0e5) };
        criterion.bench_function(&format!("right-hand side, {name}"), |b| {
            b.iter(|| plant.derivative(black_box(&state), black_box(&inputs)));
        });
    }
}

/// Time per element is time per tick; the real-time factor is 1 ms divided by it.
fn ticks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("open loop at 1 kHz");
    group.throughput(Throughput::Elements(TICKS));
    for (name, rig) in [("a", Rig::<f64>::paper_a()), ("b", Rig::paper_b()), ("c", Rig::paper_c())] {
        for (motion, sliding) in [("sliding", true), ("stick-slip", false)] {
            let commands = commands(sliding);
            group.bench_function(format!("case ({name}), {motion}"), |b| {
                b.iter(|| {
                    let mut simulator = Simulator::<f64>::new(&rig, &Effects::none()).expect("valid");
                    for u in &commands {
                        simulator.advance(*u, 1.0e-3);
                    }
                    black_box(*simulator.state())
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, right_hand_side, ticks);
criterion_main!(benches);
