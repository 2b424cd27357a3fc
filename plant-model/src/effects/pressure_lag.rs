use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_time};
use super::first_order::FirstOrderLag;
use super::identification::{Against, Balance, Balances, Identification, Picture};
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

pub(super) type Terms<R> = FirstOrderLag<R>;

pub(super) struct PressureLag;

impl Definition for PressureLag {
    type Terms<R: Real> = FirstOrderLag<R>;

    const INFO: &'static Info = &Info {
        id: "pressure-lag",
        title: "Slow pressure sensors",
        equation: "tau p_m' + p_m = p, both channels",
        signature: "measured pressure follows the flow and the motion late, more so when fast; the force balance lags the acceleration",
        source: "sensor tubing or filter",
        parameters: &[ParameterInfo {
            name: "time_constant_s",
            key: "effects.pressure-lag.time_constant_s",
            min: 0.0,
            max: 0.2,
            typical: 0.01,
            meaning: "time constant tau of both channels, s",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        smooth_at_neutral: false,
        ..Identification::on(
            Balances::MASS.and(Balances::FORCE),
            &[
                Picture::new(Balance::MassA, Against::CommandRate, "Pressures that follow late."),
                Picture::new(
                    Balance::Force,
                    Against::RateA,
                    "The force is late too: an error that follows the rate of the pressures.",
                ),
            ],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> FirstOrderLag<R> {
        FirstOrderLag { time_constant_s: values[0] }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Both pressure sensors follow with a lag of {:.1} ms", values[0] * 1e3)
    }
}
