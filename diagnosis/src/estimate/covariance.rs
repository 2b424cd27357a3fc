//! Standard errors of fitted parameters.

use super::between_rows::LATEST;
use super::derivatives::{Jacobian, regularised};
use super::likelihood::weight;
use super::problem::{Fit, Problem};
use crate::constants;
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use nalgebra::{DMatrix, DVector};
use plant_model::{Effect, Side};

const STATIC_FRICTION: &str = "friction.static_n";

impl Problem<'_> {
    /// Adds the parameters' covariance to a fit, by the sandwich estimator (White 1980) with correlated errors.
    pub(crate) fn with_errors(&self, mut fit: Fit) -> Fit {
        let hypothesis = &fit.hypothesis;
        let Some(slopes) = self.jacobian(&fit) else { return fit };
        let (matrix, _) = self.normal_of(&slopes, &fit);
        let errors = self.slope_errors(&slopes);
        let Jacobian { base: residuals, columns, .. } = slopes;
        let n = columns.len();
        // The middle of the sandwich: scores summed over blocks of half a second, so that correlated errors add up.
        let per_block =
            (0.5 / (self.record.quality.interval_s * self.record.averaged() as f64)).ceil().max(1.0) as usize;
        let length = residuals.channels.iter().map(Vec::len).max().unwrap_or(0);
        let mut meat = DMatrix::<f64>::zeros(n, n);
        for block in 0..length.div_ceil(per_block) {
            let mut score = DVector::<f64>::zeros(n);
            for channel in 0..4 {
                let e = &residuals.channels[channel];
                let range = block * per_block..((block + 1) * per_block).min(e.len());
                for (i, column) in columns.iter().enumerate() {
                    let a = &column.channels[channel];
                    if a.is_empty() || range.start >= range.end {
                        continue;
                    }
                    let sum: f64 = range.clone().map(|k| a[k] * weight(e[k]) * e[k]).sum();
                    score[i] += sum / self.dispersion[channel];
                }
            }
            meat += &score * score.transpose();
        }
        let known = hypothesis.parameters.iter().map(Parameter::told_by_tolerance);
        let prior = DMatrix::from_diagonal(&DVector::from_iterator(n, known));
        let told = self.told(&fit);
        let data = &told * (matrix - &prior) * &told;
        let across = told * self.measured_curvature(&fit, (&data, &errors), &prior);
        let [matrix, meat] = [data, meat].map(|of| across.transpose() * of * &across + &prior);
        if let Some(inverse) = regularised(&matrix, 1.0e-15).try_inverse() {
            let mut covariance = &inverse * meat * &inverse;
            for i in 0..n {
                // Never below what white noise alone would give.
                covariance[(i, i)] = covariance[(i, i)].max(inverse[(i, i)]);
            }
            for i in 0..n {
                if hypothesis.parameters[i].tolerance.is_none() {
                    covariance[(i, i)] += constants::numerical_scale() * constants::numerical_scale();
                }
                if hypothesis.parameters[i].is_value_of(STATIC_FRICTION) {
                    let error_n = self.breakaway_error_n(hypothesis);
                    covariance[(i, i)] += (error_n / hypothesis.parameters[i].scale).powi(2);
                }
                if let Slot::Effect(Effect::LineDelay, 0) = hypothesis.parameters[i].slot {
                    covariance[(i, i)] += (self.staircase_error_s() / hypothesis.parameters[i].scale).powi(2);
                }
                if let Some(width) = self.width(&fit, i) {
                    covariance[(i, i)] = covariance[(i, i)].max((width / hypothesis.parameters[i].scale).powi(2));
                }
            }
            for i in 0..n {
                for j in 0..n {
                    covariance[(i, j)] *= hypothesis.parameters[i].scale * hypothesis.parameters[j].scale;
                }
            }
            fit.covariance = Some(covariance);
        }
        fit
    }

    /// Standard error of a delay of the command where the command moved between rows, s: by how much its staircase comes after the line
    /// through the rows is then chosen among values from none to [`LATEST`], taken as equally likely.
    fn staircase_error_s(&self) -> f64 {
        if self.record.command_moved() { LATEST * self.record.quality.interval_s / 12.0_f64.sqrt() } else { 0.0 }
    }

    /// Standard error of the force at which a piston breaks away, N. It is read off pressures with noise, and they reach the static
    /// friction first where their noise is highest: the same error at each breakaway, which no number of them averages out.
    fn breakaway_error_n(&self, hypothesis: &Hypothesis) -> f64 {
        let Some(plant) = hypothesis.plant(self.rig, &hypothesis.values) else { return 0.0 };
        let of = |side| plant.area_m2(side) * self.record.smoothed_pressure_error_pa(side);
        of(Side::A).hypot(of(Side::B))
    }
}
