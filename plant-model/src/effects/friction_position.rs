//! Friction depends on position.
//!
//! Equation: `g := g (1 + slope y/(L/2) + amplitude sin(2 pi y/wavelength))`
//!
//! Signature: the odd force residual varies along the stroke, linearly or with a period
//!
//! Source: Armstrong-Helouvry et al. 1994; worn or bent bore, lead screw

use super::{Info, MAX_PARAMETERS, ParameterInfo};
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;

pub(super) const INFO: Info = Info {
    id: "friction-position",
    title: "Friction depends on position",
    equation: "g := g (1 + slope y/(L/2) + amplitude sin(2 pi y/wavelength))",
    signature: "the odd force residual varies along the stroke, linearly or with a period",
    source: "Armstrong-Helouvry et al. 1994; worn or bent bore, lead screw",
    parameters: &[
        ParameterInfo {
            name: "slope",
            key: "effects.friction-position.slope",
            min: -0.95,
            max: 0.95,
            typical: 0.3,
            meaning: "relative change from mid-stroke to the end",
        },
        ParameterInfo {
            name: "amplitude",
            key: "effects.friction-position.amplitude",
            min: -0.95,
            max: 0.95,
            typical: 0.2,
            meaning: "relative amplitude of the periodic part",
        },
        ParameterInfo {
            name: "wavelength_m",
            key: "effects.friction-position.wavelength_m",
            min: 0.0,
            max: 10.0,
            typical: 0.01,
            meaning: "wavelength of the periodic part, m; 0 switches it off",
        },
    ],
};

pub(super) fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
    [R::ZERO; MAX_PARAMETERS]
}

pub(super) fn apply<R: Real>(values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
    model.position_slope = values[0] / model.half_stroke_m;
    if values[2] > R::ZERO {
        model.position_amplitude = values[1];
        model.position_wave_number = (R::PI + R::PI) / values[2];
    }
}
