//! The data of a fit, and the cost of a hypothesis on them: minus the log-posterior up to a constant.

use super::effort::Effort;
use super::known_residuals::Known;
use super::likelihood::{Residuals, average_neighbours, dispersion, loss};
use crate::balances::added::Added;
use crate::balances::observers::{self, Innovations, Mechanics};
use crate::balances::shared::Signals;
use crate::balances::term_library::{self, Term};
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::data::record::Record;
use crate::data::split::{Stretch, samples};
use crate::model::effects;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Parameter;
use nalgebra::DMatrix;
use plant_model::{Effect, Plant};
use rayon::prelude::*;
use rig_files::RigFile;
use std::sync::OnceLock;

/// The data of a fit, with everything that is the same for all hypotheses.
pub(crate) struct Problem<'a> {
    pub(crate) rig: &'a RigFile,
    pub(crate) record: &'a Record,
    pub(crate) stretches: Vec<Stretch>,
    pub(crate) judgeable: Channels,
    /// The nominal values that are corrected.
    pub(crate) nominal: &'a [Parameter],
    /// Intermediate signals, shared between hypotheses.
    pub(crate) signals: &'a Signals,
    /// What has been computed so far.
    pub(crate) effort: &'a Effort,
    /// The library of terms outside the catalogue.
    pub(crate) terms: &'a [Term],
    /// Long-run variance of each channel's innovations at the best fit so far, 1 for white noise. Divides the channel's
    /// cost.
    pub(crate) dispersion: [f64; 4],
    /// How mechanics are judged.
    pub(crate) mechanics: Mechanics,
    /// A force that opposes positive motion whatever the hypothesis, N, one value per sample; empty for none.
    pub(crate) disturbance_n: &'a [f64],
    /// How many averaged innovations are judged in each channel; found when first asked for.
    pub(crate) judged: OnceLock<[usize; 4]>,
    /// Residuals of the last fits.
    pub(crate) known: Known,
}

/// The result of fitting a hypothesis.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) hypothesis: Hypothesis,
    /// Sum of the robust loss per channel, before division by the dispersion.
    pub(crate) channel_cost: [f64; 4],
    /// What it costs per channel that errors may be larger than the sensor's noise, before division by the dispersion.
    pub(crate) width_cost: [f64; 4],
    /// Minus the log-prior: half the squared deviations of nominal values in tolerances.
    pub(crate) prior_cost: f64,
    /// Covariance of the parameters by the sandwich estimator; `None` before [`Problem::with_errors`].
    pub(crate) covariance: Option<DMatrix<f64>>,
}

impl Fit {
    /// Values and what is known of them, without a cost.
    #[cfg(test)]
    pub(crate) fn of_values(hypothesis: Hypothesis, covariance: DMatrix<f64>) -> Self {
        Self { hypothesis, channel_cost: [0.0; 4], width_cost: [0.0; 4], prior_cost: 0.0, covariance: Some(covariance) }
    }

    /// Total cost with the problem's dispersion: minus log-likelihood up to a constant.
    pub(crate) fn cost(&self, problem: &Problem<'_>) -> f64 {
        let all = problem.judgeable;
        problem.sum_over(&self.channel_cost, all) + problem.sum_over(&self.width_cost, all) + self.prior_cost
    }

    /// Total cost with white noise in every channel.
    pub(crate) fn undispersed(&self) -> f64 {
        self.channel_cost.iter().sum::<f64>() + self.width_cost.iter().sum::<f64>() + self.prior_cost
    }

    /// Cost in some channels with the problem's dispersion, without the prior.
    pub(crate) fn cost_in(&self, problem: &Problem<'_>, channels: Channels) -> f64 {
        problem.sum_over(&self.channel_cost, channels)
    }
}

impl<'a> Problem<'a> {
    /// The part of a record that fits use, with white noise in every channel and no terms outside the catalogue.
    pub(crate) fn new(
        (rig, record): (&'a RigFile, &'a Record),
        judgeable: Channels,
        nominal: &'a [Parameter],
        (signals, effort): (&'a Signals, &'a Effort),
    ) -> Self {
        Self {
            rig,
            record,
            stretches: record.stretches.iter().copied().filter(|s| !s.held_back).collect(),
            judgeable,
            nominal,
            signals,
            effort,
            terms: &[],
            dispersion: [1.0; 4],
            mechanics: Mechanics::default(),
            disturbance_n: &[],
            judged: OnceLock::new(),
            known: Known::default(),
        }
    }

    /// The same problem on other parts of the record.
    pub(crate) fn on(&self, stretches: Vec<Stretch>) -> Self {
        Self { stretches, judged: OnceLock::new(), known: Known::default(), ..*self }
    }

    /// The same problem with mechanics judged another way.
    pub(crate) fn judging(&self, mechanics: Mechanics) -> Self {
        Self { mechanics, ..self.on(self.stretches.clone()) }
    }

    /// The same problem with a force that no hypothesis knows of, N, one value per sample.
    pub(crate) fn disturbed<'b>(&'b self, force_n: &'b [f64]) -> Problem<'b> {
        Problem { disturbance_n: force_n, ..self.on(self.stretches.clone()) }
    }

    /// The same problem as if noise were white in every channel.
    pub(crate) fn with_white_noise(&self) -> Self {
        Self { dispersion: [1.0; 4], ..self.on(self.stretches.clone()) }
    }

    /// The same problem on the part of the log held back.
    pub(crate) fn held_back(&self) -> Self {
        self.on(self.record.stretches.iter().copied().filter(|s| s.held_back).collect())
    }

    /// The parameters of an effect on this rig.
    pub(crate) fn parameters(&self, effect: Effect) -> Vec<Parameter> {
        effects::effect_parameters(self.rig, effect, self.judgeable, &self.record.quality)
    }

    /// What a hypothesis adds to its plant.
    pub(super) fn added(&self, hypothesis: &Hypothesis, values: &[f64]) -> Added {
        let terms = term_library::sum(self.terms, hypothesis.factors(values));
        let mut added = Added { supply_sensor_pa: hypothesis.supply_sensor_pa(values), ..terms };
        if !self.disturbance_n.is_empty() {
            added.add(&Added { force_n: self.disturbance_n.to_vec(), ..Added::default() }, 1.0);
        }
        added
    }

    /// The averaged innovations of a hypothesis at some values in some channels. The effort counted does not depend on what is known,
    /// and so not on the order in which threads come to it.
    pub(crate) fn evaluate(&self, hypothesis: &Hypothesis, values: &[f64], wanted: Channels) -> Option<Residuals> {
        let plant = hypothesis.plant(self.rig, values)?;
        let wanted = wanted & self.judgeable;
        self.effort.add(samples(&self.stretches), wanted, &plant);
        let known = self.known.find(hypothesis, values, wanted);
        let is_known = |channel: &Channel| !known.channels[*channel as usize].is_empty();
        let wanted = Channel::ALL.into_iter().filter(is_known).fold(wanted, |left, channel| left & !channel.bit());
        if wanted == 0 {
            return Some(known);
        }
        let added = self.added(hypothesis, values);
        let innovations =
            observers::innovations(self.record, self.signals, &plant, &added, &self.stretches, wanted, self.mechanics);
        let mut out = average_neighbours(&innovations, self.record.averaged());
        out.fill_in(&known);
        Some(out)
    }

    /// Changes of the averaged innovations by small changes of the opening, see [`observers::by_openings`].
    pub(super) fn by_openings_of(
        &self,
        (plant, others): (&Plant<f64>, &[Plant<f64>]),
        added: &Added,
        wanted: Channels,
    ) -> Vec<Residuals> {
        self.effort.add_linearised(samples(&self.stretches), wanted, plant, others.len());
        let (record, stretches) = (self.record, &self.stretches);
        let changes = observers::by_openings(record, self.signals, (plant, others), added, stretches, wanted);
        changes.iter().map(|changes| average_neighbours(changes, record.averaged())).collect()
    }

    /// Costs by channel, summed over some channels with the problem's dispersion.
    pub(super) fn sum_over(&self, channel_cost: &[f64; 4], channels: Channels) -> f64 {
        let pairs = channel_cost.iter().zip(self.dispersion).enumerate();
        pairs.filter(|(k, _)| channels & (1 << k) != 0).map(|(_, (c, d))| c / d).sum()
    }

    /// Cost of a hypothesis at some values in some channels, without the prior.
    pub(crate) fn cost_of(&self, hypothesis: &Hypothesis, values: &[f64], channels: Channels) -> Option<f64> {
        let residuals = self.evaluate(hypothesis, values, channels)?;
        Some(self.sum_over(&Self::channel_cost(&residuals), channels))
    }

    /// Cost by channel.
    fn channel_cost(residuals: &Residuals) -> [f64; 4] {
        let mut cost = [0.0; 4];
        for (cost, channel) in cost.iter_mut().zip(&residuals.channels) {
            *cost = channel.iter().map(|e| loss(*e)).sum();
        }
        cost
    }

    pub(crate) fn total(&self, residuals: &Residuals, hypothesis: &Hypothesis, values: &[f64]) -> f64 {
        let all = self.judgeable;
        let errors = self.sum_over(&Self::channel_cost(residuals), all);
        errors + self.sum_over(&residuals.log_widths, all) + prior(hypothesis, values)
    }

    /// The same problem on a subset of its data, for comparing candidates, and the ratio of all data to the subset.
    pub(crate) fn subset(&self) -> (Self, f64) {
        self.subset_from(0)
    }

    /// The same on the subset that shows what a fit leaves: where a regular one has less than half of that beyond noise, as of a rest
    /// between its pieces, the one that has most.
    pub(crate) fn telling_subset(&self, fit: &Fit) -> (Self, f64) {
        let left = |(subset, _): &(Self, f64)| {
            let fit = subset.evaluate_as_is(fit.hypothesis.clone());
            fit.map_or(0.0, |fit| fit.undispersed() - subset.noise_cost(subset.judgeable))
        };
        let all: Vec<((Self, f64), f64)> = (0..self.every_piece())
            .into_par_iter()
            .map(|first| self.subset_from(first))
            .map(|subset| {
                let left = left(&subset);
                (subset, left)
            })
            .collect();
        let most = all.iter().map(|(_, left)| *left).fold(0.0, f64::max);
        let chosen = all.into_iter().find(|(_, left)| *left >= 0.5 * most);
        chosen.map_or_else(|| self.subset(), |(subset, _)| subset)
    }

    /// A subset has every so many pieces of the data.
    fn every_piece(&self) -> usize {
        (samples(&self.stretches) as f64 * self.record.step_s.max(1.0e-6) / constants::subset_s()).round().max(1.0)
            as usize
    }

    /// The subset whose first piece is this one.
    fn subset_from(&self, first: usize) -> (Self, f64) {
        let count = |stretches: &[Stretch]| samples(stretches) as f64;
        let (all, interval) = (count(&self.stretches), self.record.step_s.max(1.0e-6));
        let length = ((constants::subset_piece_s() / interval) as usize).max(1);
        let pieces = self.stretches.iter().flat_map(|stretch| {
            let starts = stretch.range().step_by(length).map(|start| (start, (start + length).min(stretch.end)));
            starts.map(|(start, end)| Stretch { start, end, ..*stretch })
        });
        let every = self.every_piece();
        let mut stretches: Vec<Stretch> = pieces.skip(first).step_by(every).collect();
        stretches.retain(|piece| piece.range().len() as f64 * interval >= constants::shortest_stretch_s());
        if every == 1 || stretches.is_empty() {
            stretches.clone_from(&self.stretches);
        }
        let ratio = all / count(&stretches).max(1.0);
        (self.on(stretches), ratio)
    }

    /// Expected cost of white noise in some channels, by the square loss.
    pub(crate) fn noise_cost(&self, channels: Channels) -> f64 {
        let judged = self.judged.get_or_init(|| self.count_judged());
        let counted = judged.iter().enumerate().filter(|(channel, _)| channels & (1 << channel) != 0);
        0.5 * counted.map(|(_, count)| *count as f64).sum::<f64>()
    }

    /// How many averaged innovations are judged in each channel: the same for all hypotheses.
    fn count_judged(&self) -> [usize; 4] {
        let null = Hypothesis::null(self.nominal);
        let Some(plant) = null.plant(self.rig, &null.values) else { return [0; 4] };
        let innovations = observers::innovations(
            self.record,
            self.signals,
            &plant,
            &Added::default(),
            &self.stretches,
            self.judgeable,
            self.mechanics,
        );
        let whole = |e: &&[f64]| !e.iter().any(|e| e.is_nan());
        innovations.channels.map(|e| e.chunks_exact(self.record.averaged()).filter(whole).count())
    }

    /// A fit from the residuals at a hypothesis' values.
    pub(crate) fn finish(&self, hypothesis: Hypothesis, residuals: &Residuals) -> Fit {
        let prior_cost = prior(&hypothesis, &hypothesis.values);
        self.known.keep(&hypothesis, residuals);
        Fit {
            prior_cost,
            channel_cost: Self::channel_cost(residuals),
            width_cost: residuals.log_widths,
            hypothesis,
            covariance: None,
        }
    }

    /// Innovations at a fit, sample by sample.
    pub(crate) fn innovations(&self, fit: &Fit) -> Option<Innovations> {
        let values = &fit.hypothesis.values;
        let plant = fit.hypothesis.plant(self.rig, values)?;
        let added = self.added(&fit.hypothesis, values);
        Some(observers::innovations(
            self.record,
            self.signals,
            &plant,
            &added,
            &self.stretches,
            self.judgeable,
            self.mechanics,
        ))
    }

    /// Long-run variance of each channel's innovations at a fit.
    pub(crate) fn dispersion_at(&self, fit: &Fit) -> [f64; 4] {
        let mut out = [1.0; 4];
        let Some(innovations) = self.innovations(fit) else { return out };
        for channel in Channel::ALL {
            out[channel as usize] = dispersion(&innovations.channels[channel as usize], self.record.dispersion_span());
        }
        out
    }
}

fn prior(hypothesis: &Hypothesis, values: &[f64]) -> f64 {
    hypothesis
        .parameters
        .iter()
        .zip(values)
        .filter_map(|(p, value)| Some(0.5 * p.tolerances_off(*value)?.powi(2)))
        .sum()
}
