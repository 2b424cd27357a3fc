//! A hundred saves, each with an erased page, while the loop goes on: none is refused, what was saved is found after a restart, and
//! no tick is lost.

use crate::bench::{Bench, Failure, Outcome, Session, restart, with_parameters_kept};
use board_link::{Command, Parameter};

const SAVES: u32 = 100;
/// Saves between two restarts.
const EVERY: u32 = 25;

/// See the file.
///
/// # Errors
/// A save is refused or forgotten, or a tick is lost.
pub fn saves<B: Bench>(bench: &mut B) -> Result<Outcome, Failure> {
    with_parameters_kept(bench, |bench| {
        Session::<B>::open(bench)?.idle_in_bench_mode()?;
        let mut longest_s = 0.0_f64;
        for number in 1..=SAVES {
            let value = (1 + number) as f32;
            let mut session = Session::<B>::open(bench)?;
            session.done(Command::Set(Parameter::TelemetryEvery, value))?;
            drop(session);
            let begun = bench.seconds();
            Session::<B>::open(bench)?
                .done(Command::Save)
                .map_err(|error| Failure(format!("save {number} of {SAVES}: {error}")))?;
            longest_s = longest_s.max(bench.seconds() - begun);
            if number % EVERY != 0 {
                continue;
            }
            let status = Session::<B>::open(bench)?.status()?;
            let lost = [status.overruns, status.late_ticks, status.missed_ticks];
            Failure::unless(lost == [0; 3], || format!("after {number} saves ticks overrun, late, missed: {lost:?}"))?;
            restart(bench)?;
            let mut session = Session::<B>::open(bench)?;
            let found = session.settings()?.get(Parameter::TelemetryEvery);
            Failure::unless(found == value, || {
                format!("after save {number} and a restart {found} is found, not {value}")
            })?;
            let state = session.status()?.state;
            Failure::unless(!state.contains("watchdog"), || format!("after {number} saves the board is `{state}`"))?;
            session.idle_in_bench_mode()?;
        }
        Ok(Outcome::Passed(format!("{SAVES} saves, the longest {:.0} ms, no tick lost", 1.0e3 * longest_s)))
    })
}
