use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_time};
use super::effect::Effect;
use super::identification::{Against, Balance, Balances, Confusion, Identification, Likeness, Picture};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Time constant of the spool `tau`, s; 0 for none.
    pub time_constant_s: R,
    /// Inertia `m` of the spool, `1 / (4 zeta^2)` with its damping ratio; 0 for a lag of first order.
    pub inertia: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.time_constant_s > R::ZERO
    }
}

impl<R: Real> Terms<R> {
    /// Whether the spool has a velocity of its own.
    #[inline(always)]
    #[must_use]
    pub fn has_inertia(&self) -> bool {
        self.is_present() && self.inertia > R::ZERO
    }

    /// Rates of the spool's position in V/s and of its velocity in V/s2, zero where it has none.
    #[inline(always)]
    pub(crate) fn rates(&self, command_v: R, spool_v: R, spool_v_per_s: R) -> (R, R) {
        if !self.is_present() {
            return (R::ZERO, R::ZERO);
        }
        // What the command asks of a spool without inertia.
        let asked = (command_v - spool_v) / self.time_constant_s;
        if self.has_inertia() {
            (spool_v_per_s, (asked - spool_v_per_s) / (self.inertia * self.time_constant_s))
        } else {
            (asked, R::ZERO)
        }
    }

    /// The spool's part of `(d - J) k = r` for a diagonal `d` in 1/s, solved: `k_w = w_w r_w + w_r r_r` for its position and
    /// `k_r = r_w k_w + r_r r_r` for its velocity.
    #[inline(always)]
    pub(crate) fn solution(&self, diagonal: R) -> SpoolSolution<R> {
        let inverse_s = if self.is_present() { R::ONE / self.time_constant_s } else { R::ZERO };
        if !self.has_inertia() {
            return SpoolSolution { w_w: R::ONE / (diagonal + inverse_s), ..SpoolSolution::default() };
        }
        let damping = inverse_s / self.inertia;
        let stiffness = damping * inverse_s;
        let r_r = R::ONE / (diagonal + damping);
        let w_w = R::ONE / (diagonal + stiffness * r_r);
        SpoolSolution { w_w, w_r: w_w * r_r, r_w: -(stiffness * r_r), r_r }
    }

    /// Mean over an interval of `duration_s` with a constant target, and position at its end, in V, of a spool without inertia. `rest`
    /// is `exp(-duration / time constant)`, which the caller takes from the exponential of its platform.
    #[inline]
    #[must_use]
    pub fn over(&self, spool_v: R, target_v: R, duration_s: R, rest: R) -> (R, R) {
        let share = if duration_s > R::ZERO { self.time_constant_s / duration_s * (R::ONE - rest) } else { R::ONE };
        (target_v + (spool_v - target_v) * share, target_v + (spool_v - target_v) * rest)
    }
}

/// See [`Terms::solution`].
#[derive(Clone, Copy, Default)]
pub(crate) struct SpoolSolution<R> {
    /// Position from its own right-hand side, s.
    pub(crate) w_w: R,
    /// Position from the velocity's right-hand side, s2.
    pub(crate) w_r: R,
    /// Velocity from the position's solution, 1/s.
    pub(crate) r_w: R,
    /// Velocity from its own right-hand side, s.
    pub(crate) r_r: R,
}

pub(super) struct ValveLag;

impl Definition for ValveLag {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "valve-lag",
        title: "Slow valve spool",
        equation: "tau w' + w = u; with valve.spool_inertia m of the rig file: m tau^2 w'' + tau w' + w = u",
        signature: "flow follows the command late by an amount that depends on its frequency; the width of the loop flow(u) grows with rate",
        source: "Festo MPYE catalogue: -3 dB at 115/95/80/70 Hz full stroke",
        parameters: &[ParameterInfo {
            name: "time_constant_s",
            key: "effects.valve-lag.time_constant_s",
            min: 0.0,
            max: 0.2,
            typical: 0.01,
            meaning: "time constant of the spool, s; 2 zeta / omega of one of second order",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        smooth_at_neutral: false,
        confused_with: &[Confusion {
            with: Effect::LineDelay,
            kind: Likeness::Near,
            experiment: Some(
                "Record small command sines from 1 Hz to the highest the valve follows with the piston blocked: a lag \
                 loses amplitude, a delay only phase.",
            ),
        }],
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::CommandRate,
                    "An error that follows the rate of the command is a valve that acts late.",
                ),
                Picture::new(
                    Balance::MassB,
                    Against::CommandRate,
                    "An error that follows the rate of the command is a valve that acts late.",
                ),
            ],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], model: &Coefficients<R>) -> Terms<R> {
        Terms { time_constant_s: values[0], inertia: model.spool_inertia }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The flow follows the command with a lag of {:.1} ms", values[0] * 1e3)
    }
}
