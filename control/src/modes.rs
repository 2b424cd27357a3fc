//! What the controller may do, and what may follow what.
//!
//! ```text
//!            ┌───────────┐  plausible for   ┌──────┐  arm     ┌─────┐
//!  boot ───► │ self-test │ ───────────────► │ idle │ ───────► │ run │
//!            └───────────┘  self_test_time  └──────┘ ◄─────── └─────┘
//!              ▲       │                        │    disarm      │
//!  reset-fault │       │ implausible sensor     │ sensor fault   │ any fault
//!              │       ▼                        ▼                ▼
//!            ┌──────────────────────────────────────────────────────┐
//!            │ safe: reason latched, valve at the safe voltage,     │
//!            │ from run at the latest after the controlled stop     │
//!            └──────────────────────────────────────────────────────┘
//! ```
//!
//! Only `run` moves the valve, and the controlled stop (`stop.rs`) with which `safe` may begin; otherwise it stands at the safe
//! voltage. Nothing leaves `safe` by itself, and a
//! reset never leads to `run`: the sensors are tested anew, then the operator arms. A command that does not fit the mode
//! changes nothing.

/// The sensors, in the order of the input line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum Channel {
    /// Piston position.
    Position,
    /// Pressure of chamber A.
    PressureA,
    /// Pressure of chamber B.
    PressureB,
    /// Supply pressure.
    Supply,
}

impl Channel {
    /// All four, in the order of the codes.
    pub const ALL: [Self; 4] = [Self::Position, Self::PressureA, Self::PressureB, Self::Supply];

    /// What people call it.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::PressureA => "pressure A",
            Self::PressureB => "pressure B",
            Self::Supply => "supply",
        }
    }
}

/// Why the controller went to the safe state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// A reading outside what the sensor can deliver: wire broken, shorted, supply of the sensor lost.
    Range(Channel),
    /// A reading that repeats one code although it was noisy, or that froze in mid-move.
    Stuck(Channel),
    /// A reading that jumps faster than the plant can.
    Rate(Channel),
    /// Readings that contradict each other, by the on-board model.
    ModelDisagreement,
    /// Supply pressure below its minimum.
    SupplyLow,
    /// The shell saw ticks that did not happen.
    MissedTick,
    /// The shell saw ticks that came late or ended late.
    LateTick,
    /// A sample was lost between converter and controller.
    Overrun,
    /// No command from the host for longer than allowed.
    CommandTimeOut,
    /// The last reset came from the watchdog.
    WatchdogReset,
    /// The last reset followed a stack overflow.
    StackOverflow,
    /// The last reset followed a panic.
    Panic,
    /// The stored parameters cannot be read: the defaults are in force.
    ParametersUnreadable,
    /// What the loop remembers from tick to tick has changed in between.
    MemoryCorrupted,
    /// The valve output does not show what was written to it.
    ValveOutput,
}

impl Reason {
    /// Every reason once, for tables and tests.
    pub const ALL: [Self; 24] = [
        Self::Range(Channel::Position),
        Self::Range(Channel::PressureA),
        Self::Range(Channel::PressureB),
        Self::Range(Channel::Supply),
        Self::Stuck(Channel::Position),
        Self::Stuck(Channel::PressureA),
        Self::Stuck(Channel::PressureB),
        Self::Stuck(Channel::Supply),
        Self::Rate(Channel::Position),
        Self::Rate(Channel::PressureA),
        Self::Rate(Channel::PressureB),
        Self::Rate(Channel::Supply),
        Self::ModelDisagreement,
        Self::SupplyLow,
        Self::MissedTick,
        Self::LateTick,
        Self::Overrun,
        Self::CommandTimeOut,
        Self::WatchdogReset,
        Self::StackOverflow,
        Self::Panic,
        Self::ParametersUnreadable,
        Self::MemoryCorrupted,
        Self::ValveOutput,
    ];

    /// One kebab-case word.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        use Channel::{Position, PressureA, PressureB, Supply};
        match self {
            Self::Range(Position) => "position-range",
            Self::Range(PressureA) => "pressure-a-range",
            Self::Range(PressureB) => "pressure-b-range",
            Self::Range(Supply) => "supply-range",
            Self::Stuck(Position) => "position-stuck",
            Self::Stuck(PressureA) => "pressure-a-stuck",
            Self::Stuck(PressureB) => "pressure-b-stuck",
            Self::Stuck(Supply) => "supply-stuck",
            Self::Rate(Position) => "position-rate",
            Self::Rate(PressureA) => "pressure-a-rate",
            Self::Rate(PressureB) => "pressure-b-rate",
            Self::Rate(Supply) => "supply-rate",
            Self::ModelDisagreement => "model-disagreement",
            Self::SupplyLow => "supply-low",
            Self::MissedTick => "missed-tick",
            Self::LateTick => "late-tick",
            Self::Overrun => "overrun",
            Self::CommandTimeOut => "command-time-out",
            Self::WatchdogReset => "watchdog-reset",
            Self::StackOverflow => "stack-overflow",
            Self::Panic => "panic",
            Self::ParametersUnreadable => "parameters-unreadable",
            Self::MemoryCorrupted => "memory-corrupted",
            Self::ValveOutput => "valve-output",
        }
    }

    /// A number for wires and flash; stable, append only. The inverse of [`Reason::from_code`].
    #[must_use]
    pub fn code(self) -> u8 {
        let mut code = 0;
        while Self::ALL.get(usize::from(code)).is_some_and(|reason| *reason != self) {
            code += 1;
        }
        code
    }

    /// The reason of a number; `None` for a number that names none.
    #[must_use]
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }
}

impl core::fmt::Display for Reason {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// What the controller is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Before the first tick.
    #[default]
    Boot,
    /// Waiting for every sensor to be plausible for the self-test time; valve at the safe voltage.
    SelfTest {
        /// Ticks left to pass.
        ticks_left: u32,
    },
    /// Healthy and not armed; valve at the safe voltage.
    Idle,
    /// Armed: the law drives the valve.
    Run,
    /// Latched after a fault; valve at the safe voltage, once a controlled stop has ended.
    Safe(Reason),
}

impl core::fmt::Display for Mode {
    /// One word: `boot`, `self-test`, `idle`, `run` or `safe:REASON`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Boot => f.write_str("boot"),
            Self::SelfTest { .. } => f.write_str("self-test"),
            Self::Idle => f.write_str("idle"),
            Self::Run => f.write_str("run"),
            Self::Safe(reason) => write!(f, "safe:{reason}"),
        }
    }
}

/// What an operator can ask for. A command that does not fit the mode changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "kebab-case"))]
pub enum OperatorCommand {
    /// Idle → run.
    Arm,
    /// Run → idle.
    Disarm,
    /// Safe → self-test (→ idle when every sensor is plausible).
    ResetFault,
}
