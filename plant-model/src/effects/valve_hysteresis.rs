use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture, Split, StartContext};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Half-width of the play, V.
    pub half_width_v: R,
}

impl<R: Real> Term<R> for Terms<R> {}

impl<R: Real> Terms<R> {
    /// The play operator: what leaves it under a command, in V, when `played_v` left it before.
    #[inline(always)]
    #[must_use]
    pub fn play(&self, played_v: R, command_v: R) -> R {
        played_v.limit(command_v - self.half_width_v, command_v + self.half_width_v)
    }
}

pub(super) struct ValveHysteresis;

impl Definition for ValveHysteresis {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "valve-hysteresis",
        title: "Valve hysteresis",
        equation: "play operator of half-width h on u, before the spool",
        signature: "the loop flow(u) has a width that does not depend on rate",
        source: "Festo MPYE catalogue: at most 0.4 % of stroke; Visintin 1994 (play operator)",
        parameters: &[ParameterInfo {
            name: "half_width_v",
            key: "effects.valve-hysteresis.half_width_v",
            min: 0.0,
            max: 2.0,
            typical: 0.1,
            meaning: "half-width of the play, V",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        starts_fitted: 2,
        smooth_at_neutral: false,
        ..Identification::on(
            Balances::MASS,
            &[
                Picture::new(
                    Balance::MassA,
                    Against::Command,
                    "Two separate curves, one for each direction of the command, are play in the valve.",
                )
                .only(Only::SmallCommand)
                .split(Split::Command),
                Picture::new(
                    Balance::MassB,
                    Against::Command,
                    "Two separate curves, one for each direction of the command, are play in the valve.",
                )
                .only(Only::SmallCommand)
                .split(Split::Command),
            ],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { half_width_v: values[0] }
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // A play first has to be taken up before its width matters, so a start at zero may lead nowhere.
        let (neutral, scale) = (context.neutral[0], context.scales[0]);
        for multiple in [0.0, 0.5, 1.5] {
            begin(&[neutral + multiple * scale]);
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The valve answers {:.0} mV late whenever the command turns round, however slowly", values[0] * 1e3)
    }
}
