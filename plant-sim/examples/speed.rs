//! The real-time factor of the closed loop on one core: `cargo run --release -p plant-sim --example speed`.

use plant_sim::{ClosedLoop, LoopSettings, controller};
use rig_files::RigFile;
use std::time::Instant;

fn main() -> Result<(), plant_sim::LoopError> {
    for rig in [RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()] {
        let parameters = controller::parameters(&rig);
        let mut best = f64::INFINITY;
        let mut steps = 0;
        for _ in 0..5 {
            let mut positioner = ClosedLoop::new(&rig, &parameters, &LoopSettings::default())?;
            let start = Instant::now();
            for tick in 0..60_000_u32 {
                // A new target every two seconds: the piston moves most of the time.
                positioner.tick(if tick / 2000 % 2 == 0 { 0.045 } else { -0.045 });
            }
            best = best.min(start.elapsed().as_secs_f64());
            steps = positioner.simulator().stepper().steps();
        }
        let (factor, per_tick_ns) = (60.0 / best, best / 60_000.0 * 1e9);
        println!("{}: {factor:.0} times real time, {per_tick_ns:.0} ns a tick, {steps} integration steps", rig.name);
    }
    Ok(())
}
