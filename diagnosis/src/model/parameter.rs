//! One fitted parameter: its meaning, bounds and prior, and the channels it acts on.

use crate::constants;
use crate::data::channel::Channels;
use plant_model::effects::identification::StandsFor;
use plant_model::similarity::size_exponent;
use plant_model::{Effect, Place};
use rig_files::RigKey;

/// What one number of the parameter vector stands for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Slot {
    /// A nominal value of the rig, corrected within its tolerance.
    Nominal(&'static RigKey),
    /// The opening of a point of the rig's table, corrected within its tolerance.
    Opening(usize),
    /// The square of `valve.corner_rounding_v` in V2, corrected within its tolerance: what a rounding does grows with it.
    Rounding,
    /// What the supply's sensor shows too much, Pa.
    SupplySensor,
    /// A parameter of an effect that is a possible cause.
    Effect(Effect, usize),
    /// A parameter of an effect as the rig file states it, corrected within its tolerance.
    Stated(Effect, usize),
    /// The factor of a term outside the catalogue, by its place in the library.
    Term(usize),
}

const SHAPES: [Place; 3] = [Place::spool_inertia, Place::exhaust_overlap_v, Place::opening_smoothness];

impl Slot {
    /// Whether it says what data sheets of valves leave out: the order of the spool's lag, how the opening bends, edges that do not
    /// open together.
    pub(crate) fn is_shape(&self) -> bool {
        match self {
            Self::Nominal(key) => SHAPES.iter().any(|place| *key == place.key()),
            Self::Rounding => true,
            _ => false,
        }
    }

    /// Whether it joins a fit last.
    pub(crate) fn is_fine(&self) -> bool {
        matches!(self, Self::Opening(_)) || self.is_shape()
    }

    /// A value of it as the rig file states it: a rounding is fitted by its square.
    pub(crate) fn as_stated(&self, value: f64) -> f64 {
        if *self == Self::Rounding { value.max(0.0).sqrt() } else { value }
    }

    /// The key of what the rig file states; `None` for what it does not.
    pub(crate) fn stated_key(&self) -> Option<&'static str> {
        match self {
            Self::Nominal(key) => Some(key.path),
            Self::Rounding => Some(Place::corner_rounding_v.key().path),
            Self::Stated(effect, index) => Some(effect.info().parameters[*index].key),
            Self::Effect(..) | Self::Term(_) | Self::Opening(_) | Self::SupplySensor => None,
        }
    }
}

impl PartialEq for Slot {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Nominal(one), Self::Nominal(other)) => one.path == other.path,
            (Self::Effect(one, index), Self::Effect(other, other_index))
            | (Self::Stated(one, index), Self::Stated(other, other_index)) => (one, index) == (other, other_index),
            (Self::Term(one), Self::Term(other)) | (Self::Opening(one), Self::Opening(other)) => one == other,
            (Self::SupplySensor, Self::SupplySensor) | (Self::Rounding, Self::Rounding) => true,
            _ => false,
        }
    }
}

/// One fitted parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Parameter {
    pub(crate) slot: Slot,
    /// Value at which it has no influence.
    pub(crate) neutral: f64,
    /// A change that plainly shows in a log: the unit of search steps.
    pub(crate) scale: f64,
    /// A deviation from neutral below this is too small to be a cause, however small its standard error.
    pub(crate) negligible: f64,
    /// Standard error of the nominal value, for nominal values only.
    pub(crate) tolerance: Option<f64>,
    pub(crate) min: f64,
    pub(crate) max: f64,
    /// Channels it acts on.
    pub(crate) channels: Channels,
}

impl Parameter {
    /// Where a fit begins that knows nothing of it: at nominal. A lag of first order with a delay beside it is a minimum of its own, next to
    /// that of a lag of second order: so the order begins between the two.
    pub(crate) fn begin(&self) -> f64 {
        let order = self.slot == Slot::Nominal(Place::spool_inertia.key());
        if order && self.neutral == 0.0 { self.scale } else { self.neutral }
    }

    /// By how many of its tolerances a value is off what the rig file states; `None` where none is stated.
    pub(crate) fn tolerances_off(&self, value: f64) -> Option<f64> {
        Some((value - self.neutral) / self.tolerance?)
    }

    /// What its tolerance alone tells of it: the curvature of the prior's cost, in its scale; zero where none is stated.
    pub(crate) fn told_by_tolerance(&self) -> f64 {
        self.tolerance.map_or(0.0, |tolerance| (self.scale / tolerance).powi(2))
    }

    /// The exponent with which it changes with the cross-section.
    pub(crate) fn size_exponent(&self) -> i8 {
        match self.slot {
            Slot::Nominal(key) => size_exponent(key.name),
            Slot::Effect(effect, index) | Slot::Stated(effect, index) => effect.size_exponent(index),
            Slot::Term(_) | Slot::Opening(_) | Slot::Rounding | Slot::SupplySensor => 0,
        }
    }

    /// Whether it is the factor of an effect on a nominal value, or on that of both sides.
    pub(crate) fn multiplies(&self, value: &Self) -> bool {
        let (Slot::Effect(effect, index) | Slot::Stated(effect, index), Slot::Nominal(key)) = (self.slot, value.slot)
        else {
            return false;
        };
        let on = effect.identification().factors_on.get(index);
        on.is_some_and(|path| key.path == *path || key.sides.iter().any(|side| side.key().path == *path))
    }

    /// The exponent with which it changes in step with an effect that takes nominal values with it.
    pub(crate) fn exponent_in_step(&self, effect: Effect) -> i8 {
        match self.slot {
            Slot::Nominal(key) => {
                // A path names a key, or the key of both sides that it is one of.
                let names = |path: &str| key.path == path || key.both_sides().is_some_and(|both| both.path == path);
                let keys = effect.identification().moves_in_step;
                keys.iter().find(|(path, _)| names(path)).map_or(0, |(_, exponent)| *exponent)
            }
            Slot::Effect(other, index) | Slot::Stated(other, index) => other.identification().length_exponents[index],
            Slot::Term(_) | Slot::Opening(_) | Slot::Rounding | Slot::SupplySensor => 0,
        }
    }

    /// Whether a value of it is at a bound, as far as steps go.
    pub(crate) fn is_at_bound(&self, value: f64) -> bool {
        (self.max - value).min(value - self.min) < constants::step_smooth() * self.scale
    }

    /// Whether it is a value of the rig file, by its path: corrected, or replaced by an effect.
    pub(crate) fn is_value_of(&self, path: &str) -> bool {
        match self.slot {
            Slot::Nominal(key) => key.path == path,
            Slot::Effect(effect, index) | Slot::Stated(effect, index) => {
                let stands_for = &effect.identification().stands_for;
                matches!(stands_for, StandsFor::ValuesOf(_)) && stands_for.parameter_of(path) == Some(index)
            }
            Slot::Term(_) | Slot::Opening(_) | Slot::Rounding | Slot::SupplySensor => false,
        }
    }
}
