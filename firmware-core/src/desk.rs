//! Commands → answers, and orders for the control loop. The desk decides; the shell carries bytes, orders and flash.

use board_link::{Command, LearnedValues, Refusal, Reply, StateWord, Status, TextWord, Version};
use control::{Mode, OperatorCommand};

use crate::control_loop::Order;
use crate::course::Course;
use crate::settings::{Kept, Settings};
use crate::snapshot::Snapshot;

/// What the shell has to do for a command.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and one exists at a time")]
pub enum Action {
    /// Nothing but send the answer.
    Reply(Reply),
    /// Hand the order to the control loop, wait until the loop has taken it, and answer [`Reply::Done`] if the mode is then
    /// as the outcome says, [`Refusal::State`] otherwise.
    Order(Order, OrderOutcome),
    /// Write [`Desk::settings`] to flash, then answer.
    Save,
    /// Put this in place of what was kept ([`Desk::keep`]) and write [`Desk::settings`] to flash, then answer; put back what was kept
    /// before if flash refuses.
    Keep(Option<Kept>),
    /// Answer with the records that nobody has asked for yet.
    Samples,
    /// Answer, then restart the board.
    Restart,
    /// Answer, then restart into the bootloader in ROM.
    Bootloader,
}

/// What shows that an order was carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OrderOutcome {
    /// Nothing to show.
    Any,
    /// The loop runs.
    Running,
    /// The loop is idle.
    Idle,
    /// The loop has left the safe state for the self-test, and has not fallen back.
    NotSafe,
}

impl OrderOutcome {
    /// Whether `mode` shows it.
    #[must_use]
    pub fn shown_by(self, mode: Mode) -> bool {
        match self {
            Self::Any => true,
            Self::Running => mode == Mode::Run,
            Self::Idle => mode == Mode::Idle,
            Self::NotSafe => !matches!(mode, Mode::Safe(_)),
        }
    }
}

/// The board's side of a conversation, past framing and sessions.
#[derive(Clone, Debug)]
pub struct Desk {
    settings: Settings,
    /// A change of several parameters under way.
    pending: Option<Settings>,
    tick_hz: u32,
    board: &'static str,
    firmware: &'static str,
    last_fault: TextWord,
}

impl Desk {
    /// A desk for a loop that runs with `settings`; `board` and `firmware` are told to whoever asks for the version,
    /// `last_fault` is the note of the previous run, empty if there was none.
    #[must_use]
    pub fn new(settings: Settings, board: &'static str, firmware: &'static str, last_fault: TextWord) -> Self {
        Self { tick_hz: settings.tick_hz(), settings, pending: None, board, firmware, last_fault }
    }

    /// What is saved: the settings in force, but for the tick rate, which waits for the next start.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Replaces what was kept; returns what was kept before.
    pub fn keep(&mut self, kept: Option<Kept>) -> Option<Kept> {
        core::mem::replace(&mut self.settings.kept, kept)
    }

    /// What the loop runs with: as [`Desk::settings`], with the tick rate of the timer.
    #[must_use]
    pub fn in_force(&self) -> Settings {
        at_rate(&self.settings, self.tick_hz)
    }

    /// Judges a command. `bad_frames` is told in the status.
    ///
    /// # Errors
    /// Why the command is refused; nothing has changed then.
    pub fn decide(&mut self, command: Command, now: &Snapshot, bad_frames: u32) -> Result<Action, Refusal> {
        let mode = now.mode();
        let only_in = |wanted: bool| if wanted { Ok(()) } else { Err(Refusal::State) };
        let order = |command, outcome| Ok(Action::Order(Order::Command(command), outcome));
        match command {
            // The session has answered it already.
            Command::Hello { .. } => Ok(Action::Reply(Reply::Done)),
            Command::Version => Ok(Action::Reply(Reply::Version(Version {
                firmware: short(self.firmware),
                board: short(self.board),
                tick_hz: self.tick_hz,
                parameters: crate::store::LAYOUT,
            }))),
            Command::Status => Ok(Action::Reply(Reply::Status(status(now, bad_frames)))),
            Command::LastFault => Ok(Action::Reply(Reply::Text(self.last_fault.clone()))),
            Command::Samples => Ok(Action::Samples),
            Command::Arm => {
                only_in(mode == Mode::Idle)?;
                order(OperatorCommand::Arm, OrderOutcome::Running)
            }
            Command::Disarm => {
                only_in(mode == Mode::Run)?;
                order(OperatorCommand::Disarm, OrderOutcome::Idle)
            }
            Command::Acknowledge => {
                only_in(matches!(mode, Mode::Safe(_)))?;
                order(OperatorCommand::ResetFault, OrderOutcome::NotSafe)
            }
            Command::Generate(generator) => {
                let course = Course::prepare(&generator, self.tick_hz).map_err(Refusal::Generator)?;
                Ok(Action::Order(Order::Course(course), OrderOutcome::Any))
            }
            Command::Get(parameter) => Ok(Action::Reply(Reply::Value(self.settings.get(parameter)))),
            Command::Set(parameter, value) => {
                only_in(mode != Mode::Run)?;
                let mut changed = self.settings.clone();
                changed.set(parameter, value).map_err(Refusal::Parameter)?;
                self.configure(changed)
            }
            Command::Begin => {
                only_in(mode != Mode::Run)?;
                self.pending = Some(self.settings.clone());
                Ok(Action::Reply(Reply::Done))
            }
            Command::Stage(parameter, value) => {
                let pending = self.pending.as_mut().ok_or(Refusal::NotBegun)?;
                pending.set(parameter, value).map_err(Refusal::Parameter)?;
                Ok(Action::Reply(Reply::Done))
            }
            Command::Apply => {
                only_in(mode != Mode::Run)?;
                let changed = self.pending.take().ok_or(Refusal::NotBegun)?;
                self.configure(changed)
            }
            Command::Defaults => {
                only_in(mode != Mode::Run)?;
                self.configure(Settings::default())
            }
            Command::Save => {
                only_in(mode != Mode::Run)?;
                Ok(Action::Save)
            }
            Command::Learned => Ok(Action::Reply(Reply::Learned(self.learned(now)?))),
            Command::Keep => {
                // In bench mode the simulated plant has taught it. What a fault taught is forgotten at its trip.
                only_in(mode == Mode::Idle && !now.bench())?;
                let learned = now.learned().filter(|_| now.has_learned()).ok_or(Refusal::NothingLearned)?;
                let rig = self.in_force().rig_check();
                Ok(Action::Keep(Some(Kept { rig, values: learned.values(self.tick_hz) })))
            }
            Command::Forget => {
                only_in(mode != Mode::Run)?;
                Ok(Action::Keep(None))
            }
            Command::Bench { on } => {
                only_in(mode != Mode::Run)?;
                let order = if on {
                    Order::BenchOn(self.in_force().bench_plant().ok_or(Refusal::Configuration(None))?)
                } else {
                    Order::BenchOff
                };
                Ok(Action::Order(order, OrderOutcome::Any))
            }
            Command::Restart => {
                only_in(mode != Mode::Run)?;
                Ok(Action::Restart)
            }
            Command::Bootloader => {
                only_in(mode != Mode::Run)?;
                Ok(Action::Bootloader)
            }
        }
    }

    /// What is learned, beside its nominal values and what was kept.
    #[inline(never)]
    fn learned(&self, now: &Snapshot) -> Result<LearnedValues, Refusal> {
        let settings = self.in_force();
        let (nominal, learned) = settings.nominal().zip(now.learned()).ok_or(Refusal::NothingLearned)?;
        Ok(LearnedValues {
            now: learned.values(self.tick_hz),
            nominal,
            kept: settings.kept.map(|kept| kept.values),
            refused: settings.kept_fits().err(),
        })
    }

    /// All or nothing: the settings change only if they fit together, at the present tick rate and at their own, with which the
    /// next start will read them.
    fn configure(&mut self, changed: Settings) -> Result<Action, Refusal> {
        let refused = |error| Refusal::Configuration(changed.named_by(&error));
        changed.rig().validate().map_err(refused)?;
        if changed.tick_hz() != self.tick_hz {
            changed.check().map_err(refused)?;
        }
        let setup = at_rate(&changed, self.tick_hz).setup().map_err(refused)?;
        self.settings = changed;
        // What was begun, began from other values.
        self.pending = None;
        Ok(Action::Order(Order::Configure(setup), OrderOutcome::Any))
    }
}

/// Settings at another tick rate. The rate was accepted once, so it is in range.
fn at_rate(settings: &Settings, tick_hz: u32) -> Settings {
    let mut settings = settings.clone();
    let _ = settings.set(board_link::Parameter::TickHz, tick_hz as f32);
    settings
}

/// As much of a text as fits.
fn short<const N: usize>(text: &str) -> heapless::String<N> {
    let mut out = heapless::String::new();
    for character in text.chars() {
        if out.push(character).is_err() {
            break;
        }
    }
    out
}

fn status(now: &Snapshot, bad_frames: u32) -> Status {
    use core::fmt::Write;
    let readings = now.read();
    let mut state = StateWord::new();
    // The longest state word is shorter than the capacity; a longer one would be cut.
    let _ = write!(state, "{}", readings.mode);
    Status {
        state,
        ticks: readings.ticks,
        codes: readings.codes,
        dac_code: readings.dac,
        setpoint_um: readings.setpoint_um,
        telemetry_lost: readings.records_lost,
        overruns: readings.overruns,
        late_ticks: readings.late_ticks,
        missed_ticks: readings.missed_ticks,
        disagreements: readings.disagreements,
        bad_frames,
        worst_cycles: readings.worst_cycles,
        bench: readings.bench,
    }
}
