//! What an effect's file states: its texts and parameters, and how it changes the model.

pub(crate) use super::effect::MAX_PARAMETERS;
use super::identification::{Identification, LogQuality, StartContext};
use super::terms::Term;
use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::Rig;
use core::fmt;

/// One parameter of an effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Key in the rig file; carries the unit.
    pub name: &'static str,
    /// Qualified key for error messages, `effects.ID.NAME`.
    pub key: &'static str,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
    /// A size that is plainly visible on a rig like the paper's: the scale for searches and plots.
    pub typical: f64,
    /// One sentence.
    pub meaning: &'static str,
}

/// The description of an effect: equation, signature, source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Info {
    /// Identifier in rig files, reports and tests.
    pub id: &'static str,
    /// What a technician would call it.
    pub title: &'static str,
    /// The equation it adds or changes.
    pub equation: &'static str,
    /// What betrays it in a log.
    pub signature: &'static str,
    /// Where the form of the equation comes from.
    pub source: &'static str,
    /// The parameters, in the order of the value slices.
    pub parameters: &'static [ParameterInfo],
}

/// An effect, as its file states it. What it adds to the equations it states beside this, as a
/// [`Term`](super::terms::Term).
///
/// The first three functions are the effect on the model. The others are for its identification from a log and stay out of
/// a program that never calls them.
pub(crate) trait Definition {
    /// What it adds to the equations; [`NoTerms`](super::terms::NoTerms) for an effect that only changes coefficients.
    type Terms<R: Real>: Term<R>;

    /// Texts and parameters.
    const INFO: &'static Info;
    /// What its identification needs to know.
    const IDENTIFICATION: &'static Identification;

    /// Parameter values at which the effect vanishes on this rig.
    fn neutral<R: Real>(_rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
        [R::ZERO; MAX_PARAMETERS]
    }

    /// Largest values that physics allows on this rig, for a fit; no larger than those of [`Info`].
    fn most(_rig: &Rig<f64>) -> [f64; MAX_PARAMETERS] {
        core::array::from_fn(|index| Self::INFO.parameters.get(index).map_or(0.0, |parameter| parameter.max))
    }

    /// The least value of each parameter that a cause may have.
    fn least() -> [f64; MAX_PARAMETERS] {
        core::array::from_fn(|index| Self::INFO.parameters.get(index).map_or(0.0, |parameter| parameter.min))
    }

    /// Changes the model's coefficients.
    fn apply<R: Real>(_values: &[R; MAX_PARAMETERS], _model: &mut Coefficients<R>) {}

    /// The coefficients of the effect's own terms.
    fn terms<R: Real>(_values: &[R; MAX_PARAMETERS], _model: &Coefficients<R>) -> Self::Terms<R> {
        Self::Terms::default()
    }

    /// A plainly visible change of each parameter on this rig: the unit of search steps, positive.
    fn scales(_rig: &Rig<f64>, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        typical_scales(Self::INFO, neutral)
    }

    /// Deviations from neutral below which it is no cause, however sure it is.
    fn negligible(_context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        scales.map(|scale| NEGLIGIBLE * scale)
    }

    /// Hands over the values from which a fit begins, one set after the other.
    fn starts(context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
        // Far from the truth the slope at the neutral setting is a poor guide to what a plainly visible change would do.
        around_neutral(context, &[-1.0, -0.25, 0.0, 0.25, 1.0], begin);
    }

    /// The values at which a log must answer for the effect to count as identifiable.
    fn visible(neutral: &[f64; MAX_PARAMETERS], scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
        core::array::from_fn(|k| neutral[k] + scales[k])
    }

    /// The finding in one clause that names a quantity a technician can check; no full stop.
    fn evidence(values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result;
}

/// What the least size of a cause depends on.
#[derive(Clone, Copy, Debug)]
pub struct Negligible<'a> {
    /// The rig as stated.
    pub rig: &'a Rig<f64>,
    /// Where the parameters begin.
    pub neutral: &'a [f64; MAX_PARAMETERS],
    /// The log.
    pub log: &'a LogQuality,
}

/// An effect whose parameters all lie within this part of a plainly visible change is no cause: the equations themselves
/// are not that good.
pub(crate) const NEGLIGIBLE: f64 = 0.04;

/// Least levels of friction, as a part of the nominal one: a faint ripple of some wavelength is found in any noise, and a
/// faint slope in any stick-slip.
pub(crate) const NEGLIGIBLE_FRICTION: f64 = 0.03;

/// A constant force, and friction that differs by direction, are told apart from nothing from this part of friction on:
/// both are seen in every stroke.
pub(crate) const NEGLIGIBLE_BIAS: f64 = 0.02;

/// A plainly visible change of friction, as a part of the nominal one.
pub(crate) const VISIBLE_FRICTION: f64 = 0.3;

/// A plainly visible change of a mass, a viscous coefficient or a breakaway force, as a part of the nominal one.
pub(crate) const VISIBLE_PART: f64 = 0.3;

/// A plainly visible leak, as a part of the valve's filling coefficient.
const VISIBLE_LEAK: f64 = 0.03;

/// Levels of friction as a whole show in sliding, where many samples tell of them: they are told apart from this many
/// standard deviations of the measured pressure force on.
const LEVEL_SIGMAS: f64 = 0.5;

/// Scales from the typical values, for parameters that do not grow with the rig.
pub(crate) fn typical_scales(info: &Info, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
    let mut scales = [1.0; MAX_PARAMETERS];
    for ((scale, parameter), at) in scales.iter_mut().zip(info.parameters).zip(neutral) {
        *scale = typical_scale(parameter.typical, *at);
    }
    scales
}

/// The distance from neutral to a typical value, never zero.
pub(crate) fn typical_scale(typical: f64, neutral: f64) -> f64 {
    (typical - neutral).abs().max(1.0e-3 * typical.abs()).max(1.0e-12)
}

/// One parameter of this scale; the places behind it are not used.
pub(crate) fn one(scale: f64) -> [f64; MAX_PARAMETERS] {
    [scale, 1.0, 1.0]
}

/// The scale of a leak, which grows with the valve.
pub(crate) fn leak_scales(rig: &Rig<f64>) -> [f64; MAX_PARAMETERS] {
    one(VISIBLE_LEAK * rig.linear_coefficients_kg_per_s_pa()[0])
}

/// Within a sampling interval, delays and lags are a matter of how the logger takes its samples.
pub(crate) fn negligible_time(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
    scales.map(|scale| context.log.interval_s.max(NEGLIGIBLE * scale))
}

/// The least change of the level of friction, for a parameter whose `scale` is [`VISIBLE_FRICTION`] of it.
pub(crate) fn negligible_level(context: &Negligible<'_>, scales: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
    let relative = LEVEL_SIGMAS * context.log.force_noise_n / context.rig.friction.coulomb_n;
    scales.map(|scale| relative.max(NEGLIGIBLE_FRICTION) * scale / VISIBLE_FRICTION)
}

/// Starts at neutral plus some multiples of the scale, ascending, within the bounds and without repetition.
pub(crate) fn around_neutral(context: &StartContext<'_>, multiples: &[f64], begin: &mut dyn FnMut(&[f64])) {
    let parameter = &context.bounds[0];
    let mut last = None;
    for multiple in multiples {
        let value = (context.neutral[0] + multiple * context.scales[0]).clamp(parameter.min, parameter.max);
        if last != Some(value) {
            begin(&[value]);
            last = Some(value);
        }
    }
}
