//! How well the nominal values are known.

use plant_model::{RIG_KEYS, RigKey};

/// The `[tolerance]` table: relative standard errors of the nominal values; 0 means exact.
#[derive(Clone, Debug, PartialEq)]
pub struct Tolerance {
    /// For every key that has none of its own; 0.02 is data-sheet accuracy.
    pub default: f64,
    by_key: Vec<Option<f64>>,
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
        Self { default, by_key: vec![None; RIG_KEYS.len()] }
    }

    /// The relative standard error of a key given by full or plain name; unknown names get the default.
    #[must_use]
    pub fn of(&self, name: &str) -> f64 {
        self.own(name).unwrap_or(self.default)
    }

    /// The key's own entry, if it has one.
    #[must_use]
    pub fn own(&self, name: &str) -> Option<f64> {
        index(name).and_then(|at| self.by_key[at])
    }

    /// Gives a key its own relative standard error; false if there is no such key.
    pub fn set(&mut self, name: &str, relative: f64) -> bool {
        index(name).map(|at| self.by_key[at] = Some(relative)).is_some()
    }

    /// The keys that have an entry of their own.
    pub fn entries(&self) -> impl Iterator<Item = (&'static RigKey, f64)> + '_ {
        RIG_KEYS.iter().zip(&self.by_key).filter_map(|(key, value)| value.map(|value| (key, value)))
    }
}

fn index(name: &str) -> Option<usize> {
    RIG_KEYS.iter().position(|key| key.path == name || key.name == name)
}
