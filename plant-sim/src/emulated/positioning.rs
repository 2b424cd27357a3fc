//! The positioning step of `plant-sim run` on the emulated board: commissioned over the serial line, saved, powered up again,
//! armed, told to hold the target, and recorded tick by tick.

use super::EmulatedError;
use super::board::Event;
use super::commission;
use super::session::Session;
use crate::board::BoardError;
use crate::closed_loop::{LoopRecord, LoopSettings};
use crate::recording::Recording;
use crate::telemetry::Remark;
use board_link::{Command, Generator, Parameter, Refusal, Reply};
use control::{Mode, Parameters, Reason};
use firmware_core::code_of_sum;
use monitor::MonitorParameters;
use rig_files::{Log, RigFile};
use stm32_emulator::time::{from_seconds, to_seconds};

/// Longest wait for the self-test, s, and how often the board is asked.
const IDLE_S: f64 = 5.0;
const ASK_S: f64 = 0.05;

/// What a run on the board has shown.
#[derive(Clone, Debug)]
pub struct Positioned {
    /// As of the simulated loop.
    pub recording: Recording,
    /// The board's telemetry, as `plant-sim record` makes it a log.
    pub telemetry: Log,
    /// Most instructions and estimated cycles from the interrupt's entry to the valve code.
    pub most: (u64, u64),
}

/// The state word of the board.
fn state(session: &mut Session) -> Result<String, EmulatedError> {
    match session.client()?.ask(Command::Status)? {
        Reply::Status(status) => Ok(status.state.to_string()),
        _ => Err(EmulatedError::Other("the board's answer to `status` is none".into())),
    }
}

fn mode_of(word: &str) -> Mode {
    let safe = Reason::ALL.into_iter().map(Mode::Safe);
    let known = [Mode::Boot, Mode::Idle, Mode::Run].into_iter().chain(safe);
    known.into_iter().find(|mode| mode.to_string() == word).unwrap_or(Mode::SelfTest { ticks_left: 0 })
}

/// Moves the piston from rest at mid-stroke to `target_m` and records `ticks`.
///
/// # Errors
/// The board does not take the numbers, does not become idle, or does what is not modelled.
pub fn position(
    (elf, file): (&[u8], &str),
    rig: &RigFile,
    parameters: &Parameters,
    settings: &LoopSettings,
    ticks: usize,
    target_m: f64,
) -> Result<Positioned, EmulatedError> {
    let mut board = commission::settings(&rig.rig, parameters, settings.monitor, &MonitorParameters::default())?;
    board.set(Parameter::TelemetryEvery, 1.0).map_err(|_| EmulatedError::Other("telemetry in every tick".into()))?;
    let noise = settings.noise.of_code(&rig.io, settings.oversampling, settings.raw_bits);
    let mut session = Session::start(elf, file, rig, &noise, settings.seed)?;
    commission::apply(session.board(), &board)?;
    session.forget_telemetry();
    let ticks_before = session.board().ticks();
    session.power_cycle()?;
    let mut waited_s = 0.0;
    while state(&mut session)? != "idle" {
        session.wait(ASK_S)?;
        waited_s += ASK_S;
        if waited_s > IDLE_S {
            let word = state(&mut session)?;
            return Err(EmulatedError::Other(format!("{}: the board does not become idle but {word}", rig.name)));
        }
    }
    {
        let mut client = session.client()?;
        client.ask(Command::Arm)?;
        client.post(Command::Generate(Generator::Hold { position_um: (target_m * 1.0e6).round() as i32 }))?;
    }
    let mut recording = Recording::default();
    let (mut begun, mut first_tick, mut most) = (None, 0, (0, 0));
    while recording.t_s.len() < ticks {
        let end = session.board().now() + from_seconds(2.0 / f64::from(rig.io.tick_hz));
        match session.board().advance(end)? {
            Event::Wrote(tick) => {
                most = (most.0.max(tick.instructions), most.1.max(tick.cycles));
                let valve = session.cylinder().valve_v();
                let sampled = *session.cylinder().sampled();
                if begun.is_none() {
                    first_tick = session.board().ticks() - ticks_before;
                }
                let from = *begun.get_or_insert(sampled.at);
                let seen = LoopRecord {
                    t_s: to_seconds(sampled.at - from),
                    adc: sampled.sums.map(code_of_sum),
                    dac: tick.code,
                    mode: Mode::Run,
                    disagreement: false,
                    u_v: valve,
                    plant: sampled.plant,
                };
                recording.push(&rig.io, target_m, &seen);
            }
            Event::Entered => {}
            Event::Reset(cause) => return Err(EmulatedError::Other(format!("the chip was reset ({cause:?})"))),
            Event::Time => return Err(EmulatedError::Other("the ticks have stopped".into())),
        }
    }
    recording.mode = mode_of(&state(&mut session)?);
    recording.learned = match session.client()?.ask(Command::Learned) {
        Ok(Reply::Learned(values)) => Some(values),
        Ok(_) => return Err(BoardError::Unexpected.into()),
        Err(BoardError::Refused(Refusal::NothingLearned)) => None,
        Err(error) => return Err(error.into()),
    };
    let (telemetry, remarks) = session.telemetry();
    recording.contradicted_s = remarks.iter().find_map(|remark| match remark {
        Remark::Disagreement(t_s) => Some(*t_s - first_tick as f64 / f64::from(rig.io.tick_hz)),
        _ => None,
    });
    Ok(Positioned { recording, telemetry, most })
}
