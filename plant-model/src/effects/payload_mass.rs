use super::definition::{Definition, Info, MAX_PARAMETERS, ParameterInfo, VISIBLE_PART, one};
use super::identification::{Against, Balance, Balances, Identification, Picture, StandsFor};
pub(crate) use super::terms::NoTerms as Terms;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

pub(super) struct PayloadMass;

impl Definition for PayloadMass {
    type Terms<R: Real> = Terms<R>;

    const INFO: &'static Info = &Info {
        id: "payload-mass",
        title: "Moving mass other than stated",
        equation: "M := mass_kg",
        signature: "the force residual follows the acceleration",
        source: "Newton; Valdiero et al. 2011 (3.8)",
        parameters: &[ParameterInfo {
            name: "mass_kg",
            key: "effects.payload-mass.mass_kg",
            min: 1.0e-3,
            max: 1.0e5,
            typical: 12.0,
            meaning: "moving mass M, kg",
        }],
    };

    const IDENTIFICATION: &'static Identification = &Identification {
        stands_for: StandsFor::ValuesOf(&["load.mass_kg"]),
        length_exponents: [1, 0, 0],
        starts_fitted: 2,
        ..Identification::on(
            Balances::FORCE,
            &[Picture::new(Balance::Force, Against::Acceleration, "A line through zero is a mass other than stated.")],
        )
    };

    fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [rig.load.mass_kg, R::ZERO, R::ZERO]
    }

    fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
        // The right-hand side divides by it.
        model.mass_kg = values[0].at_least(R::of(1.0e-6));
    }

    /// Ten times what is stated. A heavier piston answers forces so little that its mass stands for whatever else keeps the prediction at
    /// rest, such as a drive that forces the motion.
    fn most(rig: &Rig<f64>) -> [f64; MAX_PARAMETERS] {
        one(10.0 * rig.load.mass_kg)
    }

    fn scales(_rig: &Rig<f64>, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        one(VISIBLE_PART * neutral[0])
    }

    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "The force needed to accelerate is that of {:.2} kg", values[0])
    }
}
