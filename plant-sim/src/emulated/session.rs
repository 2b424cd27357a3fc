//! A board that waits between commands: what a person at the bench has, without the bench. Its time passes while it is asked and
//! while it is told to wait, and never by itself.

use super::EmulatedError;
use super::board::Board;
use super::cylinder::Cylinder;
use super::line::Line;
use crate::board::Client;
use crate::sensors::CodeNoise;
use crate::telemetry::{Recorder, Remark, decode, format_table};
use defmt_decoder::{StreamDecoder, Table};
use rig_files::{Log, RigFile};
use stm32_emulator::time::to_seconds;

/// Until the board listens, s.
const BOOT_S: f64 = 0.05;

/// A board with its cylinder, and the log of its telemetry.
pub struct Session {
    board: Board<Cylinder>,
    sessions: u32,
    table: Table,
    /// Telemetry since power-up, not decoded.
    stream: Vec<u8>,
}

/// What can be measured at the board and the cylinder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Simulated time since the first power-up, s.
    pub t_s: f64,
    /// The valve's voltage about mid position, V.
    pub valve_v: f64,
    /// The air output is high.
    pub air: bool,
    /// True position, m.
    pub y_m: f64,
}

impl Session {
    /// Powers a board up with the cylinder of `rig` at its pins.
    ///
    /// # Errors
    /// The file is no firmware with telemetry, or the rig is not possible.
    pub fn start(elf: &[u8], file: &str, rig: &RigFile, noise: &CodeNoise, seed: u64) -> Result<Self, EmulatedError> {
        let other = |error: &dyn std::fmt::Display| EmulatedError::Other(error.to_string());
        let table = format_table(elf, file).map_err(|error| other(&error))?;
        let cylinder = Cylinder::new(rig, noise, seed).map_err(|error| other(&error))?;
        let mut session = Self { board: Board::power_up(elf, cylinder)?, sessions: 0, table, stream: Vec::new() };
        session.wait(BOOT_S)?;
        Ok(session)
    }

    /// The serial line, a session open.
    ///
    /// # Errors
    /// The board does not answer.
    pub fn client(&mut self) -> Result<Client<Line<'_, Cylinder>>, EmulatedError> {
        self.sessions += 1;
        Ok(Client::open(Line::to(&mut self.board), self.sessions)?)
    }

    /// Lets time pass.
    ///
    /// # Errors
    /// The firmware did what is not modelled.
    pub fn wait(&mut self, seconds: f64) -> Result<(), EmulatedError> {
        self.board.run(seconds)?;
        let log = self.board.take_log();
        self.stream.extend(log);
        Ok(())
    }

    /// The supply of the board fails and returns.
    ///
    /// # Errors
    /// Flash holds no firmware any more.
    pub fn power_cycle(&mut self) -> Result<(), EmulatedError> {
        self.board.power_cycle()?;
        self.wait(BOOT_S)
    }

    /// Forgets the telemetry so far.
    pub fn forget_telemetry(&mut self) {
        let _ = self.board.take_log();
        self.stream.clear();
    }

    /// The cylinder, to push it or to change its supply.
    pub fn cylinder(&mut self) -> &mut Cylinder {
        self.board.analog()
    }

    /// The board.
    pub fn board(&mut self) -> &mut Board<Cylinder> {
        &mut self.board
    }

    /// What a meter and the eye would show.
    pub fn measured(&mut self) -> Measured {
        let t_s = to_seconds(self.board.now());
        let air = self.board.machine().chip.gpio[1].driven(0) == Some(true);
        let cylinder = self.board.analog();
        Measured { t_s, valve_v: cylinder.valve_v(), air, y_m: cylinder.position_m() }
    }

    /// The telemetry so far as a log, as `plant-sim record` makes it, and what the board has said.
    pub fn telemetry(&mut self) -> (Log, Vec<Remark>) {
        let log = self.board.take_log();
        self.stream.extend(log);
        let mut decoder: Box<dyn StreamDecoder + Send + Sync + '_> = self.table.new_stream_decoder();
        let (mut recorder, mut remarks) = (Recorder::new(), Vec::new());
        decode(decoder.as_mut(), &self.stream, &mut recorder, &mut remarks);
        (recorder.log().clone(), remarks)
    }
}
