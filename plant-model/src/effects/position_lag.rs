use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_time};
use super::effect::Effect;
use super::identification::{Against, Balance, Balances, Confusion, Identification, Likeness, Needs, Picture};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Time constant of the position sensor, s; 0 for none.
    pub time_constant_s: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.time_constant_s > R::ZERO
    }
}

impl<R: Real> Terms<R> {
    /// Rate of the position behind the lag in m/s, zero where there is none.
    #[inline(always)]
    pub(crate) fn rate(&self, y_m: R, sensed_m: R) -> R {
        if self.is_present() { (y_m - sensed_m) / self.time_constant_s } else { R::ZERO }
    }

    /// Negative derivative of the rate by the position behind the lag, 1/s.
    #[inline(always)]
    pub(crate) fn inverse_s(&self) -> R {
        if self.is_present() { R::ONE / self.time_constant_s } else { R::ZERO }
    }

    /// A signal in front of the lag, from that behind it and its slope per second: of a position in m, or of a velocity in m/s.
    #[inline(always)]
    #[must_use]
    pub fn ahead(&self, sensed: R, slope_per_s: R) -> R {
        sensed + self.time_constant_s * slope_per_s
    }

    /// The position behind the lag in m after `dt_s` in which the true position went from the first to the second place of `y_m`
    /// under constant acceleration, with the velocities `v_m_per_s` at both ends. `rest` is `exp(-dt / time constant)`.
    #[must_use]
    pub fn over(&self, sensed_m: R, y_m: [R; 2], v_m_per_s: [R; 2], dt_s: R, rest: R) -> R {
        let tau = self.time_constant_s;
        let acceleration = (v_m_per_s[1] - v_m_per_s[0]) / dt_s;
        let mean = (y_m[1] - y_m[0]) / dt_s;
        let half = R::HALF * acceleration * dt_s;
        // What is left of `tau s' + s = y` once its transient is gone: s = y - tau y' + tau^2 y''.
        let settled = |y: R, v: R| y - tau * v + tau * tau * acceleration;
        settled(y_m[1], mean + half) + (sensed_m - settled(y_m[0], mean - half)) * rest
    }
}

pub(super) struct PositionLag;

impl Definition for PositionLag {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "position-lag",
        title: "Slow position sensor",
        equation: "tau y_m' + y_m = y",
        signature: "measured motion follows the pressures late and rounded: the later, the faster the speed changes",
        source: "filter of a transducer or of the logger's input",
        parameters: &[ParameterInfo {
            name: "time_constant_s",
            key: "effects.position-lag.time_constant_s",
            min: 0.0,
            max: 0.1,
            typical: 0.01,
            meaning: "time constant tau of the position signal, s",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        needs: Needs::AnyPressure,
        smooth_at_neutral: false,
        confused_with: &[Confusion {
            with: Effect::PositionDelay,
            kind: Likeness::Near,
            experiment: Some(
                "Record small command sines from 1 Hz to the highest the piston follows, with both pressures: a lag loses \
                 amplitude, a delay only phase.",
            ),
        }],
        ..Identification::on(
            Balances::MASS.and(Balances::FORCE),
            &[Picture::new(
                Balance::Force,
                Against::Acceleration,
                "Motion that shows later than the force that makes it, and rounded.",
            )],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { time_constant_s: values[0] }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The position sensor follows with a lag of {:.1} ms", values[0] * 1e3)
    }
}
