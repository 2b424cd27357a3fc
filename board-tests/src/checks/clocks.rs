//! A second of the board is a second: its ticks against a clock that is not its own.

use crate::bench::{Bench, Failure, Outcome, Session};
use plant_sim::commission::observe;

/// How long they are compared, s.
const SPAN_S: f64 = 5.0;
/// HSI16: ±1 % from 0 to 85 °C (DS12288, table of the oscillator); the rest is for what an answer takes.
const TOLERANCE: f64 = 0.015;

/// See the file.
///
/// # Errors
/// The tick rate is off by more than the oscillator may be.
pub fn clocks<B: Bench>(bench: &mut B) -> Result<Outcome, Failure> {
    let tick_hz = f64::from(observe::version(Session::<B>::open(bench)?.client())?.tick_hz);
    // An instant of the board, and of the other clock in the middle of question and answer.
    let instant = |bench: &mut B| -> Result<(u32, f64), Failure> {
        let before = bench.seconds();
        let ticks = Session::<B>::open(bench)?.status()?.ticks;
        Ok((ticks, 0.5 * (before + bench.seconds())))
    };
    let (first, begun_s) = instant(bench)?;
    bench.pause(SPAN_S);
    let (last, ended_s) = instant(bench)?;
    let ratio = f64::from(last.wrapping_sub(first)) / tick_hz / (ended_s - begun_s);
    Failure::unless((ratio - 1.0).abs() < TOLERANCE, || {
        format!("a second of the board is {:.4} s of the other clock", 1.0 / ratio)
    })?;
    Ok(Outcome::Passed(format!("the board's clock is {:+.2} % fast", 100.0 * (ratio - 1.0))))
}
