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
    /// Time constant of the spool, s; 0 for none.
    pub time_constant_s: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.time_constant_s > R::ZERO
    }
}

impl<R: Real> Terms<R> {
    /// Rate of the spool in V/s, zero where it has no lag.
    #[inline(always)]
    pub(crate) fn rate(&self, command_v: R, spool_v: R) -> R {
        if self.is_present() { (command_v - spool_v) / self.time_constant_s } else { R::ZERO }
    }

    /// Negative derivative of the rate by the spool's position, 1/s.
    #[inline(always)]
    pub(crate) fn inverse_s(&self) -> R {
        if self.is_present() { R::ONE / self.time_constant_s } else { R::ZERO }
    }

    /// Mean over an interval of `duration_s` with a constant target, and position at its end, in V. `rest` is
    /// `exp(-duration / time constant)`, which the caller takes from the exponential of its platform.
    #[inline]
    #[must_use]
    pub fn over(&self, spool_v: R, target_v: R, duration_s: R, rest: R) -> (R, R) {
        let share = if duration_s > R::ZERO { self.time_constant_s / duration_s * (R::ONE - rest) } else { R::ONE };
        (target_v + (spool_v - target_v) * share, target_v + (spool_v - target_v) * rest)
    }
}

pub(super) struct ValveLag;

impl Definition for ValveLag {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "valve-lag",
        title: "Slow valve spool",
        equation: "tau w' + w = u",
        signature: "flow follows the command late by an amount that depends on its frequency; the width of the loop flow(u) grows with rate",
        source: "Festo MPYE catalogue: -3 dB at 115/95/80/70 Hz full stroke",
        parameters: &[ParameterInfo {
            name: "time_constant_s",
            key: "effects.valve-lag.time_constant_s",
            min: 0.0,
            max: 0.2,
            typical: 0.01,
            meaning: "first-order time constant of the spool, s",
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

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { time_constant_s: values[0] }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The flow follows the command with a lag of {:.1} ms", values[0] * 1e3)
    }
}
