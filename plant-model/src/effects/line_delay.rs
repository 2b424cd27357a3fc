use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_time};
use super::identification::{Against, Balance, Balances, Identification, Picture};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Delay of the command, s.
    pub delay_s: R,
}

impl<R: Real> Term<R> for Terms<R> {}

pub(super) struct LineDelay;

impl Definition for LineDelay {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "line-delay",
        title: "Delay in the command path",
        equation: "the valve acts on u(t - tau)",
        signature: "flow follows the command late by the same time at every frequency",
        source: "hose transport or driver latency",
        parameters: &[ParameterInfo {
            name: "delay_s",
            key: "effects.line-delay.delay_s",
            min: -0.1,
            max: 0.1,
            typical: 0.01,
            meaning: "delay tau, s; below 0 the hoses delay by less than sound takes",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        smooth_at_neutral: false,
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

    /// By less than sound takes is a value of the hoses, not a cause.
    fn least() -> [f64; MAX_PARAMETERS] {
        [0.0; MAX_PARAMETERS]
    }

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { delay_s: values[0] }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "The valve acts {:.1} ms after its command, at every frequency, or all sensors are as late, as filters make them",
            values[0] * 1e3
        )
    }
}
