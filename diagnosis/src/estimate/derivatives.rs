//! Derivatives of the residuals by the parameters, and the normal matrix they make.

use super::compensation::{Companion, moved, separated};
use super::likelihood::{Residuals, weight};
use super::problem::{Fit, Problem};
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::Slot;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// The channels whose predictions are smooth in all parameters: those of the air.
pub(super) const SMOOTH: Channels = !Channel::Position.bit();

/// Normal matrix and gradient.
pub(crate) type Normal = (DMatrix<f64>, DVector<f64>);

/// A fit's residuals with their derivatives by its parameters, in the parameters' order.
pub(crate) struct Jacobian {
    pub(crate) base: Residuals,
    pub(crate) columns: Vec<Residuals>,
    slots: Vec<Slot>,
}

impl Jacobian {
    /// The derivatives by one parameter.
    pub(crate) fn by(&self, slot: Slot) -> Option<&Residuals> {
        self.slots.iter().position(|other| *other == slot).map(|place| &self.columns[place])
    }
}

impl Problem<'_> {
    /// Residual derivatives of one parameter by a one-sided difference, over the channels it acts on. The force balance is not
    /// smooth and needs large steps. The balances of the air are smooth; where parameters nearly compensate each other, only
    /// small steps are accurate enough.
    pub(crate) fn jacobian_column(
        &self,
        hypothesis: &Hypothesis,
        values: &[f64],
        base: &Residuals,
        index: usize,
    ) -> Residuals {
        let mut out = Residuals::default();
        self.difference_quotient(
            hypothesis,
            (values, base),
            (index, &[]),
            hypothesis.parameters[index].channels,
            &mut out,
        );
        out
    }

    /// The derivatives by the parameters of a hypothesis, in those channels on which each is `wanted`; all else in `columns` stays as it
    /// is. Parameters that raise a level are moved with their [companions](super::compensation).
    pub(crate) fn derivatives(
        &self,
        hypothesis: &Hypothesis,
        at: (&[f64], &Residuals),
        wanted: impl Fn(usize) -> Channels + Sync,
        columns: &mut [Residuals],
    ) {
        let companions = self.companions(hypothesis);
        let wanted = |index: usize| wanted(index) & hypothesis.parameters[index].channels;
        let through_opening = self.through_opening(hypothesis, at.0, |index| wanted(index) != 0);
        let by_opening = || self.by_opening(hypothesis, at.0, &through_opening);
        let others = |index: usize| wanted(index) != 0 && !through_opening.iter().any(|moved| moved.index == index);
        let differences = || {
            columns.par_iter_mut().enumerate().filter(|(index, _)| others(*index)).for_each(|(index, column)| {
                self.difference_quotient(hypothesis, at, (index, &companions[index]), wanted(index), column);
            });
        };
        let (by_opening, ()) = rayon::join(by_opening, differences);
        for (moved, column) in through_opening.iter().zip(by_opening) {
            columns[moved.index] = column;
        }
        for index in (0..columns.len()).filter(|index| wanted(*index) & Channel::Position.bit() != 0) {
            separated(hypothesis, columns, (index, &companions[index]));
        }
    }

    /// The change of the residuals in some channels per scale of a parameter that is moved with its companions.
    fn difference_quotient(
        &self,
        hypothesis: &Hypothesis,
        (values, base): (&[f64], &Residuals),
        (index, companions): (usize, &[Companion]),
        wanted: Channels,
        out: &mut Residuals,
    ) {
        let parameter = &hypothesis.parameters[index];
        for (channels, relative) in [(!SMOOTH, constants::step_rough()), (SMOOTH, constants::step_smooth())] {
            let wanted = wanted & channels;
            if wanted == 0 {
                continue;
            }
            let mut step = hypothesis.step(values, index, relative);
            let after =
                |step: f64| self.evaluate(hypothesis, &moved(hypothesis, values, (index, step), companions), wanted);
            let residuals = after(step).or_else(|| {
                step = -step;
                after(step)
            });
            for channel in Channel::ALL.into_iter().filter(|channel| wanted & channel.bit() != 0) {
                let Some(new) = &residuals else {
                    out.channels[channel as usize] = Vec::new();
                    continue;
                };
                let quotient = |a: &f64, b: &f64| (a - b) / step * parameter.scale;
                let at = channel as usize;
                out.channels[at] =
                    new.channels[at].iter().zip(&base.channels[at]).map(|(a, b)| quotient(a, b)).collect();
                out.log_widths[at] = quotient(&new.log_widths[at], &base.log_widths[at]);
            }
        }
    }

    /// The Jacobian at a fit; `None` if its values contradict each other.
    pub(crate) fn jacobian(&self, fit: &Fit) -> Option<Jacobian> {
        let h = &fit.hypothesis;
        let base = self.evaluate(h, &h.values, self.judgeable)?;
        let mut columns = vec![Residuals::default(); h.values.len()];
        self.derivatives(h, (&h.values, &base), |_| self.judgeable, &mut columns);
        Some(Jacobian { base, columns, slots: h.parameters.iter().map(|p| p.slot).collect() })
    }

    /// Normal matrix and gradient at a fit, from its Jacobian.
    pub(crate) fn normal_of(&self, slopes: &Jacobian, fit: &Fit) -> Normal {
        let columns: Vec<&Residuals> = slopes.columns.iter().collect();
        self.normal(&fit.hypothesis, &fit.hypothesis.values, &slopes.base, &columns, None)
    }

    /// Normal matrix and gradient in units of the parameters' scales. `known` is what was computed before for the first
    /// columns.
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
                gradient[i] += columns[i].log_widths[channel] * factor;
                let acting: Vec<usize> = (0..=i).filter(|j| !columns[*j].channels[channel].is_empty()).collect();
                for side_by_side in acting.chunks(SIDE_BY_SIDE) {
                    // Where there are fewer, the first one fills up.
                    let b = core::array::from_fn(|k| {
                        let j = side_by_side.get(k).unwrap_or(&side_by_side[0]);
                        &columns[*j].channels[channel][..]
                    });
                    side_by_side.iter().zip(products(&weighted, b)).for_each(|(j, sum)| matrix[(i, *j)] += sum);
                }
            }
        }
        for i in first..n {
            let p = &hypothesis.parameters[i];
            matrix[(i, i)] += p.told_by_tolerance();
            gradient[i] += p.told_by_tolerance() * (values[i] - p.neutral) / p.scale;
            for j in 0..i {
                matrix[(j, i)] = matrix[(i, j)];
            }
        }
        (matrix, gradient)
    }
}

/// So many sums at once: one alone waits for each of its additions.
const SIDE_BY_SIDE: usize = 4;

/// The scalar products of a column with others, each summed in its own order.
fn products(column: &[f64], [a, b, c, d]: [&[f64]; SIDE_BY_SIDE]) -> [f64; SIDE_BY_SIDE] {
    let mut sums = [0.0; SIDE_BY_SIDE];
    for ((((value, a), b), c), d) in column.iter().zip(a).zip(b).zip(c).zip(d) {
        sums[0] += value * a;
        sums[1] += value * b;
        sums[2] += value * c;
        sums[3] += value * d;
    }
    sums
}

pub(crate) fn regularised(matrix: &DMatrix<f64>, relative: f64) -> DMatrix<f64> {
    let mut out = matrix.clone();
    let largest = (0..out.nrows()).map(|i| out[(i, i)]).fold(0.0, f64::max);
    for i in 0..out.nrows() {
        out[(i, i)] += relative * largest.max(1.0e-30);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scalar_products_side_by_side_are_those_one_by_one() {
        let column: Vec<f64> = (0..101).map(|k| (0.3 * f64::from(k)).sin()).collect();
        let others: Vec<Vec<f64>> =
            (0..SIDE_BY_SIDE).map(|j| column.iter().map(|x| (x + j as f64).cos()).collect()).collect();
        let sums = products(&column, core::array::from_fn(|j| &others[j][..]));
        for (other, sum) in others.iter().zip(sums) {
            assert_eq!(sum, column.iter().zip(other).map(|(a, b)| a * b).sum::<f64>());
        }
    }
}
