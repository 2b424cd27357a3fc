//! Which effects would show in this log if they were present.

use crate::constants;
use crate::estimate::problem::{Fit, Problem};
use crate::model::effects;
use plant_model::Effect;
use plant_model::effects::MAX_PARAMETERS;
use plant_model::effects::identification::{Balances, Needs};
use rayon::prelude::*;

/// Those candidates that would change the predictions noticeably, if they were present at a plainly visible strength.
pub(crate) fn visible(problem: &Problem<'_>, fit: &Fit, candidates: &[Effect]) -> Vec<Effect> {
    candidates.par_iter().copied().filter(|effect| problem.responds(fit, *effect)).collect()
}

impl Problem<'_> {
    /// Whether an effect of plainly visible strength would change the predictions by more than
    /// `constants::visible_change`.
    pub(crate) fn responds(&self, fit: &Fit, effect: Effect) -> bool {
        let parameters = self.parameters(effect);
        let (mut neutral, mut scales) = ([0.0; MAX_PARAMETERS], [0.0; MAX_PARAMETERS]);
        for (index, p) in parameters.iter().enumerate() {
            (neutral[index], scales[index]) = (p.neutral, p.scale);
        }
        let start = &effect.visible(&neutral, &scales)[..parameters.len()];
        if fit.hypothesis.effects.contains(&effect) {
            return true;
        }
        let channels = parameters.iter().fold(0, |all, p| all | p.channels);
        let extended = fit.hypothesis.extended_by(effect, parameters, start);
        let base = self.evaluate(&fit.hypothesis, &fit.hypothesis.values, channels);
        let moved = self.evaluate(&extended, &extended.values, channels);
        let (Some(base), Some(moved)) = (base, moved) else { return false };
        let pairs = base.channels.iter().zip(&moved.channels).zip(self.dispersion);
        let change: f64 = pairs.map(|((a, b), d)| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / d).sum();
        0.5 * change > constants::visible_change()
    }
}

/// Effects whose balances and sensors this log has.
pub(crate) fn candidates(problem: &Problem<'_>) -> Vec<Effect> {
    let has = problem.record.available;
    Effect::ALL
        .into_iter()
        .filter(|effect| {
            let channels = effects::channels(*effect);
            let enough = match effect.identification().needs {
                Needs::Nothing => true,
                Needs::AnyPressure => has.pressure_a || has.pressure_b,
                Needs::BothPressures => has.pressure_a && has.pressure_b && !has.vented_b,
            };
            // What a chamber without air and without a sensor could do.
            let of_b = Balances::MASS.bits() & channels == Balances::MASS_B.bits();
            enough && !(has.vented_b && of_b) && channels & problem.judgeable != 0
        })
        .collect()
}
