//! How well the nominal values are known.

use plant_model::{BOTH_SIDES, Effect, Effects, RIG_KEYS, RigKey, all_keys, rig_key};

/// The `[tolerance]` table: relative standard errors of the nominal values; 0 means exact.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// For every key that has none of its own; 0.02 is data-sheet accuracy.
    pub default: f64,
    by_key: Vec<Option<f64>>,
    by_parameter: Vec<(Effect, usize, f64)>,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self::uniform(0.02)
    }
}

impl Tolerance {
    /// The same relative standard error for all keys.
    #[must_use]
    pub fn uniform(default: f64) -> Self {
        Self { default, by_key: vec![None; RIG_KEYS.len() + BOTH_SIDES.len()], by_parameter: Vec::new() }
    }

    /// The relative standard error of a key given by full or plain name; unknown names get the default.
    #[must_use]
    pub fn of(&self, name: &str) -> f64 {
        self.own(name).unwrap_or(self.default)
    }

    /// The key's own entry, if it has one; that of both sides counts for either, and the larger of two for both.
    #[must_use]
    pub fn own(&self, name: &str) -> Option<f64> {
        let key = rig_key(name)?;
        let stated = |key: &RigKey| self.by_key[key.index()];
        stated(key).or_else(|| key.both_sides().and_then(stated)).or_else(|| {
            let sides = key.sides.iter().map(|side| stated(side.key()));
            sides.reduce(|one, other| Some(one?.max(other?))).flatten()
        })
    }

    /// Gives a key its own relative standard error; false if there is no such key.
    pub fn set(&mut self, name: &str, relative: f64) -> bool {
        rig_key(name).map(|key| self.by_key[key.index()] = Some(relative)).is_some()
    }

    /// The relative standard error of the value that the rig file states for a parameter of an effect; 0, exact, unless it has
    /// an entry of its own.
    #[must_use]
    pub fn of_effect(&self, effect: Effect, parameter: usize) -> f64 {
        let found = self.by_parameter.iter().find(|(e, index, _)| (*e, *index) == (effect, parameter));
        found.map_or(0.0, |(_, _, relative)| *relative)
    }

    /// Gives a parameter of an effect a relative standard error.
    pub fn set_effect(&mut self, effect: Effect, parameter: usize, relative: f64) {
        self.by_parameter.retain(|(e, index, _)| (*e, *index) != (effect, parameter));
        self.by_parameter.push((effect, parameter, relative));
    }

    /// The parameters of effects that have an entry and are stated: where they have none, their value is not known less well
    /// but absent.
    pub fn effect_entries<'a>(&'a self, stated: &'a Effects<f64>) -> impl Iterator<Item = (Effect, usize, f64)> + 'a {
        self.by_parameter.iter().copied().filter(|(effect, ..)| stated.get(*effect).is_some())
    }

    /// The keys that have an entry of their own.
    pub fn entries(&self) -> impl Iterator<Item = (&'static RigKey, f64)> + '_ {
        all_keys().filter_map(|key| self.by_key[key.index()].map(|value| (key, value)))
    }
}
