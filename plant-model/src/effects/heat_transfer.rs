//! Heat exchange with the walls.
//!
//! Equation: `gamma := n in (3.6) and (3.7)`
//!
//! Signature: pressure changes by motion and by flow are smaller by n/gamma at all positions alike
//!
//! Source: polytropic process; Carneiro and de Almeida 2006

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "heat-transfer",
    title: "Heat exchange with the walls",
    equation: "gamma := n in (3.6) and (3.7)",
    signature: "pressure changes by motion and by flow are smaller by n/gamma at all positions alike",
    source: "polytropic process; Carneiro and de Almeida 2006",
    parameters: &[ParameterInfo {
        name: "exponent",
        key: "effects.heat-transfer.exponent",
        min: 1.0,
        max: 1.67,
        typical: 1.15,
        meaning: "polytropic exponent n",
    }],
};

pub(super) fn neutral<R: Real>(rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [rig.gas.heat_capacity_ratio, R::ZERO, R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.exponent = values[0];
}
