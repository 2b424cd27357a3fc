use super::definition::{Definition, Info, MAX_PARAMETERS, Negligible, ParameterInfo, negligible_level};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Confusion, Identification, Image, ImageContext, Imaged, Likeness, Picture, StandsFor,
    StartContext,
};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// A factor on friction as friction that grows with pressure.
fn as_pressure(context: &ImageContext<'_>) -> Option<Imaged> {
    let added_n = context.away * context.rig.friction.coulomb_n;
    let value = context.image_neutral + added_n / context.gauge_sum_pa?;
    Some(Imaged { added_friction_n: added_n, ..Imaged::at(value) })
}

/// Friction that grows with pressure as a factor.
fn as_factor(context: &ImageContext<'_>) -> Option<Imaged> {
    let added_n = context.away * context.gauge_sum_pa?;
    let value = context.image_neutral + added_n / context.rig.friction.coulomb_n;
    Some(Imaged { added_friction_n: added_n, ..Imaged::at(value) })
}

pub(super) struct CoulombFriction;

impl Definition for CoulombFriction {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "coulomb-friction",
        title: "Friction level changed",
        equation: "F_c := scale F_c, F_s := scale F_s",
        signature: "the force residual is odd in velocity with a constant height",
        source: "Canudas de Wit et al. 1995; worn or dry seals",
        parameters: &[ParameterInfo {
            name: "scale",
            key: "effects.coulomb-friction.scale",
            min: 0.01,
            max: 20.0,
            typical: 1.3,
            meaning: "factor on F_c and F_s",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::FactorOn(&["friction.coulomb_n"]),
        carries_along: &["friction.static_n"],
        size_exponents: [1, 0, 0],
        starts_fitted: 2,
        confused_with: &[Confusion {
            with: Effect::FrictionPressure,
            // The sum of the pressures may hardly change.
            kind: Likeness::Image(Image { beside: None, forward: as_pressure, backward: as_factor }),
            experiment: Some(
                "Repeat a slow stroke at two mean chamber pressures, for example with the supply at 4 bar and at 7 bar.",
            ),
        }],
        ..Identification::on(
            Balances::FORCE,
            &[Picture::new(
                Balance::Force,
                Against::Velocity,
                "A step at zero, equal at all speeds: sliding friction. Behind the prediction means more friction.",
            )],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ONE, R::ZERO, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.coulomb_n = model.coulomb_n * values[0];
        model.static_n = model.static_n * values[0];
    }

    fn negligible(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        negligible_level(context, scales)
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Where the piston sticks at other places than predicted, a small change shows nothing: a large one is tried as well.
        for factor in [1.0, 1.5, 0.7] {
            begin(&[factor * context.neutral[0]]);
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Sliding friction is {:.0} % of nominal at all speeds", values[0] * 100.0)
    }
}
