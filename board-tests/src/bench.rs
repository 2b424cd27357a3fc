//! A board under test, however it is reached.

use board_link::{Command, Reply, Status};
use firmware_core::Settings;
use plant_sim::board::{BoardError, Client};
use plant_sim::commission::transfer::TransferError;
use plant_sim::commission::{Change, observe, transfer};
use std::io::{Read, Write};

/// A board, a clock that is not its own, and what can be done to it from outside.
pub trait Bench {
    /// The serial line.
    type Port<'a>: Read + Write
    where
        Self: 'a;

    /// The serial line.
    fn port(&mut self) -> Self::Port<'_>;

    /// Seconds of a clock that is not the board's.
    fn seconds(&mut self) -> f64;

    /// Lets time pass.
    fn pause(&mut self, seconds: f64);

    /// Stops the core for so long and lets it go on. `None`: nothing here can.
    fn halt(&mut self, seconds: f64) -> Option<Result<(), String>>;

    /// Whether the valve output is wired to all four inputs.
    fn looped_back(&self) -> bool;
}

/// What a check found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All well: the numbers, for people.
    Passed(String),
    /// Not done, and why.
    Skipped(String),
}

/// What is not as it should be, as a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure(pub String);

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failure {}

impl From<BoardError> for Failure {
    fn from(error: BoardError) -> Self {
        Self(error.to_string())
    }
}

impl From<TransferError> for Failure {
    fn from(error: TransferError) -> Self {
        Self(error.to_string())
    }
}

impl Failure {
    /// Unless `met`, a failure with this sentence.
    ///
    /// # Errors
    /// It is not met.
    pub fn unless(met: bool, sentence: impl FnOnce() -> String) -> Result<(), Self> {
        if met { Ok(()) } else { Err(Self(sentence())) }
    }
}

/// A conversation with the board of a bench.
pub struct Session<'a, B: Bench + 'a> {
    client: Client<B::Port<'a>>,
}

/// How long a board may take from its reset to its first answer, s.
const BOOT_S: f64 = 1.0;

impl<'a, B: Bench + 'a> Session<'a, B> {
    /// Opens a session.
    ///
    /// # Errors
    /// No answer.
    pub fn open(bench: &'a mut B) -> Result<Self, Failure> {
        Ok(Self { client: Client::open(bench.port(), 1)? })
    }

    /// The line.
    pub fn client(&mut self) -> &mut Client<B::Port<'a>> {
        &mut self.client
    }

    /// Asks for something that has no answer but that it is done.
    ///
    /// # Errors
    /// No answer, or a refusal.
    pub fn done(&mut self, command: Command) -> Result<(), Failure> {
        match self.client.ask(command)? {
            Reply::Done => Ok(()),
            other => Err(Failure(format!("{command:?} was answered by {other:?}"))),
        }
    }

    /// State, readings and counters.
    ///
    /// # Errors
    /// No answer.
    pub fn status(&mut self) -> Result<Status, Failure> {
        Ok(observe::status(&mut self.client)?)
    }

    /// All parameters.
    ///
    /// # Errors
    /// No answer.
    pub fn settings(&mut self) -> Result<Settings, Failure> {
        Ok(transfer::read(&mut self.client)?)
    }

    /// Changes parameters at once.
    ///
    /// # Errors
    /// No answer, or a refusal.
    pub fn change(&mut self, changes: &[Change]) -> Result<(), Failure> {
        transfer::change(&mut self.client, changes)?;
        Ok(())
    }

    /// Waits until the board is in `state`, some seconds at most.
    ///
    /// # Errors
    /// It is not.
    pub fn wait_for(&mut self, state: &str) -> Result<Status, Failure> {
        let begun = self.status()?.ticks;
        loop {
            let status = self.status()?;
            if status.state == state {
                return Ok(status);
            }
            // Three seconds at 1 kHz; the self-test takes a tenth of one.
            if status.ticks.wrapping_sub(begun) > 3000 {
                return Err(Failure(format!("the board is `{}`, not `{state}`", status.state)));
            }
        }
    }

    /// The simulated cylinder instead of whatever is wired to the inputs, and idle.
    ///
    /// # Errors
    /// The board does not get there.
    pub fn idle_in_bench_mode(&mut self) -> Result<(), Failure> {
        if self.status()?.state == "run" {
            self.done(Command::Disarm)?;
        }
        self.done(Command::Bench { on: true })?;
        if self.status()?.state.starts_with("safe") {
            self.done(Command::Acknowledge)?;
        }
        self.wait_for("idle")?;
        Ok(())
    }
}

/// Restarts the board, and waits until it answers. Returns how long that took, s.
///
/// # Errors
/// It does not come back.
pub fn restart<B: Bench>(bench: &mut B) -> Result<f64, Failure> {
    let ask = |bench: &mut B| {
        let mut session = Session::<B>::open(bench)?;
        if session.status()?.state == "run" {
            session.done(Command::Disarm)?;
        }
        session.done(Command::Restart)
    };
    ask(bench).map_err(|error| Failure(format!("the board does not stay up to be asked for a restart: {error}")))?;
    let begun = bench.seconds();
    loop {
        bench.pause(0.05);
        // While it starts it is silent, or answers a session that it does not know.
        if Session::<B>::open(bench).and_then(|mut session| session.status()).is_ok() {
            return Ok(bench.seconds() - begun);
        }
        if bench.seconds() - begun > BOOT_S + 2.0 {
            return Err(Failure("the board does not answer after a restart".into()));
        }
    }
}

/// Runs `check` and puts the parameters back that were there before, in flash, too.
///
/// # Errors
/// What the check finds, or the parameters cannot be put back.
pub fn with_parameters_kept<B: Bench>(
    bench: &mut B,
    check: impl FnOnce(&mut B) -> Result<Outcome, Failure>,
) -> Result<Outcome, Failure> {
    let before = Session::open(bench)?.settings()?;
    let found = check(bench);
    let mut session = Session::<B>::open(bench)?;
    if session.status()?.state == "run" {
        session.done(Command::Disarm)?;
    }
    session.change(&board_link::Parameter::ALL.map(|parameter| (parameter, before.get(parameter))))?;
    session.done(Command::Bench { on: false })?;
    session.done(Command::Save)?;
    found
}
