use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_time};
use super::effect::Effect;
use super::first_order::FirstOrderLag;
use super::identification::{Against, Balance, Balances, Confusion, Identification, Likeness, Needs, Picture};
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

pub(super) type Terms<R> = FirstOrderLag<R>;

pub(super) struct PositionLag;

impl Definition for PositionLag {
    type Terms<R: Real> = FirstOrderLag<R>;

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

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> FirstOrderLag<R> {
        FirstOrderLag { time_constant_s: values[0] }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The position sensor follows with a lag of {:.1} ms", values[0] * 1e3)
    }
}
