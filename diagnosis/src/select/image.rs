//! The image of a cause: another effect that is nearly equivalent, at a value that can be computed.

use crate::estimate::derivatives::regularised;
use crate::estimate::likelihood::{Residuals, weight};
use crate::estimate::problem::{Fit, Problem};
use crate::model::hypothesis::Hypothesis;
use crate::model::parameter::{Parameter, Slot};
use nalgebra::{DMatrix, DVector};
use plant_model::Effect;
use plant_model::effects::identification::{ImageContext, Imaged, StandsFor};

/// A hypothesis with one cause of a fit replaced by its image, at equivalent values: from other initial values a fit
/// rarely converges there. `None` for causes without an image.
pub(crate) fn image(problem: &Problem<'_>, fit: &Fit, effect: Effect) -> Option<Hypothesis> {
    let other = effect.image_among(&fit.hypothesis.effects)?;
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

/// A hypothesis with one cause of a fit replaced by another effect, begun at the values that do as nearly the same as they can: what the
/// cause does to the residuals, projected on what the other effect does, to first order. A fit that begins where the other does
/// nothing seldom gets there past a piston that sticks and slips. `None` where the log shows nothing of the other.
pub(super) fn nearest(problem: &Problem<'_>, fit: &Fit, effect: Effect, other: Effect) -> Option<Hypothesis> {
    let h = &fit.hypothesis;
    let parameters = problem.parameters(other);
    if h.effects.contains(&other) || parameters.iter().all(|p| p.channels == 0) {
        return None;
    }
    let neutral: Vec<f64> = parameters.iter().map(|p| p.neutral).collect();
    let both = h.extended_by(other, parameters.clone(), &neutral);
    let base = problem.evaluate(&both, &both.values, problem.judgeable)?;
    let column = |place: usize| problem.jacobian_column(&both, &both.values, &base, place);
    let places_of = |effect: Effect| {
        let of = move |p: &Parameter| matches!(p.slot, Slot::Effect(e, _) if e == effect);
        both.parameters.iter().enumerate().filter(move |(_, p)| of(p)).map(|(place, _)| place)
    };
    // What the cause does, in the sign of the residuals.
    let mut done = Residuals::default();
    for place in places_of(effect) {
        let p = &both.parameters[place];
        let away = (both.values[place] - p.neutral) / p.scale;
        for (sum, by) in done.channels.iter_mut().zip(column(place).channels) {
            sum.resize(sum.len().max(by.len()), 0.0);
            sum.iter_mut().zip(by).for_each(|(sum, by)| *sum += away * by);
        }
    }
    let columns: Vec<Residuals> = places_of(other).map(column).collect();
    let product = |a: &Residuals, b: &Residuals| -> f64 {
        let of_channel = |channel: usize| {
            let e = &base.channels[channel];
            let terms =
                a.channels[channel].iter().zip(&b.channels[channel]).zip(e).map(|((a, b), e)| a * b * weight(*e));
            terms.sum::<f64>() / problem.dispersion[channel]
        };
        (0..4).map(of_channel).sum()
    };
    let n = columns.len();
    let matrix = DMatrix::from_fn(n, n, |i, j| product(&columns[i], &columns[j]));
    let projected = DVector::from_fn(n, |i, _| product(&columns[i], &done));
    let moved = regularised(&matrix, 1.0e-12).try_inverse()? * projected;
    let start: Vec<f64> =
        parameters.iter().zip(&moved).map(|(p, moved)| (p.neutral + moved * p.scale).clamp(p.min, p.max)).collect();
    start
        .iter()
        .all(|value| value.is_finite())
        .then(|| h.without(effect, problem.nominal).with(other, parameters, &start, false))
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
        let offset = nearest(&problem, &gain, Effect::PressureBGain, Effect::PressureBOffset).expect("an effect on B");
        assert_eq!(offset.effects, [Effect::PressureBOffset]);
        let usual_pa = record.p_b_pa.iter().sum::<f64>() / record.len() as f64;
        let [offset_pa] = offset.values_of(Effect::PressureBOffset)[..] else { panic!("one parameter") };
        let expected_pa = 0.03 * usual_pa / 1.03;
        assert!((offset_pa / expected_pa - 1.0).abs() < 0.2, "{offset_pa} {expected_pa}");
    }
}
