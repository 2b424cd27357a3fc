//! The firmware of these sources starts, without a fault on record.

use crate::bench::{Bench, Failure, Outcome, Session, restart};
use board_link::{Command, Reply};
use plant_sim::commission::observe;

/// The self-test is over by then: 0.1 s, and what the board takes to start.
const SETTLED_S: f64 = 0.5;

/// See the file.
///
/// # Errors
/// Another firmware, a fault on record, a state that only a fault leads to.
pub fn boot<B: Bench>(bench: &mut B) -> Result<Outcome, Failure> {
    let took_s = restart(bench)?;
    bench.pause(SETTLED_S);
    let mut session = Session::<B>::open(bench)?;
    let version = observe::version(session.client())?;
    let wanted = env!("CARGO_PKG_VERSION");
    Failure::unless(version.firmware == wanted, || format!("firmware {} runs, not {wanted}", version.firmware))?;
    let status = session.status()?;
    // Without a rig the inputs float, and the self-test fails by what they read; nothing else may be wrong.
    let state = status.state.as_str();
    let healthy = state == "idle" || ["range", "rate", "stuck", "supply-low"].iter().any(|end| state.ends_with(end));
    Failure::unless(healthy, || format!("after the start the board is `{state}`"))?;
    match session.client().ask(Command::LastFault)? {
        Reply::Text(text) if text.is_empty() => {}
        other => return Err(Failure(format!("a fault is on record: {other:?}"))),
    }
    Ok(Outcome::Passed(format!(
        "{} on {}, answers {took_s:.2} s after a restart, then `{state}`",
        version.firmware, version.board
    )))
}
