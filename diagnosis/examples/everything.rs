//! Rigs with all that data sheets leave out, described by their data sheets: how much of the gap the extended rig closes, and
//! whether what is named is there. Prints the table of `docs/diagnosis.md`, one row for each seed.
//!
//! ```text
//! RAYON_NUM_THREADS=1 cargo run --release -p diagnosis --example everything -- 701 702 703 704
//! ```

use diagnosis::{Cause, Gain, diagnose};
use rig_files::RigFile;
use std::path::Path;
use std::time::Instant;
use synthesis::{furnished, is_furnished_with};

/// Position errors of data sheets, extended rig and noise alone, mm.
fn errors_mm(gain: &Gain) -> [f64; 3] {
    let held = &gain.holdout;
    [&held.baseline_rmse, &held.extended_rmse, &held.noise_floor].map(|e| 1.0e3 * e.y_m.unwrap_or(f64::NAN))
}

fn main() {
    let seeds: Result<Vec<u64>, _> = std::env::args().skip(1).map(|seed| seed.parse()).collect();
    let Some(seeds) = seeds.ok().filter(|seeds| !seeds.is_empty()) else {
        eprintln!("error: seeds are whole numbers, as in `everything 701 702`");
        std::process::exit(2);
    };
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../rigs/festo-dsbc-32-200.toml");
    let sheet = RigFile::read(&file).expect("a shipped rig");
    println!(
        "| seed | at 0.2 s: data sheets, mm | extended rig | noise alone | closed | at 1 s: data sheets | extended rig | noise alone | s | named | not there |"
    );
    println!("|{}", " --- |".repeat(11));
    for seed in seeds {
        let case = furnished(&sheet, 40.0, seed);
        let log = case.record().0;
        let start = Instant::now();
        let found = diagnose(&case.rig_file, &log, &|_| {}).expect("a full log");
        let seconds = start.elapsed().as_secs_f64();
        let there = |cause: &&Cause| is_furnished_with(&case, &cause.id, &cause.ties);
        let ids =
            |causes: &[&Cause]| causes.iter().map(|cause| format!("`{}`", cause.id)).collect::<Vec<_>>().join(", ");
        let (right, wrong): (Vec<&Cause>, Vec<&Cause>) = found.causes.iter().partition(there);
        let [before, after, noise] = found.gain.as_ref().map_or([f64::NAN; 3], errors_mm);
        let second = found.horizons.iter().find(|gain| gain.horizon_s == 1.0);
        let [before_1, after_1, noise_1] = second.map_or([f64::NAN; 3], errors_mm);
        println!(
            "| {seed} | {before:.2} | {after:.2} | {noise:.2} | {:.0} % | {before_1:.2} | {after_1:.2} | {noise_1:.2} | {seconds:.0} | {} | {} |",
            100.0 * (before - after) / (before - noise),
            ids(&right),
            ids(&wrong),
        );
    }
}
