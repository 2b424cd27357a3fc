//! How well a log would determine each parameter: the Fisher information of the balances at the rig as stated.

use crate::balances::observers;
use crate::balances::shared::Signals;
use crate::constants;
use crate::data::channel::Channel;
use crate::data::grid::{Between, refined};
use crate::data::prepare::prepare;
use crate::data::record::Record;
use crate::estimate::derivatives::regularised;
use crate::estimate::effort::Effort;
use crate::estimate::likelihood::Residuals;
use crate::estimate::problem::Problem;
use crate::model::hypothesis::Hypothesis;
use crate::model::nominal;
use crate::select::visibility;
use plant_model::Effect;
use plant_model::effects::MAX_PARAMETERS;
use rayon::prelude::*;
use rig_files::{Log, RigFile};
use serde::Serialize;

/// How well a parameter would be known.
#[derive(Clone, Debug, Serialize)]
pub struct Knowledge {
    /// Rig key, or the identifier of an effect.
    pub name: String,
    /// Standard error from the log beside all other nominal values within their tolerances, SI; infinite where the log says nothing.
    pub std_error: f64,
    /// What it is compared with: the tolerance of a nominal value, a plainly visible change by an effect.
    pub compared_with: f64,
    /// Information of the log about the parameter alone, in units of `1 / compared_with^2`.
    pub information: f64,
    /// Whether the log says more than was known, or would show a plainly visible effect beyond doubt.
    pub told: bool,
}

impl Knowledge {
    fn new(name: &str, std_error: f64, compared_with: f64, information: f64) -> Self {
        let told = constants::sure() * std_error < compared_with * if name.contains('.') { 4.0 } else { 1.0 };
        Self { name: name.to_string(), std_error, compared_with, information, told }
    }
}

/// What a part of a planned recording would add.
#[derive(Clone, Debug, Serialize)]
pub struct Window {
    /// From, s.
    pub from_s: f64,
    /// To, s.
    pub to_s: f64,
    /// Sum of the logarithms by which it lowers the variance of what is not known yet.
    pub adds: f64,
    /// What it adds most to.
    pub mostly: Vec<String>,
}

/// A hypothesis of nominal values and one effect at the strength where it shows.
fn with_effect(problem: &Problem<'_>, nominal: &Hypothesis, effect: Effect) -> Hypothesis {
    let parameters = problem.parameters(effect);
    let (mut neutral, mut scales) = ([0.0; MAX_PARAMETERS], [0.0; MAX_PARAMETERS]);
    for (index, p) in parameters.iter().enumerate() {
        (neutral[index], scales[index]) = (p.neutral, p.scale);
    }
    let visible = effect.visible(&neutral, &scales);
    // Where an effect must be overcome before it acts, its slope is that at visible strength.
    let smooth = effect.identification().smooth_at_neutral;
    let start: Vec<f64> = (0..parameters.len()).map(|k| if smooth { neutral[k] } else { visible[k] }).collect();
    nominal.extended_by(effect, parameters, &start)
}

/// The prepared log with everything that an evaluation needs, handed to `use_it`.
fn with_problem<T>(rig: &RigFile, log: &Log, use_it: impl FnOnce(&Problem<'_>, &Record) -> T) -> Option<T> {
    let record = refined(prepare(log, rig), Between::Held);
    let judgeable = observers::judgeable(&record);
    if judgeable & !Channel::Supply.bit() == 0 {
        return None;
    }
    let nominal = nominal::nominal_parameters(rig, judgeable, record.available.supply, &record.u_v);
    let (signals, effort) = (Signals::default(), Effort::default());
    // A forecast takes all of the log.
    let problem = Problem::new((rig, &record), judgeable, &nominal, (&signals, &effort)).on(record.stretches.clone());
    Some(use_it(&problem, &record))
}

/// How well each nominal value and each effect would be known.
pub(crate) fn knowledge(rig: &RigFile, log: &Log) -> Vec<Knowledge> {
    with_problem(rig, log, |problem, _| {
        let (subset, ratio) = problem.subset();
        of(&subset, ratio)
    })
    .unwrap_or_default()
}

fn of(problem: &Problem<'_>, ratio: f64) -> Vec<Knowledge> {
    let null = Hypothesis::null(problem.nominal);
    let Some(base) = problem.evaluate(&null, &null.values, problem.judgeable) else { return Vec::new() };
    let column = |index: usize| problem.jacobian_column(&null, &null.values, &base, index);
    let own: Vec<Residuals> = (0..null.values.len()).into_par_iter().map(column).collect();
    let mut out = Vec::new();
    // What the log says of a value beside all others within their tolerances: only its own prior is left out.
    let beside = |place: usize| -> Hypothesis {
        let mut h = null.clone();
        h.parameters[place].tolerance = None;
        h
    };
    let std_error = |h: &Hypothesis, base: &Residuals, columns: &[&Residuals], place: usize| -> (f64, f64) {
        // Errors as of a right model: the information is that of noise.
        let (matrix, _) = problem.normal(h, &h.values, &zeroed(base), columns, None);
        let information = ratio * matrix[(place, place)];
        let inverse = regularised(&matrix, 1.0e-12).try_inverse();
        let variance = inverse.map_or(f64::INFINITY, |inverse| inverse[(place, place)].max(0.0) / ratio);
        (if information > 0.0 { variance.sqrt() } else { f64::INFINITY }, information)
    };
    let references: Vec<&Residuals> = own.iter().collect();
    for (place, parameter) in null.parameters.iter().enumerate() {
        let Some(name) = parameter.slot.stated_key() else { continue };
        let (error, information) = std_error(&beside(place), &base, &references, place);
        let compared_with = parameter.tolerance.unwrap_or(parameter.scale);
        let [error, compared_with] =
            [error * parameter.scale, compared_with].map(|value| parameter.slot.as_stated(value));
        out.push(Knowledge::new(name, error, compared_with, information));
    }
    let effects: Vec<Effect> = visibility::candidates(problem);
    let of_effect = |effect: &Effect| -> Option<Knowledge> {
        let hypothesis = with_effect(problem, &null, *effect);
        let at_start = problem.evaluate(&hypothesis, &hypothesis.values, problem.judgeable)?;
        let place = null.values.len();
        let added = problem.jacobian_column(&hypothesis, &hypothesis.values, &at_start, place);
        let columns: Vec<&Residuals> = own.iter().chain([&added]).collect();
        // Nominal values keep their priors: beside them the effect has to show.
        let mut h = hypothesis.clone();
        h.parameters.truncate(place + 1);
        h.values.truncate(place + 1);
        let (error, information) = std_error(&h, &at_start, &columns, place);
        let parameter = &h.parameters[place];
        Some(Knowledge::new(effect.id(), error * parameter.scale, parameter.scale, information))
    };
    out.extend(effects.par_iter().filter_map(of_effect).collect::<Vec<_>>());
    out
}

/// Errors of zero in the places of some residuals.
fn zeroed(residuals: &Residuals) -> Residuals {
    Residuals {
        channels: std::array::from_fn(|channel| vec![0.0; residuals.channels[channel].len()]),
        ..Residuals::default()
    }
}

/// What each window of a planned recording would add to what is known, best first.
pub(crate) fn windows(rig: &RigFile, known: &[Knowledge], planned: &Log, window_s: f64) -> Vec<Window> {
    let lacking: Vec<&Knowledge> = known.iter().filter(|k| !k.told).collect();
    let (first, last) = (planned.t_s.first().copied().unwrap_or(0.0), planned.t_s.last().copied().unwrap_or(0.0));
    let count = ((last - first) / window_s).floor() as usize;
    let mut out: Vec<Window> = (0..count)
        .filter_map(|index| {
            let from_s = first + index as f64 * window_s;
            let rows =
                planned.t_s.partition_point(|t| *t < from_s)..planned.t_s.partition_point(|t| *t < from_s + window_s);
            let mut part = Log { t_s: planned.t_s[rows.clone()].to_vec(), ..Log::default() };
            for column in rig_files::Column::ALL {
                if let Some(values) = planned.column(column) {
                    part.set(column, Some(values[rows.clone()].to_vec()));
                }
            }
            let told = with_problem(rig, &part, |problem, _| of(problem, 1.0))?;
            let gain = |lacks: &&Knowledge| {
                let adds = told.iter().find(|k| k.name == lacks.name).map_or(0.0, |k| k.information);
                // In units of the larger of what is known and what would be visible.
                ((1.0 + lacks.information + adds) / (1.0 + lacks.information)).ln()
            };
            let mut gains: Vec<(f64, &str)> = lacking.iter().map(|lacks| (gain(lacks), lacks.name.as_str())).collect();
            gains.sort_by(|a, b| b.0.total_cmp(&a.0));
            let mostly = gains.iter().take(3).filter(|gain| gain.0 > 0.5).map(|gain| gain.1.to_string()).collect();
            Some(Window { from_s, to_s: from_s + window_s, adds: gains.iter().map(|gain| gain.0).sum(), mostly })
        })
        .collect();
    out.sort_by(|a, b| b.adds.total_cmp(&a.adds));
    out
}
