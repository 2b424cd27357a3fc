//! Experiments: what the rig is asked to do, second by second.
//!
//! A segment has a reference (then the control law acts), an added command (then it is added to the law's output, or acts
//! alone where there is no reference), or neither: the valve stands at mid.

use std::f64::consts::TAU;

/// Shape of a periodic signal of amplitude one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wave {
    /// Sine.
    Sine,
    /// Triangle, starting upwards from zero.
    Triangle,
    /// Square, starting high.
    Square,
}

impl Wave {
    fn at(self, phase: f64) -> f64 {
        let phase = phase.rem_euclid(1.0);
        match self {
            Self::Sine => (TAU * phase).sin(),
            Self::Triangle if phase < 0.25 => 4.0 * phase,
            Self::Triangle if phase < 0.75 => 2.0 - 4.0 * phase,
            Self::Triangle => 4.0 * phase - 4.0,
            Self::Square if phase < 0.5 => 1.0,
            Self::Square => -1.0,
        }
    }
}

/// A periodic signal about a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Periodic {
    /// Shape.
    pub wave: Wave,
    /// Constant part, m or V.
    pub centre: f64,
    /// Amplitude, m or V.
    pub amplitude: f64,
    /// Frequency at the start, Hz.
    pub hz: f64,
    /// Frequency at the end, Hz; equal to `hz` unless the signal is a sweep.
    pub end_hz: f64,
}

impl Periodic {
    /// A signal of constant frequency.
    #[must_use]
    pub fn new(wave: Wave, centre: f64, amplitude: f64, hz: f64) -> Self {
        Self { wave, centre, amplitude, hz, end_hz: hz }
    }

    /// A constant.
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self::new(Wave::Sine, value, 0.0, 0.0)
    }

    fn at(&self, t: f64, duration: f64) -> f64 {
        let sweep = if duration > 0.0 { 0.5 * (self.end_hz - self.hz) * t * t / duration } else { 0.0 };
        self.centre + self.amplitude * self.wave.at(self.hz * t + sweep)
    }
}

/// A position reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reference {
    /// A jump to a position, m.
    Step(f64),
    /// A straight line from the last reference to a position in m, over the whole segment.
    Ramp(f64),
    /// A periodic signal.
    Periodic(Periodic),
}

/// One part of an experiment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Duration, s.
    pub duration_s: f64,
    /// Closed loop, if any.
    pub reference: Option<Reference>,
    /// Added command in V, if any.
    pub command: Option<Periodic>,
    /// In open loop: limit switches turn the command round before the piston reaches an end.
    pub guarded: bool,
}

impl Segment {
    /// Closed loop.
    #[must_use]
    pub fn follow(duration_s: f64, reference: Reference) -> Self {
        Self { duration_s, reference: Some(reference), command: None, guarded: false }
    }

    /// Closed loop with a command added to the law's output: for motion faster than the loop.
    #[must_use]
    pub fn shaken(duration_s: f64, reference: Reference, command: Periodic) -> Self {
        Self { duration_s, reference: Some(reference), command: Some(command), guarded: false }
    }

    /// Open loop between limit switches.
    #[must_use]
    pub fn open(duration_s: f64, command: Periodic) -> Self {
        Self { duration_s, reference: None, command: Some(command), guarded: true }
    }

    /// Open loop that may run against an end stop.
    #[must_use]
    pub fn push(duration_s: f64, volts: f64) -> Self {
        Self { duration_s, reference: None, command: Some(Periodic::constant(volts)), guarded: false }
    }

    /// Valve at mid position.
    #[must_use]
    pub fn closed_valve(duration_s: f64) -> Self {
        Self { duration_s, reference: None, command: None, guarded: false }
    }
}

/// What is asked for at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Demand {
    /// Position reference in m where the loop is closed.
    pub y_ref_m: Option<f64>,
    /// Command in V that is added, or acts alone in open loop.
    pub added_v: f64,
    /// Whether limit switches watch over the open loop.
    pub guarded: bool,
}

/// A whole experiment.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// What kind it is, for tables.
    pub name: &'static str,
    /// Where the piston stands at the start, m.
    pub start_m: f64,
    /// The parts.
    pub segments: Vec<Segment>,
}

impl Experiment {
    /// Total duration, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.segments.iter().map(|segment| segment.duration_s).sum()
    }

    /// A cursor that gives the demand at increasing times.
    #[must_use]
    pub fn play(&self) -> Player<'_> {
        Player { experiment: self, index: 0, began_s: 0.0, from_m: self.start_m, last_m: self.start_m }
    }
}

/// Walks through an experiment.
#[derive(Clone, Debug)]
pub struct Player<'a> {
    experiment: &'a Experiment,
    index: usize,
    began_s: f64,
    from_m: f64,
    last_m: f64,
}

impl Player<'_> {
    /// The demand at time `t` in s; times must not decrease. `measured_m` is where a ramp starts after open loop.
    pub fn demand(&mut self, t_s: f64, measured_m: f64) -> Demand {
        while let Some(segment) = self.experiment.segments.get(self.index) {
            let end = self.began_s + segment.duration_s;
            if t_s < end || self.index + 1 == self.experiment.segments.len() {
                break;
            }
            self.from_m = if segment.reference.is_some() { self.last_m } else { measured_m };
            self.began_s = end;
            self.index += 1;
        }
        let Some(segment) = self.experiment.segments.get(self.index) else {
            return Demand { y_ref_m: None, added_v: 0.0, guarded: false };
        };
        let t = t_s - self.began_s;
        let y_ref_m = segment.reference.map(|reference| match reference {
            Reference::Step(to) => to,
            Reference::Ramp(to) => self.from_m + (to - self.from_m) * (t / segment.duration_s).clamp(0.0, 1.0),
            Reference::Periodic(periodic) => periodic.at(t, segment.duration_s),
        });
        if let Some(y_ref_m) = y_ref_m {
            self.last_m = y_ref_m;
        }
        let added_v = segment.command.map_or(0.0, |command| command.at(t, segment.duration_s));
        Demand { y_ref_m, added_v, guarded: segment.guarded }
    }
}
