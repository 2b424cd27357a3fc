//! The diagnosis as a whole: from rig file and log to verdict, causes, gain and advice.

use crate::advice;
use crate::balance::shared::Signals;
use crate::balance::{self, Channel, Channels, Innovations};
use crate::beyond::{self, Description};
use crate::extensions;
use crate::fit::{Fit, Problem};
use crate::holdout::{self, Overlay};
use crate::hypothesis::{self, Hypothesis, Slot};
use crate::judgement;
use crate::one_pressure::diagnose_one_pressure;
use crate::outcome::{Balance, Calibration, Cause, Estimate, Gain};
use crate::record::{Available, Quality, Record, SHORTEST_STRETCH_S};
use crate::residual::Residuals;
use crate::search::{self, Found};
use crate::terms;
use plant_model::{Effect, Plant};
use rig_files::{Log, RigFile, Verdict};
use serde::{Serialize, Serializer};

/// The least usable data.
const LEAST_SAMPLES: usize = 200;
/// A nominal value is called calibrated if it moved by this many of its standard errors and tenths of its tolerance.
const CALIBRATED_SIGMAS: f64 = 2.0;

/// Why a log cannot be diagnosed at all.
#[derive(Clone, Debug, thiserror::Error, PartialEq)]
pub enum DiagnosisError {
    /// Too few complete samples.
    #[error(
        "the log has {found} samples in which all its measured columns have a value; at least {LEAST_SAMPLES} are needed: \
         record longer, or leave out the column with the blanks"
    )]
    TooShort {
        /// Complete samples found.
        found: usize,
    },
    /// Complete samples, but none in a row.
    #[error(
        "the log is interrupted so often that no {SHORTEST_STRETCH_S} s of it hang together: record without losing rows, or \
         leave out the column with the blanks"
    )]
    TooBroken,
    /// No balance can be formed.
    #[error(
        "the log has no combination of columns that makes a balance: add u_v with p_a_pa or p_b_pa (mass balance), or both \
         pressures (force balance)"
    )]
    NothingToJudge,
    /// Without a command only the force balance could be formed, and nothing moves.
    #[error("without u_v only the mechanics could be judged, and the piston hardly moves: add u_v, or record strokes")]
    Still,
    /// The rig file contradicts itself.
    #[error("the rig cannot be simulated: {0}")]
    Rig(plant_model::ParameterError),
}

fn as_word<S: Serializer>(verdict: &Verdict, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(verdict.word())
}

/// A hypothesis that was tried.
#[derive(Clone, Debug, Serialize)]
pub struct Hypothesised {
    /// Identifiers of its effects.
    pub effects: Vec<&'static str>,
    /// Minus log-likelihood.
    pub cost: f64,
    /// Whether it was fitted in full; else its cost is predicted to first order.
    pub fitted: bool,
}

/// The result of a diagnosis.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The verdict.
    #[serde(serialize_with = "as_word")]
    pub verdict: Verdict,
    /// Causes, by how much of the gap each explains.
    pub causes: Vec<Cause>,
    /// Nominal values corrected within tolerance.
    pub calibration: Vec<Calibration>,
    /// Gain on the part held back; `null` where the log does not allow full predictions.
    pub gain: Option<Gain>,
    /// The same for a shorter and a longer horizon, where the part held back has room for them.
    pub horizons: Vec<Gain>,
    /// Rig keys and effects this log says nothing about.
    pub not_identifiable: Vec<String>,
    /// What to record next.
    pub next_experiment: Option<String>,
    /// Effects that lower the misfit of a balance that stays open: descriptions, not names.
    pub leads: Vec<Cause>,
    /// What the open balances lack, in closed form, where a few terms outside the catalogue describe it.
    pub description: Option<Description>,
    /// The balances.
    pub balances: Vec<Balance>,
    /// What the log holds and how good it is.
    pub log: LogSummary,
    /// All hypotheses tried, best first.
    pub hypotheses: Vec<Hypothesised>,
    /// The rig with its nominal values corrected and the causes added.
    #[serde(skip)]
    pub extended_rig: RigFile,
    /// Material for pictures.
    #[serde(skip)]
    pub evidence: Evidence,
}

/// What the log holds.
#[derive(Clone, Debug, Serialize)]
pub struct LogSummary {
    /// Columns measured.
    pub available: Available,
    /// Sampling and noise.
    pub quality: Quality,
}

/// Signals for pictures: innovations of nominal and extended model beside what they may depend on.
#[derive(Clone, Debug, Default)]
pub struct Evidence {
    /// Time, s, of every sample used for fitting.
    pub t_s: Vec<f64>,
    /// Command, V (empty if not measured).
    pub u_v: Vec<f64>,
    /// Position, m.
    pub y_m: Vec<f64>,
    /// Velocity, m/s.
    pub v_m_per_s: Vec<f64>,
    /// Pressure of A, Pa (empty if not measured).
    pub p_a_pa: Vec<f64>,
    /// Pressure of B, Pa (empty if not measured).
    pub p_b_pa: Vec<f64>,
    /// Errors of the nominal rig in units of noise: p_a, p_b, y, p_sup; NaN where a prediction is not settled.
    pub nominal: [Vec<f64>; 4],
    /// The same for the extended rig.
    pub extended: [Vec<f64>; 4],
    /// Predictions on the part held back.
    pub overlay: Overlay,
}

/// Diagnoses the gap between a rig file and a log. `progress` hears what is being done.
///
/// # Errors
/// If the log allows no judgement at all. Everything less is part of the result.
pub fn diagnose(rig: &RigFile, log: &Log, progress: &dyn Fn(&str)) -> Result<Diagnosis, DiagnosisError> {
    let plant = Plant::new(&rig.rig, &rig.effects).map_err(DiagnosisError::Rig)?;
    let record = Record::new(log, rig);
    if record.len() < LEAST_SAMPLES {
        return Err(DiagnosisError::TooShort { found: record.len() });
    }
    if record.stretches.iter().all(|s| s.held_back) {
        return Err(DiagnosisError::TooBroken);
    }
    let judgeable = balance::judgeable(&record);
    if judgeable & !Channel::Supply.bit() == 0 {
        let both = record.available.pressure_a && record.available.pressure_b;
        return match diagnose_one_pressure(rig, &record) {
            Some(diagnosis) => Ok(diagnosis),
            None if both => Err(DiagnosisError::Still),
            None => Err(DiagnosisError::NothingToJudge),
        };
    }
    let corrected = hypothesis::nominal_parameters(rig, judgeable, record.available.supply);
    let nominal = Hypothesis::null(&corrected);
    let library = terms::library(&record, &plant, judgeable);
    let signals = Signals::default();
    let fitted = record.stretches.iter().copied().filter(|s| !s.held_back).collect();
    let mut problem = Problem {
        rig,
        record: &record,
        stretches: fitted,
        judgeable,
        nominal: &corrected,
        signals: &signals,
        terms: &library,
        dispersion: [1.0; 4],
    };
    // A fit can only fail on a rig that cannot be simulated, which was checked above.
    let Some(found) = search::search(&mut problem, &nominal, progress) else {
        return Err(DiagnosisError::NothingToJudge);
    };
    progress("hold-out");
    Ok(conclude(&problem, found))
}

fn conclude(problem: &Problem<'_>, found: Found) -> Diagnosis {
    let (rig, record) = (problem.rig, problem.record);
    let innovations = [&found.null, &found.best].map(|fit| problem.innovations(fit).unwrap_or_default());
    let mut balances = judgement::balances(problem, &found, &innovations);
    let effects = found.best.hypothesis.effects.iter().enumerate();
    let causes = effects.map(|(index, effect)| cause(problem, &found, *effect, index)).collect();
    let judgement = judgement::judge(problem, &found, &balances, causes);

    // What is only a lead does not become part of the rig.
    let mut kept = found.best.hypothesis.clone();
    for lead in &judgement.leads {
        if let Some(effect) = Effect::from_id(&lead.id) {
            kept = kept.without(effect, problem.nominal);
        }
    }
    let refitted = (!judgement.leads.is_empty()).then(|| problem.fit(kept, 6).map(|fit| problem.with_errors(fit)));
    let kept = refitted.flatten().unwrap_or_else(|| found.best.clone());
    let mut extended_rig = kept.hypothesis.rig(rig, &kept.hypothesis.values);
    extended_rig.name = format!("{}, extended", rig.name);
    let held = holdout::Comparison::new(record, rig, &extended_rig);
    let at = |horizon_s: f64| held.as_ref()?.gain(horizon_s);
    let horizons = holdout::OTHER_HORIZONS_S.into_iter().filter_map(|horizon_s| Some(at(horizon_s)?.0)).collect();
    let (gain, overlay) = at(holdout::HORIZON_S).map_or_else(Default::default, |(gain, overlay)| (Some(gain), overlay));

    let closed = gain.is_none_or(|gain| gain.holdout.closed());
    let verdict = judgement.verdict(closed);
    let description = match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => {
            description(problem, &kept, judgement.open | judgement::acted_on(&judgement.leads))
        }
        Verdict::NoGap | Verdict::Explained => None,
    };
    let mut hypotheses: Vec<Hypothesised> = found
        .tried
        .iter()
        .map(|t| Hypothesised { effects: t.effects.iter().map(|e| e.id()).collect(), cost: t.cost, fitted: t.fitted })
        .collect();
    hypotheses.push(Hypothesised { effects: vec![], cost: found.null.undispersed(), fitted: true });
    hypotheses.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    hypotheses.dedup_by(|a, b| a.effects == b.effects && a.fitted == b.fitted);
    let evidence = evidence(problem, innovations, overlay);
    let residuals = Residuals::new(&evidence, &record.quality, &rig.rig);
    for (balance, channel) in balances.iter_mut().zip(judgement::judged(problem)) {
        balance.depends_on = residuals.dependences(channel);
        balance.peak = residuals.peak(channel);
    }
    Diagnosis {
        verdict,
        next_experiment: next_experiment(verdict, &judgement.causes, problem),
        causes: judgement.causes,
        calibration: calibration(problem, &kept),
        gain,
        horizons,
        not_identifiable: not_identifiable(problem, &kept),
        leads: if verdict == Verdict::NoGap { Vec::new() } else { judgement.leads },
        description,
        balances,
        log: LogSummary { available: record.available, quality: record.quality.clone() },
        hypotheses,
        extended_rig,
        evidence,
    }
}

/// What the balances in `lacking` lack beside the fit.
fn description(problem: &Problem<'_>, fit: &Fit, lacking: Channels) -> Option<Description> {
    let extended = beyond::extend(problem, fit, lacking);
    (!extended.terms.is_empty()).then(|| beyond::describe(problem, &problem.held_back(), fit, extended))
}

fn cause(problem: &Problem<'_>, found: &Found, effect: Effect, index: usize) -> Cause {
    let best = &found.best;
    let info = effect.info();
    let values = best.hypothesis.values_of(effect);
    let mut parameters = Vec::new();
    for (place, parameter) in best.hypothesis.parameters.iter().enumerate() {
        if let Slot::Effect(e, k) = parameter.slot
            && e == effect
        {
            let value = best.hypothesis.values[place];
            let variance = best.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)]);
            let inherited = value * hypothesis::inherited(effect, problem.nominal);
            let std_error = if variance.is_finite() { variance.max(0.0).sqrt().hypot(inherited) } else { f64::NAN };
            parameters.push(Estimate { name: info.parameters[k].name.to_string(), value, std_error });
        }
    }
    let loss = found.losses.get(index).copied().unwrap_or(0.0);
    let cost = found.best.cost(problem).max(1.0);
    let gap = (found.null.cost(problem) - found.best.cost(problem)).max(1.0);
    Cause {
        id: effect.id().to_string(),
        parameters,
        ties: found.ties.get(index).map(|t| t.iter().map(|e| e.id().to_string()).collect()).unwrap_or_default(),
        evidence: advice::evidence(effect, &values, loss / cost),
        share: (loss / gap).clamp(0.0, 1.0),
    }
}

fn calibration(problem: &Problem<'_>, fit: &Fit) -> Vec<Calibration> {
    let h = &fit.hypothesis;
    let mut out = Vec::new();
    for (place, (parameter, value)) in h.parameters.iter().zip(&h.values).enumerate() {
        let (Slot::Nominal(key), Some(tolerance)) = (parameter.slot, parameter.tolerance) else { continue };
        let variance = fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)]);
        let std_error = if variance.is_finite() { variance.max(0.0).sqrt() } else { tolerance };
        let moved = (value - parameter.neutral).abs();
        if moved > CALIBRATED_SIGMAS * std_error && moved > 0.1 * tolerance {
            out.push(Calibration {
                name: key.path.to_string(),
                nominal: key.get(&problem.rig.rig),
                value: *value,
                std_error,
                tolerance,
            });
        }
    }
    out
}

/// Rig keys the log leaves as they were, and effects it could not have shown.
fn not_identifiable(problem: &Problem<'_>, fit: &Fit) -> Vec<String> {
    let record = problem.record;
    let mut out = Vec::new();
    let friction = &problem.rig.rig.friction;
    let presliding = friction.coulomb_n / friction.stiffness_n_per_m;
    let position = &record.quality.position;
    // The bristles' whole range must stand out of the sensor's noise to be seen.
    if position.standard_deviation.max(position.resolution) > 0.1 * presliding {
        for key in ["stiffness_n_per_m", "damping_n_s_per_m", "breakaway_m"] {
            out.push(format!("friction.{key}"));
        }
    }
    let resolution = balance::motion::velocity_error(record);
    if resolution > 0.2 * friction.stribeck_velocity_m_per_s {
        out.push("friction.stribeck_velocity_m_per_s".to_string());
    }
    for (place, parameter) in fit.hypothesis.parameters.iter().enumerate() {
        if let (Slot::Nominal(key), Some(tolerance)) = (parameter.slot, parameter.tolerance) {
            let variance = fit.covariance.as_ref().map_or(f64::NAN, |c| c[(place, place)]);
            if !variance.is_finite() || variance.max(0.0).sqrt() > 0.7 * tolerance {
                out.push(key.path.to_string());
            }
        }
    }
    let able = extensions::candidates(problem);
    let visible = search::visible(problem, fit, &able);
    out.extend(Effect::ALL.into_iter().filter(|e| !visible.contains(e)).map(|e| e.id().to_string()));
    out
}

fn next_experiment(verdict: Verdict, causes: &[Cause], problem: &Problem<'_>) -> Option<String> {
    let mut out: Vec<String> = Vec::new();
    for cause in causes {
        for tie in &cause.ties {
            if let (Some(one), Some(other)) = (Effect::from_id(&cause.id), Effect::from_id(tie)) {
                out.push(format!("To tell {one} from {other}: {}", advice::separate(one, other)));
            }
        }
    }
    let has = &problem.record.available;
    if has.pressure_a && has.pressure_b && problem.judgeable & Channel::Position.bit() == 0 {
        out.push(
            "The piston hardly moves: record strokes, best the sequence of `plant-sim experiment`, and mechanics and \
             friction can be judged."
                .into(),
        );
    }
    if !(has.command && has.pressure_a && has.pressure_b) {
        out.push("Record the valve command and both chamber pressures: only then can every balance be judged.".into());
    }
    if matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained) {
        out.push(
            "Record the sequence of `plant-sim experiment`, twice: what repeats is physics the catalogue lacks, what does \
             not is wear, drift or disturbance."
                .into(),
        );
    }
    out.dedup();
    (!out.is_empty()).then(|| out.join(" "))
}

fn evidence(problem: &Problem<'_>, innovations: [Innovations; 2], overlay: Overlay) -> Evidence {
    let record = problem.record;
    let samples: Vec<usize> = balance::samples(&problem.stretches).collect();
    let pick = |signal: &[f64]| -> Vec<f64> {
        if signal.is_empty() { Vec::new() } else { samples.iter().map(|&k| signal[k]).collect() }
    };
    let [nominal, extended] = innovations;
    Evidence {
        t_s: pick(&record.t_s),
        u_v: pick(&record.u_v),
        y_m: pick(&record.y_m),
        v_m_per_s: pick(&record.motion.slope),
        p_a_pa: pick(&record.p_a_pa),
        p_b_pa: pick(&record.p_b_pa),
        nominal: nominal.channels,
        extended: extended.channels,
        overlay,
    }
}
