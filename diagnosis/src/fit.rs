//! Least squares on innovations: robust loss, tolerances as priors, Levenberg-Marquardt steps.

use crate::balance::shared::Signals;
use crate::balance::{self, Channel, Channels, Innovations};
use crate::hypothesis::{self, Hypothesis, Parameter, Slot};
use crate::record::{Record, SHORTEST_STRETCH_S, Stretch};
use crate::terms::{self, Term};
use nalgebra::{DMatrix, DVector};
use plant_model::Effect;
use rayon::prelude::*;
use rig_files::RigFile;

/// Innovations beyond this many standard deviations count less and less: mispredicted stick-slip must not rule.
const ROBUST_KNEE: f64 = 3.0;
/// Innovations are averaged over this many samples before they are compared; they are white, so little is lost.
pub(crate) const BUNDLE: usize = 4;

/// Mean robust cost of one bundled, unit-variance, normal innovation.
pub(crate) const COST_OF_NOISE: f64 = 0.466;

/// Half the squared change of predictions, in noise units, from which on an effect counts as visible in a log.
const RESPONDS: f64 = 50.0;

/// Candidates are compared on about this much of the log, s, taken in pieces of some length, s, from all of it.
const ENOUGH_TO_COMPARE_S: f64 = 8.0;
const PIECE_S: f64 = 1.5;

/// Steps that derivatives are taken with, in plainly visible changes. The force balance is rugged; that of the air is
/// smooth, and directions that nearly cancel show only with small steps.
pub(crate) struct SearchStep {
    pub(crate) rugged: f64,
    pub(crate) smooth: f64,
}
pub(crate) const SEARCH_STEP: SearchStep = SearchStep { rugged: 0.02, smooth: 1.0e-3 };

/// A small step: no parameter moves by more than this, in plainly visible changes, and the cost falls by no more than this
/// part of it.
const NEAR: f64 = 0.1;
const SMALL_GAIN: f64 = 0.02;

/// A step that gains less ends a fit: far below what any comparison asks for.
const CONVERGED: f64 = 0.1;
/// Beyond this many times the cost of noise steps are tried longer as well, and less of the cost is worth a step.
const FAR_FROM_NOISE: f64 = 1.5;
const CONVERGED_FAR: f64 = 1.0e-3;
/// Iterations of a full fit.
pub(crate) const ITERATIONS: usize = 20;
/// So many steps in a row that each gain less than this part of what the goal asks for end a fit as well.
const HOPELESS: f64 = 0.02;
const HOPELESS_STEPS: usize = 2;
/// Rounds of searching beside a solution on rugged ground.
const RUGGED_ROUNDS: usize = 2;
/// That search takes away no more than this part of what noise does not explain.
const MOST_FOUND_BESIDE: f64 = 0.25;

/// The data a fit is judged on.
pub(crate) struct Problem<'a> {
    pub(crate) rig: &'a RigFile,
    pub(crate) record: &'a Record,
    pub(crate) stretches: Vec<Stretch>,
    pub(crate) judgeable: Channels,
    /// The nominal values that are corrected.
    pub(crate) nominal: &'a [Parameter],
    /// Signals computed already.
    pub(crate) signals: &'a Signals,
    /// The library of terms outside the catalogue.
    pub(crate) terms: &'a [Term],
    /// Divides the cost of each channel: how much more than white noise its innovations vary at best.
    pub(crate) dispersion: [f64; 4],
}

/// The result of fitting a hypothesis.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) hypothesis: Hypothesis,
    /// Half the robust sum of squares, per channel, in units of the noise, dispersion not included.
    pub(crate) channel_cost: [f64; 4],
    /// Half the squared deviations of nominal values in units of their tolerance.
    pub(crate) prior_cost: f64,
    /// Inverse of the normal matrix at the solution; empty until asked for.
    pub(crate) covariance: Option<DMatrix<f64>>,
}

impl Fit {
    /// Total cost with the problem's dispersion: minus log-likelihood up to a constant.
    pub(crate) fn cost(&self, problem: &Problem<'_>) -> f64 {
        let data: f64 = self.channel_cost.iter().zip(problem.dispersion).map(|(c, d)| c / d).sum();
        data + self.prior_cost
    }

    /// Total cost with white noise in every channel.
    pub(crate) fn undispersed(&self) -> f64 {
        self.channel_cost.iter().sum::<f64>() + self.prior_cost
    }

    /// Cost in some channels with the problem's dispersion, tolerances left out.
    pub(crate) fn cost_in(&self, problem: &Problem<'_>, channels: Channels) -> f64 {
        problem.sum_over(&self.channel_cost, channels)
    }
}

/// Normal matrix and gradient.
pub(crate) type Normal = (DMatrix<f64>, DVector<f64>);

/// Bundled innovations of one evaluation, with the channel offsets.
#[derive(Clone, Default)]
pub(crate) struct Residuals {
    pub(crate) channels: [Vec<f64>; 4],
}

/// A fit's residuals with their derivatives by its parameters, in the parameters' order.
pub(crate) struct Slopes {
    pub(crate) base: Residuals,
    pub(crate) columns: Vec<Residuals>,
    slots: Vec<Slot>,
}

impl Slopes {
    /// The derivatives by one parameter.
    fn by(&self, slot: Slot) -> Option<&Residuals> {
        self.slots.iter().position(|other| *other == slot).map(|place| &self.columns[place])
    }
}

fn bundle(innovations: &Innovations) -> Residuals {
    let mut out = Residuals::default();
    let root = (BUNDLE as f64).sqrt();
    for (to, from) in out.channels.iter_mut().zip(&innovations.channels) {
        to.extend(from.chunks(BUNDLE).map(|chunk| {
            let sum: f64 = chunk.iter().sum();
            // A NaN anywhere in the bundle leaves it out: it counts as no deviation for every model alike.
            if sum.is_nan() || chunk.len() < BUNDLE { 0.0 } else { sum / root }
        }));
    }
    out
}

/// Mean cost of a channel's innovations over that of white noise, the worst part left out.
pub(crate) fn calm_misfit(innovations: &[f64], left_out: f64) -> f64 {
    let mut costs: Vec<f64> = innovations
        .chunks_exact(BUNDLE)
        .map(|chunk| chunk.iter().sum::<f64>() / (BUNDLE as f64).sqrt())
        .filter(|e| !e.is_nan())
        .map(loss)
        .collect();
    costs.sort_unstable_by(f64::total_cmp);
    costs.truncate((costs.len() as f64 * (1.0 - left_out)).ceil() as usize);
    costs.iter().sum::<f64>() / (COST_OF_NOISE * costs.len().max(1) as f64)
}

fn loss(e: f64) -> f64 {
    let x = e / ROBUST_KNEE;
    ROBUST_KNEE * ROBUST_KNEE * ((1.0 + x * x).sqrt() - 1.0)
}

pub(crate) fn weight(e: f64) -> f64 {
    let x = e / ROBUST_KNEE;
    1.0 / (1.0 + x * x).sqrt()
}

impl<'a> Problem<'a> {
    /// The same problem on the part of the log held back.
    pub(crate) fn held_back(&self) -> Problem<'a> {
        let stretches = self.record.stretches.iter().copied().filter(|s| s.held_back).collect();
        Problem { stretches, ..*self }
    }

    /// The parameters of an effect on this rig.
    pub(crate) fn parameters(&self, effect: Effect) -> Vec<Parameter> {
        hypothesis::effect_parameters(self.rig, effect, self.judgeable, &self.record.quality)
    }

    pub(crate) fn evaluate(&self, hypothesis: &Hypothesis, values: &[f64], wanted: Channels) -> Option<Residuals> {
        let plant = hypothesis.plant(self.rig, values)?;
        let added = terms::sum(self.terms, hypothesis.factors(values));
        let wanted = wanted & self.judgeable;
        Some(bundle(&balance::innovations(self.record, self.signals, &plant, &added, &self.stretches, wanted)))
    }

    /// Costs by channel, summed over some channels with the problem's dispersion.
    fn sum_over(&self, channel_cost: &[f64; 4], channels: Channels) -> f64 {
        let pairs = channel_cost.iter().zip(self.dispersion).enumerate();
        pairs.filter(|(k, _)| channels & (1 << k) != 0).map(|(_, (c, d))| c / d).sum()
    }

    /// What some values of a hypothesis' parameters cost in some channels, tolerances left out.
    pub(crate) fn cost_of(&self, hypothesis: &Hypothesis, values: &[f64], channels: Channels) -> Option<f64> {
        let residuals = self.evaluate(hypothesis, values, channels)?;
        Some(self.sum_over(&Self::channel_cost(&residuals), channels))
    }

    fn channel_cost(residuals: &Residuals) -> [f64; 4] {
        let mut cost = [0.0; 4];
        for (cost, channel) in cost.iter_mut().zip(&residuals.channels) {
            *cost = channel.iter().map(|e| loss(*e)).sum();
        }
        cost
    }

    pub(crate) fn total(&self, residuals: &Residuals, hypothesis: &Hypothesis, values: &[f64]) -> f64 {
        let cost = Self::channel_cost(residuals);
        cost.iter().zip(self.dispersion).map(|(c, d)| c / d).sum::<f64>() + prior(hypothesis, values)
    }

    /// Residual derivatives of one parameter by a one-sided difference, over the channels it acts on.
    pub(crate) fn column(
        &self,
        hypothesis: &Hypothesis,
        values: &[f64],
        base: &Residuals,
        index: usize,
        step: &SearchStep,
    ) -> Residuals {
        let parameter = &hypothesis.parameters[index];
        let rugged = Channel::Position.bit();
        let mut out = Residuals::default();
        for (channels, relative) in [(rugged, step.rugged), (!rugged, step.smooth)] {
            let wanted = parameter.channels & channels;
            if wanted == 0 {
                continue;
            }
            let mut step = relative * parameter.scale;
            let mut moved = values.to_vec();
            if values[index] + step > parameter.max {
                step = -step;
            }
            moved[index] += step;
            let residuals = self.evaluate(hypothesis, &moved, wanted).or_else(|| {
                step = -step;
                moved[index] = values[index] + step;
                self.evaluate(hypothesis, &moved, wanted)
            });
            for (channel, new) in residuals.iter().flat_map(|r| r.channels.iter().enumerate()) {
                let pairs = new.iter().zip(&base.channels[channel]);
                if !new.is_empty() {
                    out.channels[channel] = pairs.map(|(a, b)| (a - b) / step * parameter.scale).collect();
                }
            }
        }
        out
    }

    /// The slopes at a fit.
    pub(crate) fn slopes(&self, fit: &Fit) -> Option<Slopes> {
        let h = &fit.hypothesis;
        let base = self.evaluate(h, &h.values, self.judgeable)?;
        let column = |index: usize| self.column(h, &h.values, &base, index, &SEARCH_STEP);
        let columns = (0..h.values.len()).into_par_iter().map(column).collect();
        Some(Slopes { base, columns, slots: h.parameters.iter().map(|p| p.slot).collect() })
    }

    /// Normal matrix and gradient in units of the parameters' scales; `known` is that of the first columns.
    pub(crate) fn normal(
        &self,
        hypothesis: &Hypothesis,
        values: &[f64],
        base: &Residuals,
        columns: &[&Residuals],
        known: Option<&Normal>,
    ) -> Normal {
        let n = columns.len();
        let mut matrix = DMatrix::zeros(n, n);
        let mut gradient = DVector::zeros(n);
        let first = known.map_or(0, |(_, gradient)| gradient.len());
        if let Some((known_matrix, known_gradient)) = known {
            matrix.view_mut((0, 0), (first, first)).copy_from(known_matrix);
            gradient.rows_mut(0, first).copy_from(known_gradient);
        }
        for channel in 0..4 {
            let residuals = &base.channels[channel];
            if residuals.is_empty() {
                continue;
            }
            let factor = 1.0 / self.dispersion[channel];
            let weights: Vec<f64> = residuals.iter().map(|e| weight(*e) * factor).collect();
            for i in first..n {
                let a = &columns[i].channels[channel];
                if a.is_empty() {
                    continue;
                }
                let weighted: Vec<f64> = a.iter().zip(&weights).map(|(a, w)| a * w).collect();
                gradient[i] += weighted.iter().zip(residuals).map(|(a, e)| a * e).sum::<f64>();
                for j in 0..=i {
                    let b = &columns[j].channels[channel];
                    if !b.is_empty() {
                        matrix[(i, j)] += weighted.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                    }
                }
            }
        }
        for i in first..n {
            if let Some(tolerance) = hypothesis.parameters[i].tolerance {
                let scaled = hypothesis.parameters[i].scale / tolerance;
                matrix[(i, i)] += scaled * scaled;
                gradient[i] += (values[i] - hypothesis.parameters[i].neutral) / tolerance * scaled;
            }
            for j in 0..i {
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        (matrix, gradient)
    }

    /// The same problem on a part of its data, for comparisons among candidates; with how many times more data it has.
    pub(crate) fn thinned(&self) -> (Self, f64) {
        let count = |stretches: &[Stretch]| stretches.iter().map(|s| s.range().len()).sum::<usize>() as f64;
        let (all, interval) = (count(&self.stretches), self.record.quality.interval_s.max(1.0e-6));
        let every = (all * interval / ENOUGH_TO_COMPARE_S).round().max(1.0) as usize;
        let length = ((PIECE_S / interval) as usize).max(1);
        let pieces = self.stretches.iter().flat_map(|stretch| {
            let starts = stretch.range().step_by(length).map(|start| (start, (start + length).min(stretch.end)));
            starts.map(|(start, end)| Stretch { start, end, ..*stretch })
        });
        let mut stretches: Vec<Stretch> = pieces.step_by(every).collect();
        stretches.retain(|piece| piece.range().len() as f64 * interval >= SHORTEST_STRETCH_S);
        if every == 1 || stretches.is_empty() {
            stretches.clone_from(&self.stretches);
        }
        let ratio = all / count(&stretches).max(1.0);
        (Self { stretches, ..*self }, ratio)
    }

    /// Cost that noise alone makes in some channels.
    pub(crate) fn noise_cost(&self, channels: Channels) -> f64 {
        let samples = self.stretches.iter().map(|s| s.end - s.start).sum::<usize>() / BUNDLE;
        0.5 * samples as f64 * f64::from(channels.count_ones())
    }

    /// Judges a hypothesis as it is.
    pub(crate) fn judge(&self, hypothesis: Hypothesis) -> Option<Fit> {
        self.refit(hypothesis, 0, 0)
    }

    /// Fits all parameters of a hypothesis from its values.
    pub(crate) fn fit(&self, hypothesis: Hypothesis, iterations: usize) -> Option<Fit> {
        self.settle(hypothesis, self.judgeable, iterations, f64::INFINITY)
    }

    /// [`Problem::refit`], and a look beside the solution on rugged ground, unless that could not take it to `goal`.
    pub(crate) fn settle(
        &self,
        hypothesis: Hypothesis,
        changed: Channels,
        iterations: usize,
        goal: f64,
    ) -> Option<Fit> {
        let mut fit = self.descend(hypothesis, changed, iterations, goal, None)?;
        for _ in 0..RUGGED_ROUNDS {
            let left = (fit.cost_in(self, changed) - self.noise_cost(changed)).max(0.0);
            if fit.cost(self) - MOST_FOUND_BESIDE * left > goal {
                break;
            }
            let Some(better) = self.beside(&fit, changed) else { break };
            fit = self.descend(better, changed, iterations, goal, None)?;
        }
        Some(fit)
    }

    /// Fits the parameters that matter after something changed in some channels, by Levenberg-Marquardt steps from the
    /// hypothesis' values; those of channels that no parameter ties to the changed ones stay where an earlier fit left
    /// them.
    pub(crate) fn refit(&self, hypothesis: Hypothesis, changed: Channels, iterations: usize) -> Option<Fit> {
        self.descend(hypothesis, changed, iterations, f64::INFINITY, None)
    }

    /// The first steps of a fit from the neighbourhood of another, with that one's slopes wherever there are any.
    pub(crate) fn begin(
        &self,
        hypothesis: Hypothesis,
        changed: Channels,
        iterations: usize,
        slopes: &Slopes,
    ) -> Option<Fit> {
        self.descend(hypothesis, changed, iterations, f64::INFINITY, Some(slopes))
    }

    fn descend(
        &self,
        mut hypothesis: Hypothesis,
        changed: Channels,
        iterations: usize,
        goal: f64,
        slopes: Option<&Slopes>,
    ) -> Option<Fit> {
        let mut values = hypothesis.values.clone();
        let mut residuals = self.evaluate(&hypothesis, &values, self.judgeable)?;
        let reached = reached(&hypothesis.parameters, changed);
        let free = |p: &Parameter| p.channels & reached != 0;
        let mut cost = self.total(&residuals, &hypothesis, &values);
        // Priors are many decades weaker than data where the two do not compete; damping must stay below both.
        let mut damping = 1.0e-7;
        let known: Vec<Option<&Residuals>> =
            hypothesis.parameters.iter().map(|p| slopes.and_then(|s| s.by(p.slot))).collect();
        let mut columns: Vec<Residuals> = known.iter().map(|known| known.cloned().unwrap_or_default()).collect();
        // After a small step the columns of nominal values serve once more. Only a step with all columns new ends a fit.
        let mut all_new = true;
        let mut hopeless = 0;
        let noise = self.noise_cost(self.judgeable);
        'iterations: for _ in 0..iterations {
            if hypothesis.parameters.is_empty() {
                break;
            }
            columns.par_iter_mut().enumerate().for_each(|(index, column)| {
                let parameter = &hypothesis.parameters[index];
                if known[index].is_none() && free(parameter) && (all_new || parameter.tolerance.is_none()) {
                    *column = self.column(&hypothesis, &values, &residuals, index, &SEARCH_STEP);
                }
            });
            let references: Vec<&Residuals> = columns.iter().collect();
            let (matrix, gradient) = self.normal(&hypothesis, &values, &residuals, &references, None);
            for _ in 0..7 {
                let mut held = held_at_bounds(&hypothesis.parameters, &values, &gradient);
                held.extend((0..values.len()).filter(|i| !free(&hypothesis.parameters[*i])));
                let Some(step) = solve(&matrix, &gradient, &held, damping) else { break };
                let trial = limited(&hypothesis.parameters, &values, &step);
                let attempt = |trial: &[f64]| {
                    let mut new = self.evaluate(&hypothesis, trial, reached)?;
                    for (new, old) in new.channels.iter_mut().zip(&residuals.channels) {
                        if new.is_empty() {
                            new.clone_from(old);
                        }
                    }
                    let cost = self.total(&new, &hypothesis, trial);
                    Some((new, cost))
                };
                if let Some((mut new_residuals, mut new_cost)) = attempt(&trial)
                    && new_cost < cost
                {
                    let mut trial = trial;
                    let mut longer = step.clone();
                    // Where errors are large, the robust loss makes steps too short.
                    while new_cost > FAR_FROM_NOISE * noise {
                        longer *= 2.0;
                        let farther = limited(&hypothesis.parameters, &values, &longer);
                        match attempt(&farther) {
                            Some((residuals, cost)) if cost < new_cost => {
                                (trial, new_residuals, new_cost) = (farther, residuals, cost);
                            }
                            _ => break,
                        }
                    }
                    let gained = cost - new_cost;
                    (values, residuals, cost) = (trial, new_residuals, new_cost);
                    damping = (damping * 0.1).max(1.0e-13);
                    hopeless = if gained < HOPELESS * (cost - goal) { hopeless + 1 } else { 0 };
                    if hopeless >= HOPELESS_STEPS {
                        break 'iterations;
                    }
                    let enough = if cost > FAR_FROM_NOISE * noise { CONVERGED_FAR } else { 1.0e-6 };
                    let converged = gained < CONVERGED + enough * cost;
                    if converged && all_new {
                        break 'iterations;
                    }
                    let far = step.iter().any(|moved| moved.abs() > NEAR) || gained > SMALL_GAIN * cost;
                    all_new = converged || far || !all_new;
                    continue 'iterations;
                }
                damping = (damping * 60.0).max(1.0e-6);
            }
            if all_new {
                break;
            }
            all_new = true;
        }
        hypothesis.values = values;
        hypothesis.put_in_order();
        Some(self.finish(hypothesis, &residuals))
    }

    fn finish(&self, hypothesis: Hypothesis, residuals: &Residuals) -> Fit {
        let prior_cost = prior(&hypothesis, &hypothesis.values);
        Fit { prior_cost, channel_cost: Self::channel_cost(residuals), hypothesis, covariance: None }
    }

    /// Whether an effect of plainly visible size would change the predictions by more than it must gain to be named.
    pub(crate) fn responds(&self, fit: &Fit, effect: Effect) -> bool {
        let parameters = self.parameters(effect);
        let mut start: Vec<f64> = parameters.iter().map(|p| p.neutral + p.scale).collect();
        match effect {
            Effect::ChokedFlow => start = vec![0.3, 1.0],
            Effect::SupplyDroop => start[1] = 0.1,
            Effect::FrictionPosition => start = vec![parameters[0].scale, 0.0, 0.0],
            _ => {}
        }
        if fit.hypothesis.effects.contains(&effect) {
            return true;
        }
        let channels = parameters.iter().fold(0, |all, p| all | p.channels);
        let extended = fit.hypothesis.beside(effect, parameters, &start);
        let base = self.evaluate(&fit.hypothesis, &fit.hypothesis.values, channels);
        let moved = self.evaluate(&extended, &extended.values, channels);
        let (Some(base), Some(moved)) = (base, moved) else { return false };
        let pairs = base.channels.iter().zip(&moved.channels).zip(self.dispersion);
        let change: f64 = pairs.map(|((a, b), d)| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / d).sum();
        0.5 * change > RESPONDS
    }

    /// Innovations at a fit, for diagnostics and pictures.
    pub(crate) fn innovations(&self, fit: &Fit) -> Option<Innovations> {
        let values = &fit.hypothesis.values;
        let plant = fit.hypothesis.plant(self.rig, values)?;
        let added = terms::sum(self.terms, fit.hypothesis.factors(values));
        Some(balance::innovations(self.record, self.signals, &plant, &added, &self.stretches, self.judgeable))
    }

    /// The channels' dispersion at a fit: variance of bundled innovations including their correlation over a block.
    pub(crate) fn dispersion_at(&self, fit: &Fit) -> [f64; 4] {
        let mut out = [1.0; 4];
        let Some(innovations) = self.innovations(fit) else { return out };
        for channel in Channel::ALL {
            out[channel as usize] = dispersion(&innovations.channels[channel as usize]);
        }
        out
    }
}

/// Long-run variance of innovations that should be white with unit variance: that of means over some 50 samples,
/// robustly; no less than 1. What is not settled is left out.
pub(crate) fn dispersion(innovations: &[f64]) -> f64 {
    const SPAN: usize = 50;
    const LEAST_SPANS: usize = 3;
    let root = (SPAN as f64).sqrt();
    let e: Vec<f64> = innovations.iter().copied().filter(|e| !e.is_nan()).collect();
    let mut sums: Vec<f64> = e.chunks_exact(SPAN).map(|chunk| (chunk.iter().sum::<f64>() / root).abs()).collect();
    if sums.len() < LEAST_SPANS {
        return 1.0;
    }
    let middle = sums.len() / 2;
    let median = *sums.select_nth_unstable_by(middle, f64::total_cmp).1;
    (median / 0.6745).powi(2).max(1.0)
}

fn prior(hypothesis: &Hypothesis, values: &[f64]) -> f64 {
    hypothesis
        .parameters
        .iter()
        .zip(values)
        .filter_map(|(p, v)| p.tolerance.map(|tolerance| 0.5 * ((v - p.neutral) / tolerance).powi(2)))
        .sum()
}

pub(crate) fn regularised(matrix: &DMatrix<f64>, relative: f64) -> DMatrix<f64> {
    let mut out = matrix.clone();
    let largest = (0..out.nrows()).map(|i| out[(i, i)]).fold(0.0, f64::max);
    for i in 0..out.nrows() {
        out[(i, i)] += relative * largest.max(1.0e-30);
    }
    out
}

/// The channels that a change in some of them reaches through parameters that act on several.
fn reached(parameters: &[Parameter], changed: Channels) -> Channels {
    let mut out = changed;
    loop {
        let more = parameters.iter().filter(|p| p.channels & out != 0).fold(out, |all, p| all | p.channels);
        if more == out {
            return out;
        }
        out = more;
    }
}

/// Parameters at a bound beyond which the cost would fall.
fn held_at_bounds(parameters: &[Parameter], values: &[f64], gradient: &DVector<f64>) -> Vec<usize> {
    let at_bound = |i: usize| {
        let (p, value) = (&parameters[i], values[i]);
        (value <= p.min && gradient[i] > 0.0) || (value >= p.max && gradient[i] < 0.0)
    };
    (0..values.len()).filter(|i| at_bound(*i)).collect()
}

/// A damped Gauss-Newton step that leaves the parameters in `held` where they are.
fn solve(matrix: &DMatrix<f64>, gradient: &DVector<f64>, held: &[usize], damping: f64) -> Option<DVector<f64>> {
    let (mut damped, mut gradient) = (matrix.clone(), gradient.clone());
    for &i in held {
        damped.row_mut(i).fill(0.0);
        damped.column_mut(i).fill(0.0);
        damped[(i, i)] = 1.0;
        gradient[i] = 0.0;
    }
    for i in 0..damped.nrows() {
        damped[(i, i)] += damping * matrix[(i, i)] + 1.0e-10;
    }
    damped.cholesky().map(|c| -c.solve(&gradient))
}

/// The values after a step given in scales, kept within bounds. What is positive by nature moves by factors: where lengths,
/// volumes, flows and masses can all change in step, that way is straight.
fn limited(parameters: &[Parameter], values: &[f64], step: &DVector<f64>) -> Vec<f64> {
    let moved = |(i, (p, v)): (usize, (&Parameter, &f64))| {
        let by = step[i].clamp(-8.0, 8.0) * p.scale;
        let new = if p.neutral > 0.0 && *v > 0.0 { v * (by / v).exp() } else { v + by };
        new.clamp(p.min, p.max)
    };
    parameters.iter().zip(values).enumerate().map(moved).collect()
}
