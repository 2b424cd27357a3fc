//! Where the fits of a candidate effect begin.

use crate::estimate::problem::Problem;
use plant_model::Effect;
use plant_model::effects::MAX_PARAMETERS;
use plant_model::effects::identification::{Bounds, StartContext};

/// Initial values of an effect, as its file states them; most leave the model as it is. `wavelengths_m` are those at which
/// the friction residual ripples along the stroke.
pub(crate) fn initial_values(problem: &Problem<'_>, effect: Effect, wavelengths_m: &[f64]) -> Vec<Vec<f64>> {
    let parameters = problem.parameters(effect);
    let mut context = StartContext {
        neutral: [0.0; MAX_PARAMETERS],
        scales: [0.0; MAX_PARAMETERS],
        bounds: [Bounds { min: 0.0, max: 0.0 }; MAX_PARAMETERS],
        wavelengths_m,
    };
    for (index, p) in parameters.iter().enumerate() {
        context.neutral[index] = p.neutral;
        context.scales[index] = p.scale;
        context.bounds[index] = Bounds { min: p.min, max: p.max };
    }
    let mut out = Vec::new();
    effect.starts(&context, &mut |values| {
        let mut all: Vec<f64> = parameters.iter().map(|p| p.neutral).collect();
        all.iter_mut().zip(values).for_each(|(to, from)| *to = *from);
        out.push(all);
    });
    out
}
