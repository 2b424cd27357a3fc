//! Valve dead zone other than stated.
//!
//! Equation: `w = dead_zone(u; right_v, left_v)`
//!
//! Signature: flow starts at another command than the rig file says, in the mass balances of both chambers; never in the force balance; a null offset shifts both break-points the same way
//!
//! Source: Valdiero et al. 2011 (3.1); Tao and Kokotovic 1996

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "valve-dead-zone",
    title: "Valve dead zone other than stated",
    equation: "w = dead_zone(u; right_v, left_v)",
    signature: "flow starts at another command than the rig file says, in the mass balances of both chambers; never in the force balance; a null offset shifts both break-points the same way",
    source: "Valdiero et al. 2011 (3.1); Tao and Kokotovic 1996",
    parameters: &[
        ParameterInfo {
            name: "right_v",
            key: "effects.valve-dead-zone.right_v",
            min: -2.0,
            max: 2.0,
            typical: 0.3,
            meaning: "right break-point, V",
        },
        ParameterInfo {
            name: "left_v",
            key: "effects.valve-dead-zone.left_v",
            min: -2.0,
            max: 2.0,
            typical: -0.3,
            meaning: "left break-point, V, not above the right one",
        },
    ],
};

pub(super) fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.dead_zone.right_v = values[0].at_least(values[1]);
    model.dead_zone.left_v = values[1].at_most(values[0]);
}
