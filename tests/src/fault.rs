//! What can go wrong, in the manner of PX4's failure injection.

use control::Channel;
use serde::Deserialize;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// The channel reads its lowest code: wire broken, sensor without power.
    Off,
    /// The channel reads its highest code: shorted.
    Shorted,
    /// The channel repeats its last code.
    Stuck,
    /// The channel reads random codes.
    Garbage,
    /// The channel reads `factor` times the truth (about the zero of its unit).
    Scale,
    /// The channel reads the truth plus an offset that grows by `per_second` of its unit each second.
    Drift,
    /// The channel follows the truth with a first-order lag of `time_constant_s`.
    Slow,
    /// The channel shows what was true `delay_s` ago.
    Delayed,
    /// The channel reads its lowest code with `probability`, else the truth.
    Intermittent,
    /// The supply hose comes off: supply pressure falls to atmosphere with `time_constant_s`.
    SupplyLoss,
    /// The spool stays where it is.
    JammedValve,
    /// Ticks do not happen, `ticks` in a row out of every `every`.
    DroppedTicks,
    /// Ticks happen late: the old DAC code stands for half a tick longer, `ticks` in a row out of every `every`.
    LateTicks,
    /// Conversions are overwritten: the controller sees the codes of the tick before, `ticks` in a row out of every
    /// `every`.
    Overrun,
    /// The host falls silent.
    HostSilent,
    /// The shell finds that the valve output is not what was written.
    ValveOutput,
}

impl Kind {
    /// Whether it concerns one sensor channel.
    #[must_use]
    pub const fn is_sensor(self) -> bool {
        matches!(
            self,
            Self::Off
                | Self::Shorted
                | Self::Stuck
                | Self::Garbage
                | Self::Scale
                | Self::Drift
                | Self::Slow
                | Self::Delayed
                | Self::Intermittent
        )
    }
}

/// One fault of a scenario.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What.
    pub kind: Kind,
    /// Which sensor, where it is one.
    pub channel: Option<Channel>,
    /// From when, s.
    pub at_s: f64,
    /// Until when, s; absent: for good.
    pub until_s: Option<f64>,
    /// For `scale`.
    #[serde(default = "factor")]
    pub factor: f64,
    /// For `slow` and `supply-loss`, s.
    #[serde(default = "time_constant")]
    pub time_constant_s: f64,
    /// For `delayed`, s.
    #[serde(default = "delay")]
    pub delay_s: f64,
    /// For `intermittent`.
    #[serde(default = "probability")]
    pub probability: f64,
    /// For `drift`, in m/s or Pa/s.
    #[serde(default = "per_second")]
    pub per_second: f64,
    /// For `dropped-ticks`, `late-ticks` and `overrun`.
    #[serde(default = "one")]
    pub ticks: u32,
    /// For `dropped-ticks`, `late-ticks` and `overrun`.
    #[serde(default = "one")]
    pub every: u32,
}

fn factor() -> f64 {
    1.5
}
fn time_constant() -> f64 {
    0.1
}
fn delay() -> f64 {
    0.05
}
fn probability() -> f64 {
    0.5
}
fn per_second() -> f64 {
    0.0
}
fn one() -> u32 {
    1
}

impl Fault {
    /// A fault for good from `at_s`, with the customary strength of its kind.
    #[must_use]
    pub fn new(kind: Kind, channel: Option<Channel>, at_s: f64) -> Self {
        Self {
            kind,
            channel,
            at_s,
            until_s: None,
            factor: factor(),
            time_constant_s: time_constant(),
            delay_s: delay(),
            probability: probability(),
            per_second: per_second(),
            ticks: one(),
            every: one(),
        }
    }

    /// Whether it is active at a time.
    #[must_use]
    pub fn active(&self, t_s: f64) -> bool {
        t_s >= self.at_s && self.until_s.is_none_or(|until| t_s < until)
    }

    /// For faults of `ticks` in a row out of every `every`: whether this tick is hit, counted from the fault's beginning.
    #[must_use]
    pub fn hits(&self, ticks_since: u64) -> bool {
        ticks_since % u64::from(self.every.max(1)) < u64::from(self.ticks)
    }
}
