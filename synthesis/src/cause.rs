//! A hidden cause: a catalogue effect or a foreign one, with its values.

use crate::foreign::Foreign;
use plant_model::{Effect, Rig};

/// What was put into a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// An effect of the catalogue with its parameters in the catalogue's order.
    Catalogue(Effect, [f64; 3]),
    /// An effect outside the catalogue with its parameters.
    Foreign(Foreign, [f64; 2]),
}

/// Why a description of a cause could not be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CauseError {
    /// No effect of that name.
    #[error("no effect is called `{id}`; known are: {known}")]
    UnknownEffect {
        /// What was asked for.
        id: String,
        /// All identifiers.
        known: String,
    },
    /// The effect has no parameter of that name.
    #[error("effect `{id}` has no parameter `{name}`; it has: {known}")]
    UnknownParameter {
        /// The effect.
        id: String,
        /// What was asked for.
        name: String,
        /// The parameters it has.
        known: String,
    },
    /// A value that is no number or out of bounds.
    #[error("`{name}` of `{id}` is `{value}`; write a number from {min} to {max}, e.g. `{id}:{name}={example}`")]
    BadValue {
        /// The effect.
        id: String,
        /// The parameter.
        name: String,
        /// What was written.
        value: String,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
        /// A value that would do.
        example: f64,
    },
}

impl Cause {
    /// The identifier.
    #[must_use]
    pub fn id(&self) -> &'static str {
        match self {
            Self::Catalogue(effect, _) => effect.id(),
            Self::Foreign(foreign, _) => foreign.id(),
        }
    }

    /// The catalogue effect, if it is one.
    #[must_use]
    pub fn effect(&self) -> Option<Effect> {
        match self {
            Self::Catalogue(effect, _) => Some(*effect),
            Self::Foreign(..) => None,
        }
    }

    /// Names and values of the parameters.
    #[must_use]
    pub fn parameters(&self) -> Vec<(&'static str, f64)> {
        match self {
            Self::Catalogue(effect, values) => {
                effect.info().parameters.iter().zip(values).map(|(info, value)| (info.name, *value)).collect()
            }
            Self::Foreign(foreign, values) => foreign
                .parameters()
                .iter()
                .zip(values)
                .filter(|(parameter, _)| parameter.name != "unused")
                .map(|(parameter, value)| (parameter.name, *value))
                .collect(),
        }
    }

    /// Reads `id`, `id:name=value` or `id:name=value,name=value`; parameters that are not given keep `default`'s values.
    ///
    /// # Errors
    /// Unknown effect or parameter, or a value out of bounds.
    pub fn parse(text: &str, default: impl FnOnce(Which) -> Self) -> Result<Self, CauseError> {
        let (id, rest) = text.split_once(':').unwrap_or((text, ""));
        let which = Which::from_id(id)?;
        let mut cause = default(which);
        for assignment in rest.split(',').filter(|part| !part.trim().is_empty()) {
            let (name, value) = assignment.split_once('=').unwrap_or((assignment, ""));
            cause.set(name.trim(), value.trim())?;
        }
        Ok(cause)
    }

    fn set(&mut self, name: &str, text: &str) -> Result<(), CauseError> {
        let id = self.id().to_string();
        let names: Vec<&str> = self.parameters().iter().map(|(name, _)| *name).collect();
        let Some(at) = names.iter().position(|known| *known == name) else {
            return Err(CauseError::UnknownParameter { id, name: name.to_string(), known: names.join(", ") });
        };
        let (min, max, example) = match self {
            Self::Catalogue(effect, _) => {
                let info = &effect.info().parameters[at];
                (info.min, info.max, info.typical)
            }
            Self::Foreign(foreign, _) => {
                let [low, high] = foreign.parameters()[at].range;
                // Beyond everyday strength is allowed; nonsense is not.
                (low.min(-10.0 * high.abs()).max(if low > 0.0 { 0.1 * low } else { f64::MIN }), 10.0 * high, high)
            }
        };
        let value = text.parse::<f64>().ok().filter(|value| (min..=max).contains(value)).ok_or_else(|| {
            CauseError::BadValue { id, name: name.to_string(), value: text.to_string(), min, max, example }
        })?;
        match self {
            Self::Catalogue(_, values) => values[at] = value,
            Self::Foreign(_, values) => values[at] = value,
        }
        Ok(())
    }

    /// The cause as [`Cause::parse`] reads it.
    #[must_use]
    pub fn describe(&self) -> String {
        let values: Vec<String> = self.parameters().iter().map(|(name, value)| format!("{name}={value}")).collect();
        format!("{}:{}", self.id(), values.join(","))
    }

    /// The catalogue causes as an effect set for `plant-model`.
    #[must_use]
    pub fn effects(causes: &[Self]) -> plant_model::Effects<f64> {
        let mut effects = plant_model::Effects::none();
        for cause in causes {
            if let Self::Catalogue(effect, values) = cause {
                effects.set(*effect, values);
            }
        }
        effects
    }
}

/// Which effect, without values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// In the catalogue.
    Catalogue(Effect),
    /// Outside.
    Foreign(Foreign),
}

impl Which {
    /// The effect with this identifier.
    ///
    /// # Errors
    /// There is none.
    pub fn from_id(id: &str) -> Result<Self, CauseError> {
        Effect::from_id(id)
            .map(Self::Catalogue)
            .or_else(|| Foreign::from_id(id).map(Self::Foreign))
            .ok_or_else(|| CauseError::UnknownEffect { id: id.to_string(), known: Self::ids().join(", ") })
    }

    /// The identifier.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::Catalogue(effect) => effect.id(),
            Self::Foreign(foreign) => foreign.id(),
        }
    }

    /// All identifiers.
    #[must_use]
    pub fn ids() -> Vec<&'static str> {
        Effect::ALL.into_iter().map(Effect::id).chain(Foreign::ALL.into_iter().map(Foreign::id)).collect()
    }

    /// The cause with neutral values.
    #[must_use]
    pub fn neutral(self, rig: &Rig<f64>) -> Cause {
        match self {
            Self::Catalogue(effect) => Cause::Catalogue(effect, effect.neutral(rig)),
            Self::Foreign(foreign) => Cause::Foreign(foreign, [0.0; 2]),
        }
    }
}
