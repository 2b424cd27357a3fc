use super::definition::{
    Definition, Info, MAX_PARAMETERS, NEGLIGIBLE_BIAS, Negligible, ParameterInfo, VISIBLE_FRICTION, one,
};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Confusion, Identification, Image, ImageContext, Imaged, Likeness, Only, Picture,
};
use super::terms::{Force, Term};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// Coefficients of its term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Terms<R> {
    /// Force opposing positive motion, N.
    pub force_n: R,
}

impl<R: Real> Term<R> for Terms<R> {
    #[inline(always)]
    fn force(&self, _y_m: R, _v_m_per_s: R, sum: &mut Force<R>) {
        sum.force_n -= self.force_n;
    }
}

/// What tells a force from an offset of a pressure sensor.
const VENTED: Option<&str> =
    Some("Vent both chambers to atmosphere for a few seconds: a pressure offset stays, a force does not show.");

/// The reading of A that is too high by the force over its area.
fn as_offset_a(context: &ImageContext<'_>) -> Option<Imaged> {
    Some(Imaged::at(context.away / context.rig.cylinder.area_a_m2))
}

fn offset_a_as_force(context: &ImageContext<'_>) -> Option<Imaged> {
    Some(Imaged::at(context.away * context.rig.cylinder.area_a_m2))
}

/// The reading of B that is too low by the force over its area.
fn as_offset_b(context: &ImageContext<'_>) -> Option<Imaged> {
    Some(Imaged::at(-context.away / context.rig.cylinder.area_b_m2))
}

fn offset_b_as_force(context: &ImageContext<'_>) -> Option<Imaged> {
    Some(Imaged::at(-context.away * context.rig.cylinder.area_b_m2))
}

pub(super) struct ConstantForce;

impl Definition for ConstantForce {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "constant-force",
        title: "Constant force on the piston",
        equation: "M v' = A (p_a - p_b) - F - F_0",
        signature: "the force residual has the same value in both directions of motion and at rest",
        source: "incline, gravity, spring balance",
        parameters: &[ParameterInfo {
            name: "force_n",
            key: "effects.constant-force.force_n",
            min: -1.0e4,
            max: 1.0e4,
            typical: 8.0,
            meaning: "force F_0 opposing positive motion, N",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        confused_with: &[
            Confusion {
                // g (1 + a sign v) sign v = g sign v + a g, so F_0 = a F_c except around standstill.
                with: Effect::FrictionAsymmetry,
                kind: Likeness::Structural,
                experiment: Some(
                    "Hold both chambers at equal pressure with the piston disconnected from its load, or turn the \
                     cylinder round: a constant force stays with the surroundings, an asymmetric seal turns with the \
                     cylinder. A log alone cannot tell them apart.",
                ),
            },
            Confusion {
                with: Effect::PressureAOffset,
                kind: Likeness::Image(Image { beside: None, forward: as_offset_a, backward: offset_a_as_force }),
                experiment: VENTED,
            },
            Confusion {
                with: Effect::PressureBOffset,
                kind: Likeness::Image(Image { beside: None, forward: as_offset_b, backward: offset_b_as_force }),
                experiment: VENTED,
            },
        ],
        ..Identification::on(
            Balances::FORCE,
            &[Picture::new(
                Balance::Force,
                Against::Velocity,
                "The same sign in both directions of motion: a constant force, or friction that differs by direction.",
            )
            .only(Only::Sliding)],
        )
    };

    fn terms<R: Real>(values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Terms<R> {
        Terms { force_n: values[0] }
    }

    fn scales(rig: &Rig<f64>, _neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        one(VISIBLE_FRICTION * rig.friction.coulomb_n)
    }

    fn negligible(context: &Negligible<'_>, _scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        [NEGLIGIBLE_BIAS * context.rig.friction.coulomb_n; MAX_PARAMETERS]
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "A constant force of {:.2} N pushes the piston towards {}, in both directions of motion",
            values[0].abs(),
            if values[0] > 0.0 { "chamber A (−y)" } else { "chamber B (+y)" }
        )
    }
}
