//! The table of positioning goals, measured with the law in f64 on the simulated rig:
//! `cargo run --release -p plant-sim --example positioning [abc] [tick] [draws=200] [first=0] [moves=0]
//! [streams=0] [loads=0] [ends=0] [obstacles=0] [sines=0] [sine_hz=0.5]
//! [sent_ms=0] [sent_um=0] [sent_noise_um=0] [noise=1] [friction=1] [stiff=1] [valve_ms=0] [pressures_ms=0] [draws_mm=45] [hz=1000] [lost=0] [trace=45] [NAME=VALUE …]`. Constants were chosen on the first 20 seeds and 200 draws; `first=1000` measures on others.
//!
//! Set-up: valve lag 1.7 ms, dead zone ±0.42 V, noise of a code 20 um and 400 Pa, 16-bit codes over the stroke, 12-bit
//! DAC over ±5 V, 1 kHz, output one tick late.

mod arguments;
mod draws;
mod study;
mod tables;
mod trials;

use arguments::Arguments;
use study::Study;

fn main() {
    let arguments = Arguments::of_the_command_line();
    for case in arguments.cases().chars() {
        let study = Study::new(case, &arguments);
        println!(
            "case {case}: w {:.1}, V {:.3}, A {:.2}, J {:.1}",
            study.tuning.law_w, study.tuning.limits.speed, study.tuning.limits.acceleration, study.tuning.limits.jerk
        );
        if let Some(mm) = arguments.value("trace") {
            tables::trace(&study, mm);
            continue;
        }
        tables::moves(&study);
        tables::sines(&study);
        tables::draws(&study);
        tables::random(&study);
        tables::loads(&study);
        tables::ends(&study);
        tables::obstacles(&study);
        tables::streams(&study);
    }
}
