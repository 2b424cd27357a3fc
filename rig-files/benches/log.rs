//! Reading a log of 40 s at 1 kHz with all eight columns, from disk, checks included; best of several.
//! `cargo bench -p rig-files`.

use rig_files::Log;
use std::hint::black_box;
use std::time::{Duration, Instant};

const ROWS: u32 = 40_000;
const ROUNDS: usize = 20;

/// Numbers with all their digits, as a simulator writes them.
fn log() -> Log {
    let column = |scale: f64, offset: f64| Some((0..ROWS).map(|k| offset + scale * f64::from(k).sin()).collect());
    Log {
        t_s: (0..ROWS).map(|k| f64::from(k) * 1.0e-3).collect(),
        y_m: column(0.2, 0.0).unwrap_or_default(),
        u_v: column(4.0, 0.0),
        p_a_pa: column(1.0e5, 3.6e5),
        p_b_pa: column(-1.0e5, 3.6e5),
        p_sup_pa: column(1.0e3, 7.0e5),
        f_ext_n: column(10.0, 0.0),
        y_ref_m: column(0.2, 0.01),
        ..Log::default()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("log.csv");
    let written = log();
    written.write(&path)?;
    let mut best = Duration::MAX;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        let read = black_box(Log::read(&path)?);
        best = best.min(start.elapsed());
        assert_eq!(read, written, "numbers read back to the same bits");
    }
    let megabytes = std::fs::metadata(&path)?.len() as f64 * 1.0e-6;
    println!("{ROWS} rows, 8 columns, {megabytes:.1} MB: {:.1} ms", 1e3 * best.as_secs_f64());
    Ok(())
}
