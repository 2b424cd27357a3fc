use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_time};
use super::identification::{Against, Balance, Balances, Identification, Needs, Picture};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Delay of the position signal, s.
    pub delay_s: R,
}

impl<R: Real> Term<R> for Terms<R> {}

pub(super) struct PositionDelay;

impl Definition for PositionDelay {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "position-delay",
        title: "Position signal late against the pressures",
        equation: "measured y(t) = y(t - tau)",
        signature: "compression by motion shows in the pressures before the measured motion",
        source: "bus or encoder interface latency",
        parameters: &[ParameterInfo {
            name: "delay_s",
            key: "effects.position-delay.delay_s",
            min: 0.0,
            max: 0.1,
            typical: 0.01,
            meaning: "delay tau, s",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        needs: Needs::AnyPressure,
        smooth_at_neutral: false,
        ..Identification::on(
            Balances::MASS.and(Balances::FORCE),
            &[Picture::new(
                Balance::Force,
                Against::Acceleration,
                "Motion that shows later than the force that makes it.",
            )],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { delay_s: values[0] }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The position signal comes {:.1} ms after the pressures", values[0] * 1e3)
    }
}
