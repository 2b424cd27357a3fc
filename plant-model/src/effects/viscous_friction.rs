use super::definition::{
    Definition, Info, MAX_PARAMETERS, NEGLIGIBLE_FRICTION, Negligible, ParameterInfo, VISIBLE_PART, one,
};
use super::identification::{Against, Balance, Balances, Identification, Picture, StandsFor, StartContext};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

pub(super) struct ViscousFriction;

impl Definition for ViscousFriction {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "viscous-friction",
        title: "Viscous friction changed",
        equation: "sigma2 := coefficient",
        signature: "the force residual is proportional to velocity",
        source: "Valdiero et al. 2011 (3.9); lubricant, temperature",
        parameters: &[ParameterInfo {
            name: "coefficient_n_s_per_m",
            key: "effects.viscous-friction.coefficient_n_s_per_m",
            min: 0.0,
            max: 1.0e4,
            typical: 60.0,
            meaning: "viscous coefficient sigma2, N s/m",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::ValuesOf(&["friction.viscous_n_s_per_m"]),
        length_exponents: [1, 0, 0],
        ..Identification::on(
            Balances::FORCE,
            &[Picture::new(Balance::Force, Against::Velocity, "An error that grows with the speed: the viscous part.")],
        )
    };

    fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [rig.friction.viscous_n_s_per_m, R::ZERO, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.viscous = values[0];
    }

    fn scales(_rig: &Rig<f64>, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        one(VISIBLE_PART * neutral[0])
    }

    fn negligible(context: &Negligible<'_>, _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        context.neutral.map(|nominal| NEGLIGIBLE_FRICTION * nominal)
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Where the piston sticks at other places than predicted, a small change shows nothing: a large one is tried as well.
        for factor in [1.0, 1.5, 0.7] {
            begin(&[factor * context.neutral[0]]);
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The part of friction that grows with speed is {:.1} N s/m", values[0])
    }
}
