use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo};
use super::effect::Effect;
use super::identification::{
    Against, Balance, Balances, Confusion, Identification, Likeness, Needs, Only, Picture, StartContext,
};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// What separates a wrong area from forces that do not go with the pressures.
const AT_TWO_SUPPLIES: Option<&str> = Some(
    "Record the same moves at two supply pressures: the force of a wrong area grows with them, other forces do not.",
);

pub(super) struct PistonArea;

impl Definition for PistonArea {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "piston-area",
        title: "Seal acts on another area than the nominal one",
        equation: "A_a := scale_a A, A_b := scale_b A; force A_a (p_a - p_atm) - A_b (p_b - p_atm)",
        signature: "the force residual grows with a chamber's pressure, alike in both directions of motion, and the same chamber's air is compressed by a factor too much or too little",
        source: "geometry of lip seals; the rod takes its part on one side",
        parameters: &[
            ParameterInfo {
                name: "scale_a",
                key: "effects.piston-area.scale_a",
                min: 0.5,
                max: 1.5,
                typical: 1.05,
                meaning: "factor on the area towards chamber A",
            },
            ParameterInfo {
                name: "scale_b",
                key: "effects.piston-area.scale_b",
                min: 0.5,
                max: 1.5,
                typical: 0.96,
                meaning: "factor on the area towards chamber B",
            },
        ],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        needs: Needs::BothPressures,
        factors_on: &["cylinder.area_a_m2", "cylinder.area_b_m2"],
        length_exponents: [-1, -1, 0],
        size_exponents: [1, 1, 0],
        confused_with: &[
            Confusion {
                with: Effect::PositionScale,
                kind: Likeness::Near,
                experiment: Some(
                    "Measure a stroke with a ruler: a wrong area leaves the position right, a wrong sensor gain does not.",
                ),
            },
            // At pressures that change little, a wrong area is a force that changes little.
            Confusion { with: Effect::ConstantForce, kind: Likeness::Near, experiment: AT_TWO_SUPPLIES },
            Confusion { with: Effect::FrictionAsymmetry, kind: Likeness::Near, experiment: AT_TWO_SUPPLIES },
        ],
        ..Identification::on(
            Balances::MASS.and(Balances::FORCE),
            &[
                Picture::new(
                    Balance::Force,
                    Against::PressureA,
                    "An error that grows with the pressure, alike in both directions: another area.",
                )
                .only(Only::Sliding),
                Picture::new(Balance::Force, Against::PressureB, "The same for chamber B.").only(Only::Sliding),
            ],
        )
    };

    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ONE, R::ONE, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        model.area_a_m2 = model.area_a_m2 * values[0];
        model.area_b_m2 = model.area_b_m2 * values[1];
    }

    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Either side alone or both alike: a rod, another seal, another bore.
        let [a, b, _] = context.neutral;
        let [by_a, by_b, _] = context.scales;
        begin(&[a, b]);
        for sign in [1.0, -1.0] {
            begin(&[a + sign * by_a, b]);
            begin(&[a, b + sign * by_b]);
            begin(&[a + sign * by_a, b + sign * by_b]);
        }
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [a, b, _] = *values;
        write!(f, "Pressure acts on {:.1} % of the nominal area on side A and {:.1} % on side B", a * 100.0, b * 100.0)
    }
}
