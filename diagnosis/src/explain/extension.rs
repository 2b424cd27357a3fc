//! What the extended rig has that the rig file has not, and how well each effect of it stands.

use super::cause::parameters;
use crate::estimate::problem::{Fit, Problem};
use crate::outcome::{Cause, Standing, Supported};
use crate::validate::support;

/// The effects of the extended rig's fit; `named` are the causes.
pub(crate) fn extension(problem: &Problem<'_>, fit: &Fit, named: &[Cause]) -> Vec<Supported> {
    let gains = support::gains(problem, fit);
    let standing = |id: &str| match named.iter().find(|cause| cause.id == id) {
        Some(cause) if cause.ties.is_empty() => Standing::Named,
        Some(_) => Standing::Tied,
        None => Standing::WorkingHypothesis,
    };
    let effects = fit.hypothesis.effects.iter().zip(gains);
    effects
        .map(|(effect, gain)| Supported {
            id: effect.id().to_string(),
            standing: standing(effect.id()),
            parameters: parameters(problem, fit, *effect),
            gain: gain.is_finite().then_some(gain),
        })
        .collect()
}
