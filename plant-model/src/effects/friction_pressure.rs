use super::definition::{
    Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, VISIBLE_FRICTION, negligible_level, one,
};
use super::identification::{Against, Balance, Balances, Identification, Only, Picture, Split};
use super::terms::{Seal, Sliding, Term};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Friction per sum of gauge pressures, N/Pa.
    pub coefficient_n_per_pa: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn changes_sliding_force(&self) -> bool {
        self.coefficient_n_per_pa != R::ZERO
    }

    #[inline(always)]
    fn slide<const PARTIALS: bool>(&self, seal: &Seal<R>, sum: &mut Sliding<R>) {
        if seal.gauge_sum_pa > R::ZERO {
            sum.loaded_n += self.coefficient_n_per_pa * seal.gauge_sum_pa;
            sum.loaded_by_pressure += self.coefficient_n_per_pa;
        }
    }
}

/// The sum of both gauge pressures of a cylinder at rest under a supply of 7 bar, rounded.
const USUAL_GAUGE_SUM_PA: f64 = 5.0e5;

pub(super) struct FrictionPressure;

impl Definition for FrictionPressure {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "friction-pressure",
        title: "Friction grows with chamber pressure",
        equation: "g := g + k (p_a + p_b - 2 p_atm)",
        signature: "the odd force residual grows with the sum of the chamber pressures",
        source: "seal lips loaded by chamber pressure; Belforte et al. 2003",
        parameters: &[ParameterInfo {
            name: "coefficient_n_per_pa",
            key: "effects.friction-pressure.coefficient_n_per_pa",
            min: 0.0,
            max: 1.0e-2,
            typical: 2.0e-5,
            meaning: "coefficient k, N/Pa",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        adds_to_levels: &["friction.coulomb_n", "friction.static_n"],
        ..Identification::on(
            Balances::FORCE,
            &[Picture::new(
                Balance::Force,
                Against::Sum,
                "Opposite errors in the two directions that grow with the chamber pressures: seal lips pressed on.",
            )
            .only(Only::Sliding)
            .split(Split::Motion)],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { coefficient_n_per_pa: values[0] }
    }

    fn scales(rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        one(VISIBLE_FRICTION * rig.friction.coulomb_n / USUAL_GAUGE_SUM_PA)
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_level(context, scales)
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Friction grows with the chamber pressures: {:.2} N for each bar of their sum", values[0] * 1e5)
    }
}
