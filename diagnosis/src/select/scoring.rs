//! The subset of the data on which candidates are scored and begun.

use crate::estimate::derivatives::Jacobian;
use crate::estimate::problem::{Fit, Problem};

/// What the score test of candidates needs: a subset of the data, and the Jacobian of the fit on it.
pub(crate) struct Scoring<'a> {
    subset: Problem<'a>,
    /// Ratio of all data to the subset, by which scores are multiplied.
    pub(super) ratio: f64,
    pub(super) slopes: Jacobian,
    /// The same for the fit with strained nominal values back at nominal; `None` if none is strained.
    pub(super) relaxed: Option<(Fit, Jacobian)>,
}

impl<'a> Scoring<'a> {
    pub(crate) fn new(problem: &Problem<'a>, from: &Fit) -> Option<Self> {
        let (subset, ratio) = problem.subset();
        let slopes = subset.jacobian(from)?;
        let relax = || {
            let fit = subset.evaluate_as_is(from.hypothesis.relaxed())?;
            let slopes = subset.jacobian(&fit)?;
            Some((fit, slopes))
        };
        let relaxed = if from.hypothesis.strained() == 0 { None } else { relax() };
        Some(Self { subset, ratio, slopes, relaxed })
    }

    /// The subset of the data.
    pub(crate) fn subset(&self) -> &Problem<'a> {
        &self.subset
    }

    /// The Jacobian for a candidate that begins with strained nominal values back at nominal (`anew`) or as fitted.
    pub(crate) fn jacobian(&self, anew: bool) -> &Jacobian {
        self.relaxed.as_ref().filter(|_| anew).map_or(&self.slopes, |(_, slopes)| slopes)
    }
}
