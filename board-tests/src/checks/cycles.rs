//! A tick takes the time it may, by the chip's own cycle counter: at 1 kHz and in bench mode at 10 kHz, the dearest there is.

use crate::bench::{Bench, Failure, Outcome, Session, restart, with_parameters_kept};
use board_link::{Command, Generator, Parameter, Shape};

/// Core clock, 1/s.
const CORE_HZ: f32 = 170.0e6;
/// How long the piston is moved, s.
const SPAN_S: f64 = 2.0;

/// See the file.
///
/// # Errors
/// A tick takes too long, or ticks are late, missed or overrun.
pub fn cycles<B: Bench>(bench: &mut B) -> Result<Outcome, Failure> {
    with_parameters_kept(bench, |bench| {
        let mut found = Vec::new();
        for tick_hz in [1000.0, 10_000.0] {
            let mut session = Session::<B>::open(bench)?;
            if session.status()?.state == "run" {
                session.done(Command::Disarm)?;
            }
            session.done(Command::Defaults)?;
            session.change(&[(Parameter::TickHz, tick_hz), (Parameter::TelemetryEvery, 10.0)])?;
            session.done(Command::Save)?;
            drop(session);
            restart(bench)?;
            let mut session = Session::<B>::open(bench)?;
            session.idle_in_bench_mode()?;
            let before = session.status()?;
            session.done(Command::Arm)?;
            let (shape, centre_um, amplitude_um, period_ms) = (Shape::Sine, 0, 50_000, 1000);
            session.done(Command::Generate(Generator::Repeat { shape, centre_um, amplitude_um, period_ms }))?;
            drop(session);
            bench.pause(SPAN_S);
            let mut session = Session::<B>::open(bench)?;
            let status = session.status()?;
            session.done(Command::Disarm)?;
            Failure::unless(status.state == "run", || format!("at {tick_hz} Hz the board went to `{}`", status.state))?;
            let counts = |s: &board_link::Status| [s.overruns, s.late_ticks, s.missed_ticks];
            Failure::unless(counts(&status) == counts(&before), || {
                format!("at {tick_hz} Hz ticks overrun, late, missed: {:?}", counts(&status))
            })?;
            // Since the start: the tick that took bench mode's plant from the queue is the dearest, and no tick while running.
            let cycles = status.worst_cycles;
            Failure::unless((1.0..CORE_HZ / tick_hz).contains(&(cycles as f32)), || {
                format!("at {tick_hz} Hz a tick took {cycles} cycles, of {}", CORE_HZ / tick_hz)
            })?;
            found.push(format!("{cycles} at {} kHz", tick_hz / 1000.0));
        }
        let found = found.join(", ");
        Ok(Outcome::Passed(format!(
            "most cycles from interrupt to valve code, bench mode and orders included: {found}"
        )))
    })
}
