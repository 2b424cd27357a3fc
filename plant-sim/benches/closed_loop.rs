//! Closed loop at 1 kHz: plant, noisy quantised converters and the firmware's fixed-point tick, on one core and in a
//! batch on all; best of several runs. `cargo bench -p plant-sim`.

use plant_sim::controller::parameters;
use plant_sim::{ClosedLoop, ConversionNoise, LoopSettings, MonitorAction};
use rayon::prelude::*;
use rig_files::RigFile;
use std::hint::black_box;
use std::time::{Duration, Instant};

const TICKS: u32 = 10_000;
const ROUNDS: usize = 15;

/// Ten seconds of square-wave positioning of ±45 mm, a step every two seconds.
fn run(rig: &RigFile, settings: &LoopSettings) -> f64 {
    let mut closed = ClosedLoop::new(rig, &parameters(rig), settings).expect("the paper's rigs are valid");
    for k in 0..TICKS {
        let y_ref_m = if (k / 2000).is_multiple_of(2) { 0.045 } else { -0.045 };
        black_box(closed.tick(y_ref_m));
    }
    closed.position_m()
}

fn best(mut work: impl FnMut()) -> Duration {
    (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed()
        })
        .min()
        .unwrap_or_default()
}

fn main() {
    let simulated_s = f64::from(TICKS) * 1.0e-3;
    println!(
        "| rig | converters | ns per tick | times real time, one core | batch, {} threads |",
        rayon::current_num_threads()
    );
    println!("| --- | --- | --- | --- | --- |");
    let (noisy, quiet) = (ConversionNoise::default(), ConversionNoise::NONE);
    for (name, rig) in [("a", RigFile::paper_a()), ("b", RigFile::paper_b()), ("c", RigFile::paper_c())] {
        for (converters, noise, monitor) in [
            ("quantised, noisy", noisy, MonitorAction::Trip),
            ("quantised, noisy, no monitor", noisy, MonitorAction::Off),
            ("quantised, no monitor", quiet, MonitorAction::Off),
        ] {
            let settings = LoopSettings { noise, monitor, ..LoopSettings::default() };
            let single = best(|| {
                black_box(run(&rig, &settings));
            });
            let batch = 16;
            let all = best(|| {
                let sum: f64 =
                    (0..batch).into_par_iter().map(|seed| run(&rig, &LoopSettings { seed, ..settings })).sum();
                black_box(sum);
            });
            println!(
                "| {name} | {converters} | {:.0} | {:.0} | {:.0} |",
                single.as_secs_f64() / f64::from(TICKS) * 1e9,
                simulated_s / single.as_secs_f64(),
                simulated_s * batch as f64 / all.as_secs_f64()
            );
        }
    }
}
