//! The simulated cylinder on the chip gives the codes of the desktop: a move in bench mode, every reading compared bit by bit.
//!
//! When the board takes the order is not known to the tick, so the desktop's move is laid over the board's at each tick that is
//! possible; at one of them every answer must fit. A dead zone keeps the piston exactly at rest before.

use crate::bench::{Bench, Failure, Outcome, Session, with_parameters_kept};
use board_link::{Command, Generator, Parameter, Status, TextWord};
use control::{ExternalFaults, Mode};
use firmware_core::{Action, ControlLoop, Desk, Settings, Snapshot};
use plant_sim::commission::observe;

/// The moves, um from mid-stroke.
const TARGETS_UM: [i32; 3] = [45_000, -150_000, 10_000];
/// How long each is watched, ticks.
const SPAN: u32 = 3000;
/// Ticks between the order and its first possible effect, and the last.
const LATEST: u32 = 400;

/// What one tick shows.
type Shown = (i32, [u16; 4]);

/// The desktop's move: what each tick shows from the order on.
fn desktop(settings: &Settings, positions_um: &[i32]) -> Result<Vec<Vec<Shown>>, Failure> {
    let refused = |what: &str| Failure(format!("the desktop refuses {what}"));
    let setup = settings.setup().map_err(|error| Failure(error.to_string()))?;
    let mut control_loop = ControlLoop::new(setup, None);
    let mut desk = Desk::new(settings.clone(), "", "", TextWord::new());
    let snapshot = Snapshot::new();
    let run = |control_loop: &mut ControlLoop, ticks: u32| -> Vec<Shown> {
        let tick = |_| {
            let tick = control_loop.tick([0; 4], ExternalFaults::default(), true);
            control_loop.conclude();
            snapshot.publish(&tick.record, control_loop);
            let read = snapshot.read();
            (read.setpoint_um, read.codes)
        };
        (0..ticks).map(tick).collect()
    };
    let mut order = |control_loop: &mut ControlLoop, command: Command| match desk.decide(command, &snapshot, 0) {
        Ok(Action::Order(order, _)) => {
            control_loop.order(&order);
            Ok(())
        }
        _ => Err(refused(&format!("{command:?}"))),
    };
    order(&mut control_loop, Command::Bench { on: true })?;
    run(&mut control_loop, 500);
    if control_loop.mode() != Mode::Idle {
        return Err(refused("to become idle"));
    }
    order(&mut control_loop, Command::Arm)?;
    run(&mut control_loop, 500);
    let mut moves = Vec::new();
    for position_um in positions_um {
        order(&mut control_loop, Command::Generate(Generator::Hold { position_um: *position_um }))?;
        moves.push(run(&mut control_loop, SPAN + 2 * LATEST));
    }
    Ok(moves)
}

/// Whether a status is what a tick shows. The board reads its snapshot while ticks go on, so some of it may be one tick newer.
fn fits(status: &Status, at: &Shown, next: &Shown) -> bool {
    let code = |channel: usize| [at.1[channel], next.1[channel]].contains(&status.codes[channel]);
    [at.0, next.0].contains(&status.setpoint_um) && (0..4).all(code)
}

/// See the file.
///
/// # Errors
/// A reading differs.
pub fn model<B: Bench>(bench: &mut B) -> Result<Outcome, Failure> {
    with_parameters_kept(bench, |bench| {
        let mut compared = 0;
        for position_um in TARGETS_UM {
            // Each from rest at mid-stroke: bench mode begins anew.
            let mut session = Session::<B>::open(bench)?;
            session.done(Command::Bench { on: false })?;
            session.done(Command::Defaults)?;
            session.change(&[(Parameter::DeadZoneRight, 0.3), (Parameter::DeadZoneLeft, -0.3)])?;
            session.idle_in_bench_mode()?;
            let settings = session.settings()?;
            session.done(Command::Arm)?;
            let before = session.status()?.ticks;
            session.done(Command::Generate(Generator::Hold { position_um }))?;
            let seen = observe::ticks(session.client(), SPAN)?.statuses;
            session.done(Command::Disarm)?;
            let moves = desktop(&settings, &[position_um])?;
            let shown = moves.first().ok_or_else(|| Failure("no move".into()))?;
            // The tick at which the order was taken, after the one before it was sent.
            let fitting = |taken: u32| {
                let fits = |status: &&Status| {
                    let at = status.ticks.wrapping_sub(before).wrapping_sub(taken) as usize;
                    shown.get(at).zip(shown.get(at + 1)).is_some_and(|(at, next)| fits(status, at, next))
                };
                seen.iter().filter(fits).count()
            };
            let best = (1..LATEST).map(fitting).max().unwrap_or(0);
            let differs = seen.len() - best;
            Failure::unless(differs == 0, || {
                format!("of {} readings of a move to {position_um} um, {differs} are not the desktop's", seen.len())
            })?;
            Failure::unless(seen.last().is_some_and(|last| last.codes[0] != seen[0].codes[0]), || {
                "the simulated piston did not move".into()
            })?;
            compared += seen.len();
        }
        Ok(Outcome::Passed(format!("{compared} readings of {} moves are the desktop's, bit by bit", TARGETS_UM.len())))
    })
}
