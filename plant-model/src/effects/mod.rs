//! What real rigs add to the paper's model: one file per physical effect.
//!
//! Every effect has an identifier (used in rig files, reports and tests), parameters with units and bounds, a neutral
//! setting that gives back the paper's model bit for bit, and a signature: what betrays it in a log. Effects compose:
//! `Effects::apply` folds them into the model's coefficients in the order of [`Effect::ALL`].

mod choked_flow;
mod constant_force;
mod coulomb_friction;
mod dead_volume;
mod exhaust_coefficient;
mod fill_coefficient;
mod friction_asymmetry;
mod friction_position;
mod friction_pressure;
mod heat_transfer;
mod leak_chamber_a;
mod leak_chamber_b;
mod leak_cross_piston;
mod line_delay;
mod payload_mass;
mod position_delay;
mod position_scale;
mod pressure_a_offset;
mod pressure_b_offset;
mod pressure_lag;
mod static_friction;
mod supply_droop;
mod valve_dead_zone;
mod valve_hysteresis;
mod valve_lag;
mod viscous_friction;

use crate::coefficients::Coefficients;
use crate::real::Real;
use crate::rig::{ParameterError, Rig};

/// The most parameters one effect has.
pub const MAX_PARAMETERS: usize = 3;

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

macro_rules! catalogue {
    ($($variant:ident => $module:ident),+ $(,)?) => {
        /// Every effect the model can take on.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Effect {
            $(#[doc = concat!("See `effects/", stringify!($module), ".rs`.")] $variant,)+
        }

        impl Effect {
            /// All effects, in the order in which they are applied to the model.
            pub const ALL: [Self; 0 $(+ { let _ = Self::$variant; 1 })+] = [$(Self::$variant),+];

            /// Equation, signature, source and parameters.
            #[must_use]
            pub const fn info(self) -> &'static Info {
                match self { $(Self::$variant => &$module::INFO),+ }
            }

            /// The parameter values at which the effect vanishes on this rig.
            #[must_use]
            pub fn neutral<R: Real>(self, rig: &Rig<R>) -> [R; MAX_PARAMETERS] {
                match self { $(Self::$variant => $module::neutral(rig)),+ }
            }

            fn apply<R: Real>(self, values: &[R; MAX_PARAMETERS], model: &mut Coefficients<R>) {
                match self { $(Self::$variant => $module::apply(values, model)),+ }
            }
        }
    };
}

catalogue! {
    ValveDeadZone => valve_dead_zone,
    ValveLag => valve_lag,
    ValveHysteresis => valve_hysteresis,
    FillCoefficient => fill_coefficient,
    ExhaustCoefficient => exhaust_coefficient,
    ChokedFlow => choked_flow,
    SupplyDroop => supply_droop,
    LeakCrossPiston => leak_cross_piston,
    LeakChamberA => leak_chamber_a,
    LeakChamberB => leak_chamber_b,
    LineDelay => line_delay,
    DeadVolume => dead_volume,
    HeatTransfer => heat_transfer,
    PayloadMass => payload_mass,
    ConstantForce => constant_force,
    CoulombFriction => coulomb_friction,
    ViscousFriction => viscous_friction,
    StaticFriction => static_friction,
    FrictionAsymmetry => friction_asymmetry,
    FrictionPosition => friction_position,
    FrictionPressure => friction_pressure,
    PositionScale => position_scale,
    PressureAOffset => pressure_a_offset,
    PressureBOffset => pressure_b_offset,
    PressureLag => pressure_lag,
    PositionDelay => position_delay,
}

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

    const fn index(self) -> usize {
        self as usize
    }
}

impl core::fmt::Display for Effect {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.id())
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

    pub(crate) fn apply(&self, model: &mut Coefficients<R>) {
        for effect in Effect::ALL {
            if let Some(values) = &self.values[effect.index()] {
                effect.apply(values, model);
            }
        }
    }
}
