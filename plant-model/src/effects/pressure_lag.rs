use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_time};
use super::identification::{Against, Balance, Balances, Identification, Picture};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Time constant of both sensors, s; 0 for none.
    pub time_constant_s: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn is_present(&self) -> bool {
        self.time_constant_s > R::ZERO
    }
}

impl<R: Real> Terms<R> {
    /// Rate of the pressure behind the lag in Pa/s, zero where there is none.
    #[inline(always)]
    pub(crate) fn rate(&self, p_pa: R, sensed_pa: R) -> R {
        if self.is_present() { (p_pa - sensed_pa) / self.time_constant_s } else { R::ZERO }
    }

    /// Negative derivative of the rate by the pressure behind the lag, 1/s.
    #[inline(always)]
    pub(crate) fn inverse_s(&self) -> R {
        if self.is_present() { R::ONE / self.time_constant_s } else { R::ZERO }
    }

    /// The pressure in front of the lag, from that behind it and its slope in Pa/s.
    #[inline(always)]
    #[must_use]
    pub fn ahead_pa(&self, sensed_pa: R, slope_pa_per_s: R) -> R {
        sensed_pa + self.time_constant_s * slope_pa_per_s
    }

    /// The pressure behind the lag after `dt_s` in which the pressure in front went from `before_pa` to `after_pa` on a
    /// straight line. `rest` is `exp(-dt / time constant)`, which the caller takes from the exponential of its platform.
    #[must_use]
    pub fn over(&self, sensed_pa: R, before_pa: R, after_pa: R, dt_s: R, rest: R) -> R {
        let behind_pa = self.time_constant_s * ((after_pa - before_pa) / dt_s);
        after_pa - behind_pa + (sensed_pa - before_pa + behind_pa) * rest
    }
}

pub(super) struct PressureLag;

impl Definition for PressureLag {
    type Terms<R: Real> = Terms<R>;

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

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { time_constant_s: values[0] }
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_time(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Both pressure sensors follow with a lag of {:.1} ms", values[0] * 1e3)
    }
}
