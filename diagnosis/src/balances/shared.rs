//! Intermediate signals that many hypotheses share: each is computed once for all hypotheses with equal parameters of
//! it.

use super::compression::{Geometry, Stroke};
use super::correction::Correction;
use super::force::{Forces, Timing};
use super::opening::Path;
use super::valve::{Travel, Way};
use crate::data::split::Stretch;
use plant_model::{FirstOrderLag, Side};
use std::sync::{Arc, Mutex, PoisonError};

/// Signals kept of each kind: those of the hypotheses at work at the same time.
const KEPT: usize = 24;
/// Both chambers have openings of their own.
const OPENINGS_KEPT: usize = 2 * KEPT;
/// Ways of the spool are longer than all other signals, and few hypotheses of a Jacobian have their own.
const WAYS_KEPT: usize = 12;

/// The shared signals of one log.
#[derive(Default)]
pub(crate) struct Signals {
    /// The openings of a chamber's paths, in some stretches or all of the log.
    pub(super) openings: Shared<(Path, Option<Vec<Stretch>>), Vec<f64>, OPENINGS_KEPT>,
    /// Where the valve's spool is, as a chamber feels it, in some stretches or all of the log.
    pub(super) ways: Shared<(Travel, Option<Vec<Stretch>>), Way, WAYS_KEPT>,
    /// What the piston's motion does to the chambers' air in some stretches.
    pub(super) compression: Shared<(Geometry, Vec<Stretch>), Vec<Stroke>>,
    /// How the predictions of a chamber's pressure are judged and corrected in some stretches.
    pub(super) corrections: Shared<(Side, FirstOrderLag<f64>, Vec<Stretch>), Correction>,
    /// Forces and pressures on the piston in some stretches.
    pub(super) forces: Shared<(Timing, Vec<Stretch>), Forces>,
}

/// Values by key, the least recently used one forgotten.
pub(crate) struct Shared<K, V, const MOST: usize = KEPT> {
    known: Mutex<Vec<(K, Arc<V>)>>,
}

impl<K, V, const MOST: usize> Default for Shared<K, V, MOST> {
    fn default() -> Self {
        Self { known: Mutex::default() }
    }
}

impl<K: PartialEq, V, const MOST: usize> Shared<K, V, MOST> {
    /// The value for a key, made unless it is known.
    pub(crate) fn of(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        if let Some(value) = self.find(&key) {
            return value;
        }
        let value = Arc::new(make());
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        if known.len() >= MOST {
            known.remove(0);
        }
        known.push((key, Arc::clone(&value)));
        value
    }

    /// The value of a key, if it is known.
    pub(crate) fn find(&self, key: &K) -> Option<Arc<V>> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let place = known.iter().position(|(other, _)| other == key)?;
        // The most recently used one last.
        known[place..].rotate_left(1);
        known.last().map(|(_, value)| Arc::clone(value))
    }
}
