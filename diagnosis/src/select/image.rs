//! The image of a cause: another effect that is nearly equivalent, at a value that can be computed.

use crate::estimate::derivatives::{Jacobian, Normal, regularised};
use crate::estimate::likelihood::Residuals;
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use nalgebra::{DMatrix, DVector};
use plant_model::Effect;
use plant_model::effects::identification::{ImageContext, Imaged, StandsFor};

/// A hypothesis with one cause of a fit replaced by an image of it, at equivalent values: from other initial values a fit
/// rarely converges there. `None` for one that acts nowhere, or is there already.
pub(crate) fn image(problem: &Problem<'_>, fit: &Fit, effect: Effect, other: Effect) -> Option<Hypothesis> {
    let h = &fit.hypothesis;
    let to = problem.parameters(other).first().copied()?;
    if h.effects.contains(&other) || to.channels == 0 {
        return None;
    }
    let imaged = imaged(problem, fit, effect, other)?;
    let start = [imaged.value.clamp(to.min, to.max)];
    let mut out = h.without(effect, problem.nominal).with(other, problem.parameters(other), &start, false);
    if let Some((companion, index, factor)) = imaged.companion {
        out.scale(Slot::Effect(companion, index), factor);
    }
    let added_n = imaged.added_friction_n;
    if added_n == 0.0 {
        return Some(out);
    }
    // A factor on friction multiplies the stated static friction, not one fitted as an effect; friction that grows with
    // pressure adds to both. So the fitted value changes by the difference, and the stated levels keep their values.
    let factor = matches!(effect.identification().stands_for, StandsFor::FactorOn(_));
    let levels = [effect, other].map(|effect| effect.identification().adds_to_levels).concat();
    for (parameter, value) in out.parameters.iter().zip(&mut out.values) {
        match parameter.slot {
            Slot::Effect(e, 0) if e == other => *value = start[0],
            Slot::Effect(e, 0) if e.identification().stands_for == StandsFor::ValuesOf(&["friction.static_n"]) => {
                let by_n = if factor { -added_n } else { added_n };
                *value = (*value + by_n).clamp(parameter.min, parameter.max);
            }
            Slot::Nominal(key) if levels.contains(&key.path) => {
                *value = h.value(parameter.slot).unwrap_or(parameter.neutral);
            }
            _ => {}
        }
    }
    Some(out)
}

/// The hypotheses without a cause of a fit, one for each image of it that is among the other causes: that one then does what the cause
/// did, too. A force that is half told as a sensor's offset would hardly be found whole from its half.
pub(super) fn taken_over(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Vec<(Effect, Hypothesis)> {
    let h = &fit.hypothesis;
    let by = |other: Effect| {
        let place = h.parameters.iter().position(|p| p.slot == Slot::Effect(other, 0))?;
        let parameter = &h.parameters[place];
        let imaged = imaged(problem, fit, effect, other).filter(|imaged| *imaged == Imaged::at(imaged.value))?;
        let mut out = h.without(effect, problem.nominal);
        let place = out.parameters.iter().position(|p| p.slot == parameter.slot)?;
        let value = h.values_of(other).first()? + imaged.value - parameter.neutral;
        out.values[place] = value.clamp(parameter.min, parameter.max);
        Some((other, out))
    };
    effect.images_among(&h.effects).filter(|other| h.effects.contains(other)).filter_map(by).collect()
}

/// What stands in for a cause of a fit.
pub(super) struct Nearest {
    /// The cause replaced by another effect, at the values that do as nearly the same as they can.
    pub(super) hypothesis: Hypothesis,
    /// Squared partial correlation of what the cause does with what the other can do, given all other free values: 1 if the other does
    /// the same, 0 if it does nothing of it.
    pub(super) correlation: f64,
}

/// A hypothesis with one cause of a fit replaced by another effect, begun at the values that do as nearly the same as they can: what the
/// cause does to the residuals, projected on what the other effect does, to first order. A fit that begins where the other does
/// nothing seldom gets there past a piston that sticks and slips. `None` where the log shows nothing of the other.
///
/// `slopes` and `normal` are the fit's Jacobian and its normal matrix, the same for all effects.
pub(super) fn nearest(
    problem: &Problem<'_>,
    (fit, slopes, normal): (&Fit, &Jacobian, &Normal),
    effect: Effect,
    other: Effect,
) -> Option<Nearest> {
    let h = &fit.hypothesis;
    let parameters = problem.parameters(other);
    if h.effects.contains(&other) || parameters.iter().all(|p| p.channels == 0) {
        return None;
    }
    let neutral: Vec<f64> = parameters.iter().map(|p| p.neutral).collect();
    let both = h.extended_by(other, parameters.clone(), &neutral);
    let places_of = |effect: Effect| -> Vec<usize> {
        let of = |p: &Parameter| matches!(p.slot, Slot::Effect(e, _) if e == effect);
        (0..both.parameters.len()).filter(|place| of(&both.parameters[*place])).collect()
    };
    let (of_cause, of_other) = (places_of(effect), places_of(other));
    let base = &slopes.base;
    let added: Vec<Residuals> =
        of_other.iter().map(|place| problem.jacobian_column(&both, &both.values, base, *place)).collect();
    let columns: Vec<&Residuals> = slopes.columns.iter().chain(&added).collect();
    let (matrix, _) = problem.normal(&both, &both.values, base, &columns, Some(normal));
    let away = |place: &usize| (both.values[*place] - both.parameters[*place].neutral) / both.parameters[*place].scale;
    let away = DVector::from_iterator(of_cause.len(), of_cause.iter().map(away));
    // Tolerances do nothing to the residuals.
    let mut of_data = part(&matrix, &of_other, &of_other);
    parameters.iter().enumerate().for_each(|(k, p)| of_data[(k, k)] -= p.told_by_tolerance());
    let moved = regularised(&of_data, 1.0e-12).try_inverse()? * part(&matrix, &of_other, &of_cause) * &away;
    let start: Vec<f64> =
        parameters.iter().zip(&moved).map(|(p, moved)| (p.neutral + moved * p.scale).clamp(p.min, p.max)).collect();
    let correlation = squared_partial_correlation(&matrix, (&of_cause, &away), &of_other)?;
    start.iter().all(|value| value.is_finite()).then(|| Nearest {
        hypothesis: h.without(effect, problem.nominal).with(other, parameters, &start, false),
        correlation,
    })
}

/// Some rows and columns of a matrix.
fn part(matrix: &DMatrix<f64>, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])])
}

/// The squared partial correlation of a change of some parameters with what others do, given all the rest, from a normal matrix.
fn squared_partial_correlation(
    matrix: &DMatrix<f64>,
    (changed, change): (&[usize], &DVector<f64>),
    others: &[usize],
) -> Option<f64> {
    let rest: Vec<usize> = (0..matrix.nrows()).filter(|k| !changed.contains(k) && !others.contains(k)).collect();
    let all: Vec<usize> = rest.iter().chain(others).copied().collect();
    let own = change.dot(&(part(matrix, changed, changed) * change));
    // What is left of the change beside what some parameters can do of it.
    let left = |free: &[usize]| {
        let shared = part(matrix, free, changed) * change;
        let within = regularised(&part(matrix, free, free), 1.0e-14).cholesky()?;
        Some((own - within.solve(&shared).dot(&shared)).max(0.0))
    };
    Some(1.0 - left(&all)? / left(&rest)?)
}

/// The values that make another effect equivalent to a cause of a fit.
fn imaged(problem: &Problem<'_>, fit: &Fit, effect: Effect, other: Effect) -> Option<Imaged> {
    let neutral = |effect: Effect| problem.parameters(effect).first().map(|p| p.neutral);
    let neutral_here = neutral(effect)?;
    let context = ImageContext {
        rig: &problem.rig.rig,
        away: fit.hypothesis.values_of(effect).first()? - neutral_here,
        neutral: neutral_here,
        image_neutral: neutral(other)?,
        gauge_sum_pa: problem.gauge_sum_pa(),
    };
    effect.as_image(other, &context)
}

/// The third effect, and the index of its parameter, that has to change when a cause is replaced by its image.
pub(crate) fn companion(problem: &Problem<'_>, fit: &Fit, effect: Effect, other: Effect) -> Option<(Effect, usize)> {
    imaged(problem, fit, effect, other)?.companion.map(|(companion, index, _)| (companion, index))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::balances::observers::judgeable;
    use crate::balances::shared::Signals;
    use crate::balances::simulated::simulated;
    use crate::data::prepare::prepare;
    use crate::estimate::effort::Effort;
    use crate::model::nominal::nominal_parameters;
    use plant_model::Effects;
    use rig_files::RigFile;

    #[test]
    fn an_offset_comes_nearest_to_a_gain_where_it_is_what_the_gain_adds_to_the_usual_pressure() {
        let rig = RigFile::paper_c();
        let hidden = Effects::none().with(Effect::PressureBGain, &[1.03]);
        let log = simulated(&rig, &hidden, 6000, |t_s| 1.5 * (3.0 * t_s).sin());
        let record = prepare(&log, &rig);
        let nominal = nominal_parameters(&rig, judgeable(&record), true, &record.u_v);
        let (signals, effort) = (Signals::default(), Effort::default());
        let problem = Problem::new((&rig, &record), judgeable(&record), &nominal, (&signals, &effort));
        let gain = Hypothesis::null(&nominal).extended_by(
            Effect::PressureBGain,
            problem.parameters(Effect::PressureBGain),
            &[1.03],
        );
        let gain = problem.evaluate_as_is(gain).expect("a rig that can be simulated");
        let slopes = problem.jacobian(&gain).expect("a rig that can be simulated");
        let normal = problem.normal_of(&slopes, &gain);
        let found = nearest(&problem, (&gain, &slopes, &normal), Effect::PressureBGain, Effect::PressureBOffset);
        let Nearest { hypothesis: offset, correlation } = found.expect("an effect on B");
        assert_eq!(offset.effects, [Effect::PressureBOffset]);
        assert!(correlation > 0.0 && correlation < 1.0, "{correlation}");
        let usual_pa = record.p_b_pa.iter().sum::<f64>() / record.len() as f64;
        let [offset_pa] = offset.values_of(Effect::PressureBOffset)[..] else { panic!("one parameter") };
        let expected_pa = 0.03 * usual_pa / 1.03;
        assert!((offset_pa / expected_pa - 1.0).abs() < 0.2, "{offset_pa} {expected_pa}");
    }

    #[test]
    fn what_is_common_to_two_changes_is_their_partial_correlation() {
        // Columns of unit length: the first two 60 degrees apart, the third across both.
        let matrix = DMatrix::from_row_slice(3, 3, &[1.0, 0.5, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0, 1.0]);
        let change = DVector::from_element(1, 2.0);
        let of = |others: &[usize]| squared_partial_correlation(&matrix, (&[0], &change), others).expect("regular");
        assert!((of(&[1]) - 0.25).abs() < 1e-9 && of(&[2]).abs() < 1e-9);
        // With the second one free the first has less of its own, and all of that is common to one that does the same.
        let alike = DMatrix::from_row_slice(3, 3, &[1.0, 0.5, 1.0, 0.5, 1.0, 0.5, 1.0, 0.5, 1.0]);
        let same = squared_partial_correlation(&alike, (&[0], &change), &[2]).expect("regular");
        assert!((same - 1.0).abs() < 1e-6, "{same}");
    }
}
