//! What real rigs add to the paper's model: one file per physical effect.
//!
//! A file holds everything about its effect: identifier (used in rig files, reports and tests), parameters with units and
//! bounds, a neutral setting that gives back the paper's model bit for bit, what it changes in the equations or adds to
//! them, and what its identification from a log needs. A line in [`for_each_effect!`](crate::for_each_effect) adds the
//! file; everything else iterates. `docs/adding-an-effect.md` has the steps.
//!
//! Effects compose: `Effects::apply` folds them into the model's coefficients in the order of [`Effect::ALL`].

mod definition;
mod effect;
mod first_order;
pub mod identification;
mod list;
pub(crate) mod terms;

use crate::coefficients::Coefficients;
use crate::measurement::Measurement;
use crate::real::Real;
use crate::rig::{ParameterError, Rig};
use core::fmt;
use definition::Definition;
use identification::{
    Confusion, Identification, Image, ImageContext, Imaged, Likeness, LogQuality, RECOMMENDED_EXPERIMENT, StartContext,
};
use terms::{Chamber, Seal, Sliding, Term};

pub use definition::{Info, Negligible, ParameterInfo};
pub use effect::{Effect, MAX_PARAMETERS};
pub use first_order::FirstOrderLag;
pub use terms::{ChamberFlow, Force, Side};
pub use valve_lag::Terms as ValveLagTerms;
pub(crate) use wall_heat::WarmthRate;

macro_rules! sense_in_reverse {
    ($added:ident, $shown:ident,) => {};
    ($added:ident, $shown:ident, $first:ident $($rest:ident)*) => {
        sense_in_reverse!($added, $shown, $($rest)*);
        $added.$first.sense(&mut $shown);
    };
}

macro_rules! catalogue {
    ($($variant:ident => $module:ident),+ $(,)?) => {
        $(pub(crate) mod $module;)+

        impl Effect {
            /// Equation, signature, source and parameters.
            #[must_use]
            pub const fn info(self) -> &'static Info {
                match self { $(Self::$variant => <$module::$variant as Definition>::INFO),+ }
            }

            /// What its identification from a log has to know.
            #[must_use]
            pub const fn identification(self) -> &'static Identification {
                match self { $(Self::$variant => <$module::$variant as Definition>::IDENTIFICATION),+ }
            }

            /// The parameter values at which the effect vanishes on this rig.
            #[must_use]
            pub fn neutral<R: Real>(self, rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
                match self { $(Self::$variant => $module::$variant::neutral(rig)),+ }
            }

            fn apply<R: Real>(
                self,
                values: &[R; MAX_PARAMETERS],
                model: &mut Coefficients<R>,
                added: &mut Added<R>,
            ) {
                match self {
                    $(Self::$variant => {
                        $module::$variant::apply(values, model);
                        added.$module = $module::$variant::terms(values, model);
                    }),+
                }
            }

            /// Largest parameter values that physics allows on this rig.
            #[must_use]
            pub fn most(self, rig: &Rig<f64>) -> [f64; MAX_PARAMETERS] {
                match self { $(Self::$variant => $module::$variant::most(rig)),+ }
            }

            /// The least value of each parameter that a cause may have.
            #[must_use]
            pub fn least(self) -> [f64; MAX_PARAMETERS] {
                match self { $(Self::$variant => $module::$variant::least()),+ }
            }

            /// A plainly visible change of each parameter from `neutral` on this rig: the unit of search steps, positive.
            #[must_use]
            pub fn scales(self, rig: &Rig<f64>, neutral: &[f64; MAX_PARAMETERS]) -> [f64; MAX_PARAMETERS] {
                match self { $(Self::$variant => $module::$variant::scales(rig, neutral)),+ }
            }

            /// Deviations from `neutral` below which it is no cause, however sure it is, for a log of this quality; `scales`
            /// as from [`Effect::scales`].
            #[must_use]
            pub fn negligible(
                self,
                rig: &Rig<f64>,
                neutral: &[f64; MAX_PARAMETERS],
                scales: &[f64; MAX_PARAMETERS],
                log: &LogQuality,
            ) -> [f64; MAX_PARAMETERS] {
                let context = Negligible { rig, neutral, log };
                match self { $(Self::$variant => $module::$variant::negligible(&context, scales)),+ }
            }

            /// Hands over the values from which a fit begins, one set after the other: as many as it has parameters, or
            /// only the first, where the others stay at neutral.
            pub fn starts(self, context: &StartContext<'_>, begin: &mut dyn FnMut(&[f64])) {
                match self { $(Self::$variant => $module::$variant::starts(context, begin)),+ }
            }

            /// The values at which a log must answer for the effect to count as identifiable.
            #[must_use]
            pub fn visible(
                self,
                neutral: &[f64; MAX_PARAMETERS],
                scales: &[f64; MAX_PARAMETERS],
            ) -> [f64; MAX_PARAMETERS] {
                match self { $(Self::$variant => $module::$variant::visible(neutral, scales)),+ }
            }

            fn write_evidence(self, values: &[f64; MAX_PARAMETERS], f: &mut fmt::Formatter<'_>) -> fmt::Result {
                match self { $(Self::$variant => $module::$variant::evidence(values, f)),+ }
            }
        }

        /// Coefficients of the terms that effects add to the paper's model, by the name of their file; the default adds
        /// nothing.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Added<R> {
            $(#[doc = concat!("Of `effects/", stringify!($module), ".rs`.")] pub $module: $module::Terms<R>,)+
        }

        impl<R: Real> Default for Added<R> {
            fn default() -> Self {
                Self { $($module: $module::Terms::default()),+ }
            }
        }

        impl<R: Real> Added<R> {
            #[inline]
            pub(crate) fn is_present(&self) -> bool {
                false $(|| self.$module.is_present())+
            }

            #[inline]
            pub(crate) fn changes_sliding_force(&self) -> bool {
                false $(|| self.$module.changes_sliding_force())+
            }

            /// Of the sliding force `plain_n`, the least that can be left anywhere in the stroke, N.
            pub(crate) fn least_sliding_n(&self, plain_n: R, half_stroke_m: R) -> R {
                let mut sum = Sliding::at(plain_n);
                $(self.$module.slide_least(half_stroke_m, &mut sum);)+
                sum.loaded_n * sum.factor * sum.place
            }

            #[inline(always)]
            pub(crate) fn flow(&self, chamber: &Chamber<R>, sum: &mut ChamberFlow<R>) {
                $(self.$module.flow(chamber, sum);)+
            }

            /// Whether any effect's force on the piston depends on position or velocity.
            pub(crate) const FORCE_VARIES: bool = false $(|| <$module::Terms<R> as Term<R>>::FORCE_VARIES)+;

            #[inline(always)]
            pub(crate) fn force(&self, y_m: R, v_m_per_s: R, sum: &mut Force<R>) {
                $(self.$module.force(y_m, v_m_per_s, sum);)+
            }

            #[inline(always)]
            pub(crate) fn slide<const PARTIALS: bool>(&self, plain_n: R, seal: &Seal<R>) -> Sliding<R> {
                let mut sum = Sliding::at(plain_n);
                $(self.$module.slide::<PARTIALS>(seal, &mut sum);)+
                sum
            }

            /// What sensors show: a sensor's gain before its offset, that is in the reverse of the order of the list.
            #[inline(always)]
            pub(crate) fn sense(&self, mut shown: Measurement<R>) -> Measurement<R> {
                sense_in_reverse!(self, shown, $($module)+);
                shown
            }

            /// The inverse of [`Added::sense`], therefore in the order of the list.
            #[inline]
            pub(crate) fn true_pressure_pa(&self, side: Side, mut shown_pa: R) -> R {
                $(shown_pa = self.$module.true_pressure_pa(side, shown_pa);)+
                shown_pa
            }

            #[inline]
            pub(crate) fn true_position_m(&self, mut shown_m: R) -> R {
                $(shown_m = self.$module.true_position_m(shown_m);)+
                shown_m
            }
        }
    };
}

crate::for_each_effect!(catalogue);

impl Effect {
    /// The identifier used in rig files, reports and tests.
    #[must_use]
    pub const fn id(self) -> &'static str {
        self.info().id
    }

    /// The effect with this identifier.
    #[must_use]
    pub fn from_id(id: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|effect| effect.id() == id)
    }

    /// How many parameters it has: 1 to [`MAX_PARAMETERS`].
    #[must_use]
    pub const fn parameter_count(self) -> usize {
        self.info().parameters.len()
    }

    /// The finding in one clause that names a quantity a technician can check, without a full stop. Missing values count as
    /// zero.
    #[must_use]
    pub fn evidence(self, values: &[f64]) -> Evidence {
        let mut all = [0.0; MAX_PARAMETERS];
        for (to, from) in all.iter_mut().zip(values) {
            *to = *from;
        }
        Evidence { effect: self, values: all }
    }

    /// What is stated about this effect and another being alike, whichever of the two files states it.
    #[must_use]
    pub fn confusion_with(self, other: Self) -> Option<&'static Confusion> {
        let stated = |one: Self, other: Self| {
            one.identification().confused_with.iter().find(|confusion| confusion.with == other)
        };
        stated(self, other).or_else(|| stated(other, self))
    }

    /// Every effect that is like this one.
    pub fn confused_with(self) -> impl Iterator<Item = (Self, &'static Confusion)> {
        Self::ALL.into_iter().filter_map(move |other| Some((other, self.confusion_with(other)?)))
    }

    /// How one of its parameters changes with the cross-section, see [`crate::similarity`].
    #[must_use]
    pub fn size_exponent(self, parameter: usize) -> i8 {
        let by_unit = crate::similarity::size_exponent(self.info().parameters[parameter].name);
        by_unit + self.identification().size_exponents[parameter]
    }

    /// The effects that no log of these sensors tells from this one.
    pub fn structural_ties(self) -> impl Iterator<Item = Self> {
        self.confused_with()
            .filter(|(_, confusion)| matches!(confusion.kind, Likeness::Structural))
            .map(|(other, _)| other)
    }

    /// The effects that do nearly the same at a value that can be computed, beside those that are `present`.
    pub fn images_among(self, present: &[Self]) -> impl Iterator<Item = Self> {
        let alike = move |(other, confusion): (Self, &Confusion)| match confusion.kind {
            Likeness::Image(Image { beside, .. }) => {
                beside.is_none_or(|companion| present.contains(&companion)).then_some(other)
            }
            Likeness::Near | Likeness::Structural => None,
        };
        self.confused_with().filter_map(alike)
    }

    /// This effect as another that is its image. `None` where the log does not say enough, or where it has no such image.
    #[must_use]
    pub fn as_image(self, other: Self, context: &ImageContext<'_>) -> Option<Imaged> {
        let confusion = self.confusion_with(other)?;
        let Likeness::Image(image) = confusion.kind else { return None };
        if confusion.with == other { (image.forward)(context) } else { (image.backward)(context) }
    }

    /// The recording that would tell two effects apart, or make an effect visible.
    #[must_use]
    pub fn experiment_against(self, other: Self) -> &'static str {
        self.confusion_with(other).and_then(|confusion| confusion.experiment).unwrap_or(RECOMMENDED_EXPERIMENT)
    }

    const fn index(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id())
    }
}

/// See [`Effect::evidence`].
#[derive(Clone, Copy, Debug)]
pub struct Evidence {
    effect: Effect,
    values: [f64; MAX_PARAMETERS],
}

impl fmt::Display for Evidence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.effect.write_evidence(&self.values, f)
    }
}

/// A set of effects with their parameter values; empty by default, which is the paper's model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effects<R> {
    values: [Option<[R; MAX_PARAMETERS]>; Effect::ALL.len()],
}

impl<R: Real> Default for Effects<R> {
    fn default() -> Self {
        Self { values: [None; Effect::ALL.len()] }
    }
}

impl<R: Real> Effects<R> {
    /// No effects: the paper's model.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// The same set with one effect added or replaced; parameters missing from `values` are zero.
    #[must_use]
    pub fn with(mut self, effect: Effect, values: &[R]) -> Self {
        self.set(effect, values);
        self
    }

    /// Adds or replaces an effect. Values beyond its parameter count are ignored, missing ones are zero; ranges are
    /// checked by [`Effects::validate`].
    pub fn set(&mut self, effect: Effect, values: &[R]) {
        let mut slot = [R::ZERO; MAX_PARAMETERS];
        for (to, from) in slot.iter_mut().zip(values).take(effect.parameter_count()) {
            *to = *from;
        }
        self.values[effect.index()] = Some(slot);
    }

    /// Removes an effect.
    pub fn remove(&mut self, effect: Effect) {
        self.values[effect.index()] = None;
    }

    /// The parameter values of an effect, if it is in the set.
    #[must_use]
    pub fn get(&self, effect: Effect) -> Option<&[R]> {
        self.values[effect.index()].as_ref().map(|values| &values[..effect.parameter_count()])
    }

    /// The effects in the set with their values, in the order of application.
    pub fn iter(&self) -> impl Iterator<Item = (Effect, &[R])> {
        Effect::ALL.into_iter().filter_map(|effect| Some((effect, self.get(effect)?)))
    }

    /// Whether the set is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.values.iter().all(Option::is_none)
    }

    /// The same set in another scalar type.
    #[must_use]
    pub fn convert<S: Real>(&self) -> Effects<S> {
        Effects { values: self.values.map(|slot| slot.map(|values| values.map(|v| S::of(v.to_f64())))) }
    }

    /// Checks every parameter against its bounds.
    ///
    /// # Errors
    /// The first parameter that is not finite or out of bounds.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (effect, values) in self.iter() {
            for (info, value) in effect.info().parameters.iter().zip(values) {
                let value = value.to_f64();
                // The bounds are decimal numbers; leave a single-precision value that was rounded from one inside.
                let slack = |bound: f64| 1e-6 * bound.abs();
                if !(value >= info.min - slack(info.min) && value <= info.max + slack(info.max)) {
                    return Err(ParameterError {
                        key: info.key,
                        value,
                        must: "lie within the bounds of the effect catalogue".into(),
                    });
                }
            }
        }
        Ok(())
    }

    pub(crate) fn apply(&self, model: &mut Coefficients<R>, added: &mut Added<R>) {
        for effect in Effect::ALL {
            if let Some(values) = &self.values[effect.index()] {
                effect.apply(values, model, added);
            }
        }
    }
}
