//! What a search has fitted so far, so that nothing is fitted twice.

use crate::constants;
use crate::data::channel::Channels;
use crate::estimate::problem::{Fit, Problem};
use plant_model::Effect;

/// A hypothesis that was tried, for the appendix of the report.
#[derive(Clone, Debug)]
pub(crate) struct Tried {
    pub(crate) effects: Vec<Effect>,
    /// Cost with a dispersion of one, so that all hypotheses are on the same scale.
    pub(crate) cost: f64,
    pub(crate) fitted: bool,
}

impl Tried {
    /// Of a fit.
    pub(super) fn of(fit: &Fit) -> Self {
        Self { effects: fit.hypothesis.effects.clone(), cost: fit.undispersed(), fitted: true }
    }
}

/// The fits of a search so far, so that none is repeated.
#[derive(Default)]
pub(crate) struct Memory {
    pub(crate) tried: Vec<Tried>,
    pub(super) explored: Vec<Explored>,
    /// Those of a search under another reading of the rows, or another noise: their costs say nothing, their values are near.
    before: Vec<Explored>,
}

/// The extensions of a set of causes.
#[derive(Clone)]
pub(super) struct Explored {
    pub(super) from: Fit,
    /// Channels: each extension acts on at least one of them.
    pub(super) acting: Channels,
    pub(super) fits: Vec<Fit>,
}

impl Memory {
    /// For a search under another reading of the rows, or another noise.
    pub(crate) fn for_another(&self) -> Self {
        Self { before: [&self.before[..], &self.explored].concat(), ..Self::default() }
    }

    /// A hypothesis fitted in full.
    pub(crate) fn note(&mut self, fit: &Fit) {
        self.tried.push(Tried::of(fit));
    }

    /// The extensions of an earlier fit with the same causes and no higher cost; the latest if there are several.
    pub(super) fn extensions(&self, problem: &Problem<'_>, from: &Fit, acting: Channels) -> Option<&Explored> {
        let known = |e: &&Explored| {
            e.extends(from, acting) && e.from.cost(problem) < from.cost(problem) + constants::same_cost()
        };
        self.explored.iter().rev().find(known)
    }

    /// The extensions of an earlier fit with the same causes, whatever its cost.
    pub(super) fn begun(&self, from: &Fit, acting: Channels) -> Option<&Explored> {
        self.before.iter().chain(&self.explored).rev().find(|e| e.extends(from, acting))
    }
}

impl Explored {
    /// Whether these are extensions of the same causes that act on some channels.
    fn extends(&self, from: &Fit, acting: Channels) -> bool {
        let [known, effects] = [&self.from, from].map(|fit| &fit.hypothesis.effects);
        acting & !self.acting == 0
            && known.len() == effects.len()
            && known.iter().all(|effect| effects.contains(effect))
    }
}
