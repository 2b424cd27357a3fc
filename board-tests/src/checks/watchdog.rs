//! A core that stops is reset by the watchdog, and the next start says so.

use crate::bench::{Bench, Failure, Outcome, Session};
use board_link::Command;

/// Longer than the watchdog waits: 20 ms, and 5 % more.
const HALT_S: f64 = 0.1;

/// See the file.
///
/// # Errors
/// No reset, or none that is called by its name.
pub fn watchdog<B: Bench>(bench: &mut B) -> Result<Outcome, Failure> {
    Session::<B>::open(bench)?.idle_in_bench_mode()?;
    match bench.halt(HALT_S) {
        None => return Ok(Outcome::Skipped("only a debug probe can stop the core: --features probe".into())),
        Some(done) => done.map_err(Failure)?,
    }
    bench.pause(0.5);
    let mut session = Session::<B>::open(bench)?;
    let status = session.status()?;
    Failure::unless(status.state == "safe:watchdog-reset", || {
        format!("after the core stood still for {HALT_S} s the board is `{}`", status.state)
    })?;
    Failure::unless(!status.bench, || "the board was not reset: it is in bench mode still".into())?;
    session.done(Command::Bench { on: true })?;
    session.done(Command::Acknowledge)?;
    session.wait_for("idle")?;
    session.done(Command::Bench { on: false })?;
    Ok(Outcome::Passed("a halted core is reset, and `safe:watchdog-reset` latched".into()))
}
