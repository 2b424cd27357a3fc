//! Moving mass other than stated.
//!
//! Equation: `M := mass_kg`
//!
//! Signature: the force residual follows the acceleration
//!
//! Source: Newton; Valdiero et al. 2011 (3.8)

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
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

pub(super) fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [rig.load.mass_kg, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.mass_kg = values[0].at_least(R::of(1.0e-6));
}
