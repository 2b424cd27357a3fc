//! The maximum a posteriori estimate: Levenberg-Marquardt steps on the robust loss, with tolerances as priors.

use super::derivatives::{Jacobian, SMOOTH};
use super::likelihood::Residuals;
use super::problem::{Fit, Problem};
use super::secant;
use crate::constants;
use crate::data::channel::Channels;
use crate::model::hypothesis::{Hypothesis, hides};
use crate::model::parameter::Parameter;
use nalgebra::{DMatrix, DVector};

/// Where a fit has its derivatives from.
#[derive(Clone, Copy)]
enum Derivatives<'a> {
    /// Computed before each step.
    Exact,
    /// Corrected by most steps: for comparing hypotheses. Of a model that is wrong by far the last hundredths do not count.
    Corrected,
    /// Kept for the parameters that another fit has, too; computed before each step for the others.
    Known(&'a Jacobian),
}

impl<'a> Derivatives<'a> {
    fn known(self) -> Option<&'a Jacobian> {
        match self {
            Self::Known(slopes) => Some(slopes),
            Self::Exact | Self::Corrected => None,
        }
    }
}

/// How the derivatives of a fit belong to its present values.
#[derive(Clone, Copy, PartialEq)]
enum Slopes {
    /// They do not: they are computed before the next step.
    Old,
    /// Computed there.
    Exact,
    /// Corrected by the steps that led there.
    Secant,
}

impl Problem<'_> {
    /// The cost of a hypothesis at its present values, without a step.
    pub(crate) fn evaluate_as_is(&self, hypothesis: Hypothesis) -> Option<Fit> {
        self.refit(hypothesis, 0, 0)
    }

    /// Fits all parameters of a hypothesis from its values.
    pub(crate) fn fit(&self, hypothesis: Hypothesis, iterations: usize) -> Option<Fit> {
        self.fit_and_search(hypothesis, self.judgeable, iterations, f64::INFINITY)
    }

    /// [`Problem::refit`], followed by a coordinate search over the parameters with a non-smooth cost and a refit from there. The
    /// search is left out if taking away all that noise does not explain would not bring the cost below `goal`, and a fit ends
    /// early where the steps left cannot bring it there.
    pub(crate) fn fit_and_search(
        &self,
        hypothesis: Hypothesis,
        changed: Channels,
        iterations: usize,
        goal: f64,
    ) -> Option<Fit> {
        let refit =
            |from: Hypothesis| self.levenberg_marquardt(from, (changed, iterations), Derivatives::Corrected, goal);
        let fit = refit(hypothesis)?;
        let left = (fit.cost_in(self, changed) - self.noise_cost(changed)).max(0.0);
        if fit.cost(self) - left > goal {
            return Some(fit);
        }
        match self.coordinate_search(&fit, changed) {
            Some(better) => refit(better),
            None => Some(fit),
        }
    }

    /// Fits a hypothesis from its values by Levenberg-Marquardt steps, after something `changed` in some channels. Free
    /// are the parameters of these channels and of those that shared parameters connect with them; all others keep
    /// their values.
    pub(crate) fn refit(&self, hypothesis: Hypothesis, changed: Channels, iterations: usize) -> Option<Fit> {
        self.levenberg_marquardt(hypothesis, (changed, iterations), Derivatives::Exact, f64::INFINITY)
    }

    /// The first steps of a fit close to another one, whose derivatives are used for the parameters that both have.
    pub(crate) fn first_steps(
        &self,
        hypothesis: Hypothesis,
        changed: Channels,
        iterations: usize,
        slopes: &Jacobian,
    ) -> Option<Fit> {
        self.levenberg_marquardt(hypothesis, (changed, iterations), Derivatives::Known(slopes), f64::INFINITY)
    }

    fn levenberg_marquardt(
        &self,
        mut hypothesis: Hypothesis,
        (changed, iterations): (Channels, usize),
        derivatives: Derivatives<'_>,
        goal: f64,
    ) -> Option<Fit> {
        let mut values = hypothesis.values.clone();
        let mut residuals = self.evaluate(&hypothesis, &values, self.judgeable)?;
        let reached = reached(&hypothesis.parameters, changed);
        let free = |p: &Parameter| p.channels & reached != 0;
        let mut cost = self.total(&residuals, &hypothesis, &values);
        // The curvature of a prior can be many decades below that of the data; damping must stay below both.
        let mut damping = 1.0e-7;
        // Where the last effect moves what a value belongs to, another fit's derivatives by it are of another place.
        let stale = |p: &Parameter| hypothesis.effects.last().is_some_and(|effect| hides(*effect, p));
        let known_by = |p: &Parameter| derivatives.known().filter(|_| !stale(p)).and_then(|s| s.by(p.slot));
        let known: Vec<Option<&Residuals>> = hypothesis.parameters.iter().map(known_by).collect();
        let mut columns: Vec<Residuals> = known.iter().map(|known| known.cloned().unwrap_or_default()).collect();
        let mut gained_before = f64::INFINITY;
        let mut state = Slopes::Old;
        // Where smooth derivatives were computed.
        let mut smooth_at: Option<Vec<f64>> = None;
        let corrects = matches!(derivatives, Derivatives::Corrected);
        let mut left = iterations;
        'iterations: while !hypothesis.parameters.is_empty() {
            if state == Slopes::Old {
                if left == 0 {
                    break;
                }
                left -= 1;
                let near = smooth_at.as_ref().is_some_and(|before| hypothesis.is_near(&values, before, SMOOTH));
                if !near {
                    smooth_at = Some(values.clone());
                }
                let channels = if near { !SMOOTH } else { self.judgeable };
                let wanted = |index: usize| match known[index].is_none() && free(&hypothesis.parameters[index]) {
                    true => channels,
                    false => 0,
                };
                self.derivatives(&hypothesis, (&values, &residuals), wanted, &mut columns);
                state = Slopes::Exact;
            }
            let references: Vec<&Residuals> = columns.iter().collect();
            let (matrix, gradient) = self.normal(&hypothesis, &values, &residuals, &references, None);
            // Where corrected derivatives lead uphill, exact ones are needed, not a shorter step.
            let trials = if state == Slopes::Exact { 7 } else { 2 };
            for _ in 0..trials {
                let mut held = held_at_bounds(&hypothesis.parameters, &values, &gradient);
                held.extend((0..values.len()).filter(|i| !free(&hypothesis.parameters[*i])));
                let normal = (&matrix, &gradient);
                let Some(mut trial) = within_bounds(&hypothesis.parameters, &values, normal, &held, damping) else {
                    break;
                };
                hypothesis.meet_in_order(&mut trial);
                let attempt = |trial: &[f64]| {
                    let mut new = self.evaluate(&hypothesis, trial, reached)?;
                    new.fill_in(&residuals);
                    let cost = self.total(&new, &hypothesis, trial);
                    Some((new, cost))
                };
                if let Some((new_residuals, new_cost)) = attempt(&trial)
                    && new_cost < cost
                {
                    let gained = cost - new_cost;
                    let step =
                        DVector::from_fn(values.len(), |i, _| (trial[i] - values[i]) / hypothesis.parameters[i].scale);
                    let promised = -(gradient.dot(&step) + 0.5 * step.dot(&(&matrix * &step)));
                    let old = std::mem::replace(&mut residuals, new_residuals);
                    (values, cost) = (trial, new_cost);
                    damping = (damping * 0.1).max(1.0e-13);
                    let least = self.noise_cost(self.judgeable) + self.sum_over(&residuals.log_widths, self.judgeable);
                    let little = if corrects {
                        constants::converged_of_rest() * (cost - least).max(0.0)
                    } else {
                        constants::converged_of_all() * cost
                    };
                    let converged = gained < constants::converged() + little;
                    let ends = converged || out_of_reach(cost - goal, [gained_before, gained], left);
                    if ends && state == Slopes::Exact {
                        break 'iterations;
                    }
                    gained_before = gained;
                    if ends || !corrects || gained < constants::kept_promise() * promised {
                        state = Slopes::Old;
                    } else {
                        secant::corrected(&hypothesis, &mut columns, step.as_slice(), [&old, &residuals]);
                        state = Slopes::Secant;
                    }
                    continue 'iterations;
                }
                damping = (damping * 60.0).max(1.0e-6);
            }
            if state == Slopes::Exact {
                break;
            }
            state = Slopes::Old;
        }
        hypothesis.values = values;
        hypothesis.put_in_order();
        Some(self.finish(hypothesis, &residuals))
    }
}

/// Whether the steps left cannot lower the cost by `missing`: steps of a fit gain less and less, so each is taken to gain at most
/// what the better of the last two did.
fn out_of_reach(missing: f64, last_gains: [f64; 2], left: usize) -> bool {
    last_gains[0].max(last_gains[1]) * (left as f64) < missing
}

/// The channels connected with the changed ones through parameters that act on several channels.
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

/// The values after a damped Gauss-Newton step that ends within the bounds: what would pass one goes as far as that, and the
/// step of all others is solved for again. Without that, a step cut off at a bound is none that lowers the cost, and fits of
/// many parameters zigzag between bounds.
fn within_bounds(
    parameters: &[Parameter],
    values: &[f64],
    (matrix, gradient): (&DMatrix<f64>, &DVector<f64>),
    held: &[usize],
    damping: f64,
) -> Option<Vec<f64>> {
    let (mut held, mut fixed) = (held.to_vec(), DVector::zeros(values.len()));
    loop {
        // What is fixed acts on the gradient of what is free.
        let step = solve(matrix, &(gradient + matrix * &fixed), &held, damping)? + &fixed;
        let passes = |i: &usize| {
            let (p, moved) = (&parameters[*i], moved(&parameters[*i], values[*i], step[*i]));
            !held.contains(i) && (moved < p.min || moved > p.max)
        };
        let beyond: Vec<usize> = (0..values.len()).filter(passes).collect();
        if beyond.is_empty() {
            return Some(limited(parameters, values, &step));
        }
        for i in beyond {
            let p = &parameters[i];
            let bound = if moved(p, values[i], step[i]) < p.min { p.min } else { p.max };
            fixed[i] = step_to(p, values[i], bound);
            held.push(i);
        }
    }
}

/// Whether a value moves by factors: positive quantities do, so that lengths, volumes, flows and masses that change in
/// proportion lie on a straight line.
fn by_factors(p: &Parameter, value: f64) -> bool {
    p.neutral > 0.0 && value > 0.0
}

/// A value after a step given in scales, whatever its bounds.
fn moved(p: &Parameter, value: f64, step: f64) -> f64 {
    let by = step.clamp(-8.0, 8.0) * p.scale;
    if by_factors(p, value) { value * (by / value).exp() } else { value + by }
}

/// The step in scales from a value to another.
fn step_to(p: &Parameter, value: f64, to: f64) -> f64 {
    let by = if by_factors(p, value) && to > 0.0 { value * (to / value).ln() } else { to - value };
    by / p.scale
}

/// The values after a step given in scales, kept within bounds.
pub(super) fn limited(parameters: &[Parameter], values: &[f64], step: &DVector<f64>) -> Vec<f64> {
    let all = parameters.iter().zip(values).enumerate();
    all.map(|(i, (p, v))| moved(p, *v, step[i]).clamp(p.min, p.max)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::parameter::Slot;

    fn parameter(neutral: f64, [min, max]: [f64; 2], channels: Channels) -> Parameter {
        Parameter { slot: Slot::Term(0), neutral, scale: 0.1, negligible: 0.0, tolerance: None, min, max, channels }
    }

    #[test]
    fn a_gauss_newton_step_ends_at_the_minimum_of_a_quadratic_cost() {
        // Cost (x - 3)^2 / 2 + (y + 1)^2 with x = y = 0: gradient (-3, 2), matrix diag(1, 2).
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 2.0]);
        let gradient = DVector::from_row_slice(&[-3.0, 2.0]);
        let step = solve(&matrix, &gradient, &[], 0.0).expect("positive definite");
        assert!((step[0] - 3.0).abs() < 1e-8 && (step[1] + 1.0).abs() < 1e-8, "{step}");
        // Damping shortens it, what is held stays.
        let damped = solve(&matrix, &gradient, &[1], 1.0).expect("positive definite");
        assert!((damped[0] - 1.5).abs() < 1e-8 && damped[1] == 0.0, "{damped}");
        // An indefinite matrix has no minimum.
        assert!(solve(&-matrix, &gradient, &[], 0.0).is_none());
    }

    #[test]
    fn positive_values_move_by_factors_others_by_sums_and_none_beyond_its_bounds() {
        let parameters =
            [parameter(2.0, [0.1, 10.0], 1), parameter(0.0, [-1.0, 1.0], 1), parameter(0.0, [-1.0, 0.05], 1)];
        let moved = limited(&parameters, &[2.0, 0.5, 0.0], &DVector::from_row_slice(&[-4.0, 2.0, 2.0]));
        assert!((moved[0] - 2.0 * (-0.2_f64).exp()).abs() < 1e-12, "{moved:?}");
        assert!((moved[1] - 0.7).abs() < 1e-12 && moved[2] == 0.05, "{moved:?}");
    }

    #[test]
    fn beside_a_value_that_reaches_its_bound_the_others_go_where_the_cost_is_least() {
        // Cost (d' H d) / 2 + g' d: without bounds the step is (5.8, -4.2); with the first held at 1 the second is 0.1.
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.9, 1.0]);
        let gradient = DVector::from_row_slice(&[-2.0, -1.0]);
        let parameters = [parameter(0.0, [-1.0, 0.1], 1), parameter(0.0, [-1.0, 1.0], 1)];
        let trial = within_bounds(&parameters, &[0.0, 0.0], (&matrix, &gradient), &[], 0.0).expect("positive definite");
        assert!((trial[0] - 0.1).abs() < 1e-8 && (trial[1] - 0.01).abs() < 1e-8, "{trial:?}");
        // A positive value reaches its bound by a factor.
        let parameters = [parameter(2.0, [1.0, 2.1], 1), parameter(0.0, [-1.0, 1.0], 1)];
        let trial = within_bounds(&parameters, &[2.0, 0.0], (&matrix, &gradient), &[], 0.0).expect("positive definite");
        assert!((trial[0] - 2.1).abs() < 1e-12, "{trial:?}");
    }

    #[test]
    fn a_parameter_at_a_bound_is_held_only_while_the_cost_falls_beyond_it() {
        let parameters = [parameter(0.0, [0.0, 1.0], 1), parameter(0.0, [0.0, 1.0], 1), parameter(0.0, [0.0, 1.0], 1)];
        let values = [0.0, 0.0, 1.0];
        for (gradient, held) in
            [([1.0, -1.0, -1.0], vec![0, 2]), ([-1.0, 1.0, 1.0], vec![1]), ([-1.0, -1.0, 1.0], vec![])]
        {
            assert_eq!(held_at_bounds(&parameters, &values, &DVector::from_row_slice(&gradient)), held, "{gradient:?}");
        }
    }

    #[test]
    fn a_fit_goes_on_while_its_steps_may_reach_the_goal() {
        for (missing, last_gains, left, out) in [
            (f64::NEG_INFINITY, [0.0, 0.0], 5, false),
            (100.0, [f64::INFINITY, 1.0], 19, false),
            (100.0, [30.0, 10.0], 4, false),
            (100.0, [10.0, 30.0], 3, true),
            (-1.0, [10.0, 30.0], 0, false),
        ] {
            assert_eq!(out_of_reach(missing, last_gains, left), out, "{missing} {last_gains:?} {left}");
        }
    }

    #[test]
    fn a_change_reaches_the_channels_that_a_parameter_ties_to_it() {
        let parameters =
            |channels: &[Channels]| channels.iter().map(|c| parameter(0.0, [0.0, 1.0], *c)).collect::<Vec<_>>();
        for (channels, changed, expected) in [
            (&[0b001, 0b010, 0b100][..], 0b001, 0b001),
            (&[0b011, 0b100], 0b001, 0b011),
            (&[0b011, 0b110], 0b001, 0b111),
            (&[0b011, 0b110], 0b000, 0b000),
        ] {
            assert_eq!(reached(&parameters(channels), changed), expected, "{channels:?}");
        }
    }
}
