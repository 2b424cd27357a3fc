use super::definition::{Definition, Info, MAX_PARAMETERS, NEGLIGIBLE_BIAS, Negligible, ParameterInfo};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture};
use super::terms::{Seal, Sliding, Term};
use crate::coefficients::Coefficients;
use crate::real::Real;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Relative asymmetry.
    pub asymmetry: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn changes_sliding_force(&self) -> bool {
        self.asymmetry != R::ZERO
    }

    #[inline(always)]
    fn slide<const PARTIALS: bool>(&self, seal: &Seal<R>, sum: &mut Sliding<R>) {
        sum.factor = sum.factor * (R::ONE + self.asymmetry * seal.v_m_per_s.sign());
    }

    #[inline]
    fn slide_least(&self, _half_stroke_m: R, sum: &mut Sliding<R>) {
        sum.factor = sum.factor * (R::ONE - self.asymmetry.abs());
    }
}

pub(super) struct FrictionAsymmetry;

impl Definition for FrictionAsymmetry {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "friction-asymmetry",
        title: "Friction depends on direction",
        equation: "g := g (1 + a sign v)",
        signature: "friction is larger in one direction; equal to a constant force a F_c except around standstill",
        source: "Armstrong-Helouvry et al. 1994; single-lip seals",
        parameters: &[ParameterInfo {
            name: "asymmetry",
            key: "effects.friction-asymmetry.asymmetry",
            min: -0.95,
            max: 0.95,
            typical: 0.25,
            meaning: "relative asymmetry a",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification::on(
        Balances::FORCE,
        &[Picture::new(
            Balance::Force,
            Against::Velocity,
            "The same sign in both directions of motion: a constant force, or friction that differs by direction.",
        )
        .only(Only::Sliding)],
    );

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { asymmetry: values[0] }
    }

    fn negligible(_context: &Negligible<'_>, _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [NEGLIGIBLE_BIAS; MAX_PARAMETERS]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (here, there) = if values[0] < 0.0 { ("smaller", "larger") } else { ("larger", "smaller") };
        let percent = values[0].abs() * 100.0;
        write!(f, "Friction is {percent:.0} % {here} towards chamber B and as much {there} the other way")
    }
}
