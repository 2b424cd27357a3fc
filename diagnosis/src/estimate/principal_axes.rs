//! The directions in which the data say least: their curvature measured, and the cost brought down along them.
//!
//! There the derivatives by single parameters nearly cancel. What a difference quotient leaves of each, by curvature and by
//! breakaways that move to another moment, does not cancel and passes for information: a fit stops half-way along a valley, with
//! standard errors far too small. So the cost itself is looked at, along the eigenvectors of the normal matrix (the principal axes
//! of Brent 1973) with steps as long as their standard deviations, and along the directions that no log shows at all, such as that
//! of similarity ([`plant_model::similarity`]).

use super::derivatives::Jacobian;
use super::likelihood::{Residuals, weight};
use super::optimiser::limited;
use super::problem::{Fit, Problem};
use crate::constants;
use crate::data::channel::Channel;
use crate::model::hypothesis::Hypothesis;
use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

/// A cost that rises along a direction by no more than this, over what tolerances make of it, is not told by the log. Parabolas through
/// factors are off by hundredths.
const UNTOLD: f64 = 1.2;

/// The curvature of an axis is looked at where errors of derivatives may add this part to it, or more: a standard error is then 5 % off. Of
/// 351 axes (25 logs) none of the 161 where they add less had a curvature below 0.8 of that of the derivatives, of the 190 others 26.
const DOUBTFUL: f64 = 0.1;

/// A direction in parameters' scales, of length one, and the step along it at which the cost is looked at.
struct Axis {
    direction: DVector<f64>,
    step: f64,
}

/// The parabola through three costs along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Parabola {
    slope: f64,
    curvature: f64,
}

impl Parabola {
    fn through([below, middle, above]: [f64; 3], step: f64) -> Self {
        Self { slope: (above - below) / (2.0 * step), curvature: (above - 2.0 * middle + below) / (step * step) }
    }

    /// The same through the costs here, at one step and at two; a step back is negative.
    fn one_sided([here, near, far]: [f64; 3], step: f64) -> Self {
        Self {
            slope: (4.0 * near - 3.0 * here - far) / (2.0 * step),
            curvature: (here - 2.0 * near + far) / (step * step),
        }
    }

    /// Where the cost is least, as far as the parabola can be trusted; downhill where it has no minimum.
    fn minimum(self, step: f64) -> f64 {
        let farthest = constants::axis_reach() * step;
        let least = -self.slope / self.curvature;
        if self.curvature > 0.0 && least.is_finite() {
            least.clamp(-farthest, farthest)
        } else {
            -self.slope.signum() * farthest
        }
    }
}

impl Problem<'_> {
    /// A fit brought down along its principal axes until that gains no more.
    pub(crate) fn down_its_valleys(&self, mut fit: Fit) -> Fit {
        for _ in 0..constants::iterations() {
            let begun = fit.cost(self);
            let Some((matrix, errors)) = self.curvature_at(&fit) else { break };
            for axis in axes(&fit.hypothesis, &matrix, &errors).iter().rev() {
                fit = self.down_along(fit, axis);
            }
            if begun - fit.cost(self) < constants::same_cost() {
                break;
            }
            if let Some(again) = self.refit(fit.hypothesis.clone(), self.judgeable, constants::iterations())
                && again.cost(self) < fit.cost(self)
            {
                fit = again;
            }
        }
        fit
    }

    /// The normal matrix at a fit, and the [errors](Self::slope_errors) of its derivatives.
    fn curvature_at(&self, fit: &Fit) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let slopes = self.jacobian(fit)?;
        Some((self.normal_of(&slopes, fit).0, self.slope_errors(&slopes)))
    }

    /// For each parameter the square of what the errors of its derivatives may add to the residuals, per scale: all of what it does to
    /// predictions of the position, where breakaways move to another moment, and a step's part of what it does to the air.
    pub(super) fn slope_errors(&self, slopes: &Jacobian) -> DVector<f64> {
        let square = |column: &Residuals, channel: Channel| {
            let pairs = column.channels[channel as usize].iter().zip(&slopes.base.channels[channel as usize]);
            let sum: f64 = pairs.map(|(slope, e)| slope * slope * weight(*e)).sum();
            let part = if channel == Channel::Position { 1.0 } else { constants::step_smooth() };
            part * part * sum / self.dispersion[channel as usize]
        };
        let squares =
            slopes.columns.iter().map(|column| Channel::ALL.map(|channel| square(column, channel)).iter().sum());
        DVector::from_iterator(slopes.columns.len(), squares)
    }

    /// The fit at the least cost along an axis, or the same.
    fn down_along(&self, fit: Fit, axis: &Axis) -> Fit {
        let Some((parabola, step)) = self.parabola(&fit, axis).or_else(|| self.half_parabola(&fit, axis)) else {
            return fit;
        };
        let trial = moved(&fit.hypothesis, &axis.direction, parabola.minimum(step));
        self.evaluate_as_is(trial).filter(|trial| trial.cost(self) < fit.cost(self)).unwrap_or(fit)
    }

    /// The cost along an axis, and the step it was looked at with: as far as the bounds allow on both sides.
    fn parabola(&self, fit: &Fit, axis: &Axis) -> Option<(Parabola, f64)> {
        let h = &fit.hypothesis;
        let room = |k: usize| {
            let (p, value) = (&h.parameters[k], h.values[k]);
            let by = axis.direction[k].abs() * p.scale;
            if by == 0.0 { f64::INFINITY } else { (p.max - value).min(value - p.min) / by }
        };
        let step = (0..h.values.len()).map(room).fold(axis.step, f64::min);
        if step < constants::step_smooth() {
            return None;
        }
        let cost = |step: f64| Some(self.evaluate_as_is(moved(h, &axis.direction, step))?.cost(self));
        let (below, above) = rayon::join(|| cost(-step), || cost(step));
        Some((Parabola::through([below?, fit.cost(self), above?], step), step))
    }

    /// The same where a parameter stands at its bound: the cost at three places along the axis on the side that is free.
    fn half_parabola(&self, fit: &Fit, axis: &Axis) -> Option<(Parabola, f64)> {
        let h = &fit.hypothesis;
        let room = |side: f64| {
            let to_bound = |k: usize| {
                let (p, by) = (&h.parameters[k], side * axis.direction[k] * h.parameters[k].scale);
                let bound = if by > 0.0 { p.max } else { p.min };
                if by == 0.0 { f64::INFINITY } else { (bound - h.values[k]) / by }
            };
            (0..h.values.len()).map(to_bound).fold(2.0 * axis.step, f64::min)
        };
        let side = if room(1.0) > room(-1.0) { 1.0 } else { -1.0 };
        let step = 0.5 * room(side);
        if step < constants::step_smooth() {
            return None;
        }
        let cost = |step: f64| Some(self.evaluate_as_is(moved(h, &axis.direction, side * step))?.cost(self));
        let (near, far) = rayon::join(|| cost(step), || cost(2.0 * step));
        Some((Parabola::one_sided([fit.cost(self), near?, far?], side * step), step))
    }

    /// The curvature of the cost along an axis. Between breakaways that move to another moment it can be negative; then longer steps
    /// tell. `None` if they do not.
    fn curvature_along(&self, fit: &Fit, axis: &Axis) -> Option<f64> {
        let longer = std::iter::successors(Some(axis.step), |step| Some(2.0 * step));
        let steps = longer.take_while(|step| *step <= constants::axis_reach() * axis.step);
        let at = |step: f64| Some(self.parabola(fit, &Axis { direction: axis.direction.clone(), step })?.0.curvature);
        steps.filter_map(at).find(|curvature| *curvature > 0.0)
    }

    /// The projection of the parameters away from the directions that no log shows. Difference quotients that nearly cancel there
    /// tell nothing, whatever their sum. A direction along which the cost rises by more than tolerances make it does show: so it is
    /// where something that belongs to it is not free.
    pub(super) fn told(&self, fit: &Fit) -> DMatrix<f64> {
        let n = fit.hypothesis.values.len();
        let mut projection = DMatrix::<f64>::identity(n, n);
        for axis in untold(&fit.hypothesis) {
            let known = axis.step.powi(-2);
            let shows = self.curvature_along(fit, &axis).is_none_or(|curvature| curvature >= UNTOLD * known);
            if !shows && let Some(across) = (&projection * axis.direction).try_normalize(f64::EPSILON.sqrt()) {
                projection -= &across * across.transpose();
            }
        }
        projection
    }

    /// A transformation `T` of the parameters after which the normal matrix `H` of the data, as `T' H T`, has the curvature of the
    /// data's cost along the flat axes of a fit. The normal matrix of the tolerances (`prior`) is known as it is.
    pub(super) fn measured_curvature(
        &self,
        fit: &Fit,
        (data, errors): (&DMatrix<f64>, &DVector<f64>),
        prior: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        let axes = axes(&fit.hypothesis, &(data + prior), errors);
        let measured: Vec<Option<f64>> = axes.par_iter().map(|axis| self.curvature_along(fit, axis)).collect();
        let n = data.nrows();
        let mut transformation = DMatrix::identity(n, n);
        for (axis, curvature) in axes.iter().zip(measured) {
            let Some(curvature) = curvature else { continue };
            let d = &axis.direction;
            let of_data = (curvature - d.dot(&(prior * d))).max(0.0);
            let stated = (&transformation * d).dot(&(data * (&transformation * d)));
            // Errors of the derivatives make a valley too narrow, never too wide.
            if of_data < stated {
                transformation += (&transformation * d) * d.transpose() * ((of_data / stated).sqrt() - 1.0);
            }
        }
        transformation
    }
}

/// A hypothesis moved along a direction.
fn moved(hypothesis: &Hypothesis, direction: &DVector<f64>, step: f64) -> Hypothesis {
    let mut out = hypothesis.clone();
    out.values = limited(&hypothesis.parameters, &hypothesis.values, &(direction * step));
    out.put_in_order();
    out
}

/// The flat axes of a normal matrix, the flattest last: those along which a standard deviation is more than the step of a difference
/// quotient, and derivatives cancel so nearly that their [errors](Problem::slope_errors) count. What is at a bound stays there.
fn axes(hypothesis: &Hypothesis, matrix: &DMatrix<f64>, errors: &DVector<f64>) -> Vec<Axis> {
    // Neither has eigenvectors.
    if matrix.is_empty() || matrix.iter().any(|entry| !entry.is_finite()) {
        return Vec::new();
    }
    let mut matrix = matrix.clone();
    let largest = matrix.diagonal().max();
    let pairs = hypothesis.parameters.iter().zip(&hypothesis.values).enumerate();
    let held: Vec<usize> = pairs.filter(|(_, (p, value))| p.is_at_bound(**value)).map(|(k, _)| k).collect();
    for &k in &held {
        matrix.row_mut(k).fill(0.0);
        matrix.column_mut(k).fill(0.0);
        matrix[(k, k)] = largest;
    }
    // Each eigenvalue takes a few steps of the QR algorithm; a matrix that takes more has entries that mean nothing.
    let steps = 30 * matrix.nrows();
    let Some(eigen) = SymmetricEigen::try_new(matrix, f64::EPSILON, steps) else { return Vec::new() };
    let pairs = eigen.eigenvectors.column_iter().zip(&eigen.eigenvalues);
    let axis = |(direction, curvature): (nalgebra::DVectorView<'_, f64>, &f64)| {
        let mut direction = direction.into_owned();
        // Else rounding errors of a direction would move it.
        held.iter().for_each(|k| direction[*k] = 0.0);
        let doubtful = direction.component_mul(&direction).dot(errors) > DOUBTFUL * curvature;
        // A parameter moves by a scale at most.
        let step = 1.0 / curvature.max(1.0).sqrt();
        (doubtful && step > constants::step_smooth()).then_some(Axis { direction, step })
    };
    let mut axes: Vec<Axis> = pairs.filter_map(axis).collect();
    axes.sort_by(|a, b| a.step.total_cmp(&b.step));
    axes.extend(untold(hypothesis));
    axes
}

/// The directions that no log shows, with steps of a standard deviation: what is known of the nominal values is all that is known
/// along them.
fn untold(hypothesis: &Hypothesis) -> Vec<Axis> {
    let axis = |along: DVector<f64>| {
        let direction = along.normalize();
        let pairs = hypothesis.parameters.iter().zip(&direction);
        let curvature: f64 = pairs.map(|(parameter, d)| d * d * parameter.told_by_tolerance()).sum();
        (curvature > 0.0).then(|| Axis { direction, step: 1.0 / curvature.sqrt() })
    };
    hypothesis.directions_without_trace().into_iter().filter_map(axis).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::{add_noise, simulated, stick_slip_v};
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::nominal::nominal_parameters;
    use plant_model::{Effect, Effects};
    use rig_files::RigFile;

    /// A rig of which the area, and what of its bristles goes with it, is known to 2 %.
    fn open_rig() -> RigFile {
        let mut rig = RigFile::paper_a();
        for path in
            ["cylinder.area_m2", "friction.stiffness_n_per_m", "friction.damping_n_s_per_m", "friction.breakaway_m"]
        {
            assert!(rig.tolerance.set(path, 0.02));
        }
        rig
    }

    #[test]
    fn neither_a_common_size_nor_a_scale_of_the_position_in_step_leaves_a_trace() {
        let rig = open_rig();
        let mut log = simulated(&rig, &Effects::none(), 12_000, stick_slip_v);
        add_noise(&mut log, 5.0e-6, 200.0);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let scale = Effect::PositionScale;
        let h = Hypothesis::null(&nominal).extended_by(scale, problem.parameters(scale), &[1.0]);
        let cost = |h: &Hypothesis| problem.cost_of(h, &h.values, judgeable).expect("a sound rig");
        let directions = h.directions_without_trace();
        assert_eq!(directions.len(), 2);
        for direction in &directions {
            let changed = (cost(&moved(&h, direction, 0.07)) / cost(&h) - 1.0).abs();
            assert!(changed < 1e-9, "{changed}");
            // A part of what belongs together shows.
            let mut part = direction.clone();
            part.iter_mut()
                .zip(&h.parameters)
                .filter(|(_, p)| p.slot.stated_key() == Some("load.mass_kg"))
                .for_each(|(d, _)| *d = 0.0);
            assert!(cost(&moved(&h, &part, 0.07)) > 1.01 * cost(&h));
        }
        let fit = problem.evaluate_as_is(h).expect("a sound rig");
        let told = problem.told(&fit);
        assert!((told.trace() - (told.nrows() - 2) as f64).abs() < 1e-9, "{}", told.trace());
    }

    #[test]
    fn of_an_area_and_factors_on_it_only_the_products_leave_a_trace() {
        let mut rig = open_rig();
        rig.tolerance.default = 0.02;
        let log = simulated(&rig, &Effects::none(), 4000, stick_slip_v);
        let record = prepare(&log, &rig);
        let judgeable = judgeable(&record);
        let nominal = nominal_parameters(&rig, judgeable, false, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable, &nominal, (&signals, &effort));
        let area = Effect::PistonArea;
        let h = Hypothesis::null(&nominal).extended_by(area, problem.parameters(area), &[1.05, 0.97]);
        let cost = |h: &Hypothesis| {
            let fit = problem.evaluate_as_is(h.clone()).expect("a sound rig");
            fit.cost_in(&problem, judgeable)
        };
        // Common size, and the area against both factors.
        let directions = h.directions_without_trace();
        assert_eq!(directions.len(), 2);
        for direction in &directions {
            let changed = (cost(&moved(&h, direction, 1.0e-3)) / cost(&h) - 1.0).abs();
            let mut part = direction.clone();
            let first = part.iter().position(|d| *d != 0.0).expect("something moves");
            part[first] = 0.0;
            let shown = (cost(&moved(&h, &part, 1.0e-3)) / cost(&h) - 1.0).abs();
            assert!(changed < 0.05 * shown, "{changed} {shown}");
        }
    }

    #[test]
    fn a_parabola_leads_to_its_minimum_or_as_far_downhill_as_it_is_trusted() {
        let reach = constants::axis_reach();
        // Costs (x - 0.3)^2, 2 x^2 + 1, a slope, a summit, a minimum out of reach.
        for (cost, expected) in [
            ((|x| (x - 0.3) * (x - 0.3)) as fn(f64) -> f64, 0.3),
            (|x| 2.0 * x * x + 1.0, 0.0),
            (|x| 3.0 * x, -0.5 * reach),
            (|x| -x * x - 0.1 * x, 0.5 * reach),
            (|x| (x - 100.0) * (x - 100.0), 0.5 * reach),
        ] {
            let found = Parabola::through([cost(-0.5), cost(0.0), cost(0.5)], 0.5).minimum(0.5);
            assert!((found - expected).abs() < 1e-9, "{found} instead of {expected}");
            for step in [0.5, -0.5] {
                let one_sided = Parabola::one_sided([cost(0.0), cost(step), cost(2.0 * step)], step).minimum(0.5);
                assert!((one_sided - expected).abs() < 1e-9, "{one_sided} instead of {expected}");
            }
        }
    }
}
