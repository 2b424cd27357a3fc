//! The positioning law: `docs/control-law.md` derives it; files in the order of the data.
//!
//! ```text
//! target ─ stream ─ reference ─────► law ─ inversion ─► command          one file each
//!                       ▲             ▲       ▲   ▲
//!                       └ anti-windup ┘       │   └─ friction,            feedforward for a target that turns round;
//!                                             │      hold, stick          silent at rest; breaking away
//!                                observer ────┘   └─ learning, stall      valve, lag, load, friction, mass; blocked
//!                                   └─ equalise ─ inversion ─► command    after a trip, instead of all above
//! ```
//!
//! Forces are per nominal moving mass, so that the tick never needs the mass, and a force has the format of an acceleration:
//!
//! | quantity | type | unit | range | resolution |
//! | --- | --- | --- | --- | --- |
//! | position, velocity, pressure, voltage | see [`quantities`](crate::quantities) | | | |
//! | acceleration, force per moving mass | [`Acceleration`] = I16F16 | m/s2 | ±32,768 | 1.5e-5 |
//! | jerk, rate of force per moving mass, its slope per radian | [`Jerk`] = I24F8 | m/s3 | ±8.4e6 | 0.004 |
//! | viscous friction per moving mass | [`Damping`] = I16F16 | 1/s | ±32,768 | 1.5e-5 |
//! | lag | [`Ticks`] = I16F16 | ticks | ±32,768 | 1.5e-5 |
//! | stiffness over mass | [`Stiffness`] = I24F8 | 1/s2 | ±8.4e6 | 0.004 |
//! | angle `θ = atan(2 w)` | [`Angle`] = I4F28 | rad | ±8 | 4e-9 |
//! | flow over nominal flow | [`Ratio`] = I4F28 | 1 | ±8 | 4e-9 |
//!
//! The finest force that means anything is a twentieth of the noise of a pressure code, 20 Pa: 0.01 m/s2 on the paper's
//! cylinders. Sums saturate, products are made in 64 bits, rounded, and saturate. Constants are [`Tuning`], made of the parameters and of [`constants`].

mod air;
mod angle;
pub mod constants;
mod cycle;
mod delay;
mod equalise;
mod factor;
pub mod friction;
pub mod hold;
pub mod inversion;
mod law;
pub mod learned;
pub mod learning;
pub mod observer;
mod opening;
pub mod reference;
mod rig;
pub mod stall;
pub mod stick;
pub mod stream;
mod tuning;

use crate::arithmetic::{bits, limit, multiply};
use crate::quantities::{Position, Pressure, Voltage};
use air::Air;
use constants::{MOST_SWINGS, MOST_THRESHOLD_SCALE};
use cycle::Cycle;
use delay::Delay;
use fixed::traits::Fixed;
use fixed::types::{I4F28, I6F26, I12F20, I16F16, I24F8};
use friction::Feedforward;
use hold::Hold;
use inversion::ValveModel;
use law::Parts;
use learned::Learned;
use learning::Lag;
use observer::{Body, Estimate, Opening};
pub use opening::{OPENING_KNOTS, OPENING_STEP_V};
use reference::Motion;
use stall::Stall;
use stick::Stick;
use stream::Stream;
pub use tuning::Tuning;

/// An acceleration, or a force per moving mass, m/s2.
pub type Acceleration = I16F16;
/// A jerk, or a rate of force per moving mass, m/s3.
pub type Jerk = I24F8;
/// A stiffness over the moving mass, 1/s2.
pub type Stiffness = I24F8;
/// A viscous friction per moving mass, 1/s.
pub type Damping = I16F16;
/// A time in ticks.
pub type Ticks = I16F16;
/// An angle, rad.
pub type Angle = I4F28;
/// A ratio.
pub type Ratio = I4F28;
/// A part of a limit, or a quantity in units of the limits.
type Part = I6F26;
/// A noise, um.
type Micrometres = I12F20;

/// From a rate to its change in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tick {
    /// The tick in s, 32 fractional bits: at most 2^24, as a tick is no longer than 2 ms.
    q32: i32,
}

impl Tick {
    /// What a rate changes in a tick; the change's format has at most 8 fractional bits more, so that nothing saturates.
    #[inline]
    fn change<A: Fixed<Bits = i32>, B: Fixed<Bits = i32>>(self, rate: A) -> B {
        let shift = 32 + A::FRAC_NBITS - B::FRAC_NBITS;
        B::from_bits(((i64::from(rate.to_bits()) * i64::from(self.q32) + (1 << (shift - 1))) >> shift) as i32)
    }
}

/// By how much the thresholds of hold and stick are higher for a noisy position or a slipping piston, 1 to 4, 24 fractional bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ThresholdScale(i32);

impl ThresholdScale {
    #[inline]
    fn of<T: Fixed<Bits = i32>>(self, limit: T) -> T {
        T::from_bits(multiply(limit.to_bits(), self.0, 24))
    }
}

/// What the sensors read in one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Readings {
    /// Position.
    pub(crate) y: Position,
    /// Pressures of chamber A and B, absolute; `None` where the sensor is lost or none is fitted.
    pub(crate) chambers: [Option<Pressure>; 2],
    /// Supply pressure, absolute; `None` where it is not measured.
    pub(crate) supply: Option<Pressure>,
}

/// What a tick of the law is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stage {
    /// A run begins.
    Begin,
    /// It goes on.
    Run,
    /// It has ended by a fault: a controlled stop.
    Stop,
}

/// What one tick shows of the rig, until it is learned behind the valve code.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shown {
    /// Innovation of the force.
    force: Acceleration,
    opening: Opening,
    air: Air,
}

/// What the law remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ServoState {
    /// The rig as it was estimated.
    pub estimate: Estimate,
    /// Where the piston should be.
    pub motion: Motion,
    /// The valve as learned.
    pub valve: ValveModel,
    /// Friction and mass as learned.
    pub body: Body,
    /// Lag of the spool as learned.
    pub lag: Lag,
    /// Bandwidth of the law, over that of its parameters.
    pub bandwidth: Ratio,
    /// Hold.
    pub hold: Hold,
    /// The parts of the law's gains at that bandwidth.
    feedback: Parts,
    /// The part of the limits that the reference of a standing target uses.
    pace: Part,
    stream: Stream,
    stick: Stick,
    stall: Stall,
    swings: Cycle,
    /// The target in the last tick, and whether it is still the same.
    target: Position,
    stays: bool,
    feedforward: Feedforward,
    noise: Micrometres,
    acting: Voltage,
    delay: Delay,
    forces: [Acceleration; 3],
    shown: Option<Shown>,
    /// Whether the piston moves towards a target that stands.
    approaches: bool,
    /// Samples since the beginning of the run.
    samples: u16,
    /// Whether anything was learned since power-on.
    learned: bool,
    /// What the run began with.
    begun: Learned,
    /// Whether a chamber's pressure was not measured in the last tick.
    unseen: bool,
}

impl ServoState {
    /// At the beginning of a run; what was learned in an earlier one is kept.
    fn begin(
        &mut self,
        tuning: &Tuning,
        target: Position,
        y: Position,
        force: Acceleration,
        forces: [Acceleration; 3],
    ) {
        if !self.learned {
            self.take(&tuning.start);
        }
        let load = self.estimate.load;
        let (centre, at_rest) = (tuning.valve.centre, Motion::at(y));
        let disturbance = force.saturating_neg();
        *self = Self {
            estimate: Estimate { y, force, disturbance, load, spool: centre, ..Estimate::default() },
            motion: at_rest,
            stream: Stream::at(target),
            acting: centre,
            delay: Delay::of(centre),
            stall: Stall::at(y, force),
            forces,
            valve: self.valve,
            body: self.body,
            lag: Lag::of(self.lag.ticks),
            bandwidth: self.bandwidth,
            learned: true,
            begun: Learned::of(&self.valve, &self.body, self.lag.ticks, load, self.bandwidth),
            ..Self::default()
        };
        self.follow_bandwidth(tuning);
    }

    /// Gains and pace at the bandwidth as it now is.
    fn follow_bandwidth(&mut self, tuning: &Tuning) {
        self.feedback = tuning.law.feedback.at(self.bandwidth);
        self.follow_flow();
    }

    /// Pace at the flow as it now is.
    #[inline]
    fn follow_flow(&mut self) {
        self.pace = self.valve.part_of_limits(self.bandwidth);
    }

    /// Forgets what was learned in this run: the readings were those of a fault.
    #[cold]
    pub(crate) fn forget(&mut self) {
        let begun = self.begun;
        self.take(&begun);
    }

    /// Takes learned values.
    #[inline]
    fn take(&mut self, learned: &Learned) {
        let (valve, body, lag, load, bandwidth) = learned.parts();
        (self.valve, self.body, self.lag, self.estimate.load) = (valve, body, Lag::of(lag), load);
        self.bandwidth = bandwidth;
    }

    /// Whether anything was learned since power-on: whether the law has run.
    #[inline]
    #[must_use]
    pub fn has_learned(&self) -> bool {
        self.learned
    }
}

impl Tuning {
    /// What is learned, or what a run would begin with.
    #[inline]
    pub(crate) fn learned(&self, state: &ServoState) -> Learned {
        if state.learned {
            Learned::of(&state.valve, &state.body, state.lag.ticks, state.estimate.load, state.bandwidth)
        } else {
            self.start
        }
    }

    /// One tick: the command that acts from the next tick on, and its effective voltage. [`Tuning::learn`] follows.
    ///
    /// Never inlined, so that it is compiled with this crate's options: for speed, also in a firmware that is compiled for size.
    #[inline(never)]
    pub(crate) fn step(&self, state: &mut ServoState, stage: Stage, target: Position, read: &Readings) -> [Voltage; 2] {
        let begin = stage == Stage::Begin;
        let chambers = &self.chambers;
        let [per_pa_a, per_pa_b] = chambers.per_pa;
        let [p_a, p_b] = read.chambers;
        let (f_a, f_b) = (p_a.map(|p| per_pa_a.of(p)), p_b.map(|p| per_pa_b.of(p)));
        let measured = f_a.zip(f_b).map(|(f_a, f_b)| f_a.saturating_sub(f_b));
        let supply = read.supply.map_or(chambers.nominal_supply, |p| per_pa_a.of(p));
        let force = if begin { chambers.rest_force() } else { state.estimate.force };
        let forces = chambers.complete([f_a, f_b], supply, force);
        if begin {
            let fresh = !state.learned;
            state.begin(self, target, read.y, measured.unwrap_or(force), forces);
            if fresh && measured.is_none() {
                state.body.coulomb = state.body.coulomb.min(self.unseen_coulomb);
            }
        }
        for (slow, now) in state.forces.iter_mut().zip(forces) {
            *slow = slow.saturating_add(chambers.follow.of(now.saturating_sub(*slow)));
        }
        // What the model made of an unmeasured force is no error of the valve: nothing is learned from it.
        if core::mem::replace(&mut state.unseen, measured.is_none())
            && let Some(force) = measured
        {
            state.estimate.take_force(force);
        }
        let air = chambers.air(state.estimate.y, state.forces);
        state.samples = state.samples.saturating_add(1);
        let innovation = if state.samples <= self.standing_ticks {
            state.estimate.correct_standing(read.y, measured, state.samples)
        } else {
            state.estimate.correct(read.y, measured, &self.observer)
        };
        let valve = (&self.valve, &state.valve);
        let opening = state.estimate.predict(
            state.delay.after(state.acting, self.delay_ticks),
            &air,
            valve,
            (state.lag.ticks, &state.body),
            (&self.observer, &self.tick),
        );
        state.shown = innovation.force.map(|force| Shown { force, opening, air });
        if state.shown.is_none() {
            state.estimate.unseen_force(&self.observer);
        }
        let wrong = self.noise_of.of(innovation.y.saturating_abs());
        state.noise = state.noise.saturating_add(self.noise_follow.of(wrong.saturating_sub(state.noise)));
        let command = if stage == Stage::Stop {
            // Readings of a rig that is not as it should be teach nothing.
            state.shown = None;
            equalise::command(self, state, &air)
        } else {
            law::command(self, state, target, &air)
        };
        state.acting = command[0];
        command
    }

    /// Takes the readings' force for the estimate at once: before a stop in which one of them is told and not read. What was estimated
    /// has followed a wrong pressure since the fault.
    #[cold]
    #[inline(never)]
    pub(crate) fn believe(&self, state: &mut ServoState, read: &Readings) {
        let ([p_a, p_b], [per_pa_a, per_pa_b]) = (read.chambers, self.chambers.per_pa);
        let Some((f_a, f_b)) = p_a.map(|p| per_pa_a.of(p)).zip(p_b.map(|p| per_pa_b.of(p))) else { return };
        let [_, _, supply] = state.forces;
        state.estimate.force = f_a.saturating_sub(f_b);
        state.forces = self.chambers.complete([Some(f_a), Some(f_b)], supply, state.estimate.force);
    }

    /// Learns what the tick has shown, and whether something blocks the piston; it counts from the next one on. An eighth of the law's
    /// instructions, which the valve code does not wait for.
    #[inline(never)]
    pub(crate) fn learn(&self, state: &mut ServoState) {
        state.stall.see(state.estimate.y, state.estimate.force, &self.stall);
        let leave = self.threshold_scale(state.noise).of(self.hold.leave);
        state.hold.see(leave);
        if state.hold.take_pass() {
            learning::unlearn_friction(&mut state.body, &self.learning);
        }
        state.swings.see(state.stays, state.hold.mean.error, leave);
        if state.swings.take_pass(MOST_SWINGS) {
            learning::slow_down(&mut state.bandwidth);
            state.follow_bandwidth(self);
        }
        let Some(Shown { force, opening, air }) = state.shown.take() else { return };
        // A wrong rate of force stands as an innovation of that rate over the correction's.
        let wrong = self.learning.wrong.of(force);
        let slope = state.valve.slope(opening.theta >= 0, &air);
        state.lag.learn(wrong, opening.theta, slope, &self.learning);
        learning::learn_valve((&self.valve, &mut state.valve), wrong, &opening, &air, &self.learning);
        state.follow_flow();
        if !state.stall.suspected(&self.stall) {
            learning::learn_body(&mut state.body, &mut state.estimate, state.approaches, &self.learning);
        }
        state.hold.learn_noise(force, &self.hold);
    }

    /// A noisier position is judged more coarsely.
    #[inline]
    fn threshold_scale(&self, noise: Micrometres) -> ThresholdScale {
        ThresholdScale(limit(
            self.scale_of.of(noise).to_bits(),
            self.least_scale,
            const { bits(MOST_THRESHOLD_SCALE, 24) },
        ))
    }
}

#[cfg(test)]
mod tests;
