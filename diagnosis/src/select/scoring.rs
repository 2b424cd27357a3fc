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
        let (subset, ratio) = problem.telling_subset(from);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::hypothesis::Hypothesis;
    use crate::model::nominal::nominal_parameters;
    use plant_model::Effects;
    use rig_files::RigFile;

    #[test]
    fn candidates_are_compared_where_a_fit_errs_though_a_regular_subset_misses_that() {
        let file = RigFile::paper_a();
        let mut log =
            simulated(&file, &Effects::none(), 24_000, |t_s| 0.8 * (6.0 * t_s).cos() + 0.7 * (3.1 * t_s).cos());
        add_noise(&mut log, 5.0e-6, 300.0);
        let pressures = log.p_a_pa.as_mut().expect("a pressure");
        pressures[1_700..2_900].iter_mut().enumerate().for_each(|(k, p)| *p += 3.0e3 * (0.05 * k as f64).sin());
        let record = prepare(&log, &file);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&file, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&file, &record), judgeable, &nominal, (&signals, &effort));
        let fit = problem.evaluate_as_is(Hypothesis::null(&nominal)).expect("a sound rig");
        let misfit = |subset: &Problem<'_>| {
            let cost = subset.evaluate_as_is(fit.hypothesis.clone()).expect("a sound rig").undispersed();
            cost / subset.noise_cost(judgeable)
        };
        let scoring = Scoring::new(&problem, &fit).expect("a fit that can be moved");
        let (regular, telling) = (misfit(&problem.subset().0), misfit(scoring.subset()));
        assert!(regular < 1.2 && telling > 2.0, "{regular} {telling}");
    }
}
