//! A part of a log as it would be read with a mistake of its mapping undone.

use super::effort::Effort;
use super::likelihood::COST_OF_NOISE;
use super::problem::{Fit, Problem};
use crate::balances::shared::Signals;
use crate::check::mapping;
use crate::constants;
use crate::data::channel::Channels;
use crate::data::grid::{Between, refined};
use crate::data::prepare::prepare;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Parameter;
use rig_files::{Log, RigFile};

/// The part of what was beyond noise that may be left of a mistake undone: a shift of 1 to 3 ms leaves 0 to 14 % of it in null logs,
/// and effects of the catalogue are not mistaken for one.
pub(super) const MOST_LEFT: f64 = 0.2;

/// A part of a log, and how it is judged.
pub(super) struct Reading<'a> {
    pub(super) rig: &'a RigFile,
    pub(super) part: Log,
    pub(super) judgeable: Channels,
    pub(super) nominal: &'a [Parameter],
}

/// What the nominal values are with a log as it is read, and what is left beyond noise, over noise.
#[derive(Clone)]
pub(super) struct Read {
    pub(super) nominal: Hypothesis,
    pub(super) left: f64,
    /// What noise would cost: how much of the log is judged.
    pub(super) noise: f64,
}

impl Read {
    /// Whether no more is left than noise.
    pub(super) fn is_noise(&self) -> bool {
        self.left < constants::like_noise() - 1.0
    }
}

impl<'a> Reading<'a> {
    pub(super) fn of(rig: &'a RigFile, log: &Log, (judgeable, nominal): (Channels, &'a [Parameter])) -> Self {
        Self { rig, part: mapping::excerpt(log), judgeable, nominal }
    }

    /// A log read after a fit.
    pub(super) fn read(&self, log: &Log, fit: impl FnOnce(&Problem<'_>) -> Option<Fit>) -> Option<Read> {
        let record = refined(prepare(log, self.rig), Between::Held);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((self.rig, &record), self.judgeable, self.nominal, (&signals, &effort));
        let fit = fit(&problem)?;
        let noise = 2.0 * COST_OF_NOISE * problem.noise_cost(self.judgeable);
        let left = fit.undispersed() / noise - 1.0;
        Some(Read { nominal: fit.hypothesis, left, noise })
    }
}
