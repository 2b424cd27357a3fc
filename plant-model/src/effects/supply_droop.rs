//! Supply pressure droops with flow.
//!
//! Equation: `tau p_sup' = p_set - k q - p_sup, q the flow drawn`
//!
//! Signature: filling is too slow while much flow is drawn and recovers with a time constant; visible directly where p_sup is recorded
//!
//! Source: receiver and regulator as a first-order source; Beater 2007

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "supply-droop",
    title: "Supply pressure droops with flow",
    equation: "tau p_sup' = p_set - k q - p_sup, q the flow drawn",
    signature: "filling is too slow while much flow is drawn and recovers with a time constant; visible directly where p_sup is recorded",
    source: "receiver and regulator as a first-order source; Beater 2007",
    parameters: &[
        ParameterInfo {
            name: "droop_pa_s_per_kg",
            key: "effects.supply-droop.droop_pa_s_per_kg",
            min: 0.0,
            max: 1.0e9,
            typical: 3.0e7,
            meaning: "pressure lost per mass flow drawn k, Pa s/kg",
        },
        ParameterInfo {
            name: "time_constant_s",
            key: "effects.supply-droop.time_constant_s",
            min: 1.0e-3,
            max: 10.0,
            typical: 0.1,
            meaning: "recovery time constant tau, s",
        },
    ],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO, R::of(0.1), R::ZERO]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.droop_pa_s_per_kg = values[0];
    model.droop_time_constant_s = values[1].at_least(R::of(1.0e-3));
}
