//! The diagnosis as a whole: from rig file and log to verdict, causes, gain and recommended experiment.

use crate::balances::observers::{self, Innovations};
use crate::balances::shared::Signals;
use crate::balances::term_library;
use crate::check::mapping::contradictions;
use crate::constants;
use crate::data::channel::{Channel, Channels};
use crate::data::cleaned::Cleaned;
use crate::data::prepare::prepare;
use crate::data::record::Record;
use crate::errors::{DiagnosisError, LEAST_SAMPLES};
use crate::estimate::between_rows::Rows;
use crate::estimate::effort::Effort;
use crate::estimate::problem::{Fit, Problem};
use crate::estimate::{clocks, gauges, noise_level};
use crate::explain::residuals::Residuals;
use crate::explain::{calibration, cause, experiments, extension, identifiability};
use crate::model::hypothesis::Hypothesis;
use crate::model::nominal;
use crate::one_pressure::diagnose_one_pressure;
use crate::outcome::{Description, Diagnosis, Evidence, Hypothesised, LogSummary, Overlay};
use crate::select::held_rows::held_with_a_cause;
use crate::select::penalty::{beyond_noise, beyond_noise_in, ends_at_bound};
use crate::select::search::{self, Begin, Ends, Found};
use crate::validate::hold_out::{self, Predictions};
use crate::validate::{closure, foreign_terms, support, verdict};
use plant_model::{Effect, Plant};
use rig_files::{Log, RigFile, Verdict};

/// Diagnoses the gap between a rig file and a log. `progress` is called with the name of each stage.
///
/// # Errors
/// If the log allows no judgement at all. Everything less is part of the result.
pub fn diagnose(rig: &RigFile, log: &Log, progress: &dyn Fn(&str)) -> Result<Diagnosis, DiagnosisError> {
    let plant = Plant::new(&rig.rig, &rig.effects).map_err(DiagnosisError::Rig)?;
    progress("check");
    let Cleaned { log, repeats, outliers, .. } = &Cleaned::of(log);
    let mut rows = prepare(log, rig);
    if let Some(found) = contradictions(rig, log, &rows).into_iter().next() {
        return Err(DiagnosisError::Contradiction { problem: found.problem, remedy: found.remedy });
    }
    rows.quality.isolated_readings = outliers.len();
    rows.quality.repeated_readings = repeats.iter().map(|repeats| repeats.rows).sum();
    let record = &rows;
    if record.len() < LEAST_SAMPLES {
        return Err(DiagnosisError::TooShort { found: record.len() });
    }
    if record.stretches.iter().all(|s| s.held_back) {
        return Err(DiagnosisError::TooBroken);
    }
    let judgeable = observers::judgeable(record);
    if judgeable & !Channel::Supply.bit() == 0 {
        let both = record.available.pressure_a && record.available.pressure_b;
        return match diagnose_one_pressure(rig, record) {
            Some(diagnosis) => Ok(diagnosis),
            None if both => Err(DiagnosisError::Still),
            None => Err(DiagnosisError::NothingToJudge),
        };
    }
    let corrected = nominal::nominal_parameters(rig, judgeable, record.available.supply, &record.u_v);
    let nominal = Hypothesis::null(&corrected);
    let between_rows = Rows { rig, rows: &rows, judgeable, nominal: &corrected };
    let mut reading = between_rows.likelier(&nominal);
    // With less noise, once a fit has told so.
    let mut record = reading.clone();
    let effort = Effort::default();
    let mut asked = Asked::default();
    let mut begin: Option<Begin> = None;
    loop {
        let library = term_library::library(&record, &plant, judgeable);
        let signals = Signals::default();
        let problem = Problem::new((rig, &record), judgeable, &corrected, (&signals, &effort));
        let mut problem = Problem { terms: &library, ..problem };
        if !asked.nominal_noise
            && let from = begin.as_ref().map_or(&nominal, |begin| &begin.null)
            && let Some(fit) = problem.refit(from.clone(), judgeable, constants::first_iterations())
        {
            asked.nominal_noise = true;
            // A mistake of the mapping does not depend on how rows are read.
            if begin.is_none() {
                let gauge = || gauges::chambers_as_gauge(rig, log, (judgeable, &corrected), &fit.hypothesis);
                let shifted = || clocks::late_or_early(rig, log, (judgeable, &corrected), &fit.hypothesis);
                if let Some(found) = gauge().or_else(shifted) {
                    return Err(DiagnosisError::Contradiction { problem: found.problem, remedy: found.remedy });
                }
            }
            if let Some(quieter) = noise_level::quieter(&problem, &fit) {
                record = quieter;
                continue;
            }
            // Where the nominal values leave noise alone in the chambers, the curve of a table is asked for at once, not after causes
            // were looked for.
            if !reading.command_moved()
                && !beyond_noise_in(&problem, &fit, between_rows.air())
                && let Some(again) = asked.other_curve(&between_rows, &reading, &fit)
            {
                begin = Some(Begin::without_causes(&fit));
                again.take_over(&mut reading, &mut record);
                continue;
            }
        }
        // A large gap looks like a command that moved between rows, or like a curve that is not as stated, until causes take it away.
        let by_curve = reading.curve_doubt > 0.0;
        let in_doubt = if by_curve { !asked.curve } else { record.command_moved() && asked.nothing() };
        let mut other = None;
        let mut ends = |fit: &Fit| {
            other = asked.another_reading(&between_rows, &reading, &fit.hypothesis);
            other.is_some()
        };
        let ends: Option<&mut Ends<'_>> = if in_doubt { Some(&mut ends) } else { None };
        // A fit can only fail on a rig that cannot be simulated, which was checked above.
        let Some(selected) = search::select(&mut problem, &nominal, begin.take(), ends, progress) else {
            return Err(DiagnosisError::NothingToJudge);
        };
        if let Some(again) = other.or_else(|| asked.again(&between_rows, &reading, &problem, selected.fit())) {
            begin = Some(selected.begin());
            again.take_over(&mut reading, &mut record);
            continue;
        }
        let found = search::compare(&problem, selected, progress);
        if asked.readings == 0
            && record.command_moved()
            && (found.best.hypothesis.effects.is_empty() || beyond_noise(&problem, &found.best))
            && let Some((held, cause)) = held_with_a_cause(&between_rows, &problem, &found)
        {
            begin = Some(cause);
            asked.read(MOST_READINGS);
            Again::Reading(held).take_over(&mut reading, &mut record);
            continue;
        }
        if let Some(again) = asked.again(&between_rows, &reading, &problem, &found.best) {
            begin = Some(Begin::of(&found.null, &found.best, &found.memory));
            again.take_over(&mut reading, &mut record);
            continue;
        }
        progress("hold-out");
        return Ok(conclude(&problem, found));
    }
}

/// How often the rows are read again by the causes found: by those selected, and by what comparing them with others makes of them.
const MOST_READINGS: usize = 2;

/// What was asked already, so that it is asked no more than once of the same causes.
#[derive(Default)]
struct Asked {
    /// Whether sensors have less noise with the nominal values corrected, and with causes.
    nominal_noise: bool,
    noise: bool,
    /// How often the rows were read again.
    readings: usize,
    /// The causes by which they were last asked for.
    read_by: Vec<Effect>,
    /// Whether the curve between the points of a table may be doubted less.
    curve: bool,
}

/// The rows read another way, or as before with less noise.
enum Again {
    Reading(Record),
    Noise(Record),
}

impl Again {
    fn take_over(self, reading: &mut Record, record: &mut Record) {
        match self {
            Self::Reading(again) => (*reading, *record) = (again.clone(), again),
            Self::Noise(quieter) => *record = quieter,
        }
    }
}

impl Asked {
    /// The rows are read again: then their noise is asked for again, first with the nominal values.
    fn read(&mut self, readings: usize) {
        self.readings += readings;
        (self.nominal_noise, self.noise) = (false, false);
    }

    /// Whether causes were never asked for another reading of the rows.
    fn nothing(&self) -> bool {
        self.readings == 0 && self.read_by.is_empty()
    }

    /// What causes explain may have looked like a command that moved between rows, or the other way round, or by more than it did. And
    /// without causes, too, the curve of a table may be doubted less than at first.
    fn another_reading(&mut self, rows: &Rows<'_>, reading: &Record, causes: &Hypothesis) -> Option<Again> {
        let is_new = !causes.effects.is_empty() && causes.effects != self.read_by;
        let by_causes = is_new && self.readings < MOST_READINGS;
        let by_curve = !self.curve && reading.curve_doubt > 0.0;
        if by_causes || by_curve {
            self.curve = true;
            self.read_by.clone_from(&causes.effects);
            if let Some(again) = rows.other_than(reading, causes) {
                let by_curve_alone = by_curve && !again.command_moved() && !reading.command_moved();
                self.read(usize::from(!by_curve_alone));
                return Some(Again::Reading(again));
            }
        }
        None
    }

    /// A reading with the curve doubted less by the nominal values alone; where there is none, it is asked for again by a better fit.
    fn other_curve(&mut self, rows: &Rows<'_>, reading: &Record, nominal: &Fit) -> Option<Again> {
        let before = self.curve;
        let again = self.another_reading(rows, reading, &nominal.hypothesis);
        self.curve = before || again.is_some();
        again
    }

    /// [`Asked::another_reading`]; or what causes explain looked like noise.
    fn again(&mut self, rows: &Rows<'_>, reading: &Record, problem: &Problem<'_>, fit: &Fit) -> Option<Again> {
        let another = self.another_reading(rows, reading, &fit.hypothesis);
        if another.is_some() || self.noise || fit.hypothesis.effects.is_empty() {
            return another;
        }
        let quieter = noise_level::quieter(problem, fit)?;
        self.noise = true;
        Some(Again::Noise(quieter))
    }
}

fn conclude(problem: &Problem<'_>, found: Found) -> Diagnosis {
    let (rig, record) = (problem.rig, problem.record);
    let innovations = [&found.null, &found.best].map(|fit| problem.innovations(fit).unwrap_or_default());
    let mut balances = closure::balances(problem, &found, &innovations);
    let effects = &found.best.hypothesis.effects;
    let causes = (0..effects.len()).map(|index| cause::cause(problem, &found, &found.best, index)).collect();
    let predictions_of = |fit: &Fit| Predictions::of(problem, fit);
    let mut predictions = predictions_of(&found.best);
    let mut judgement = verdict::judge(problem, &found, &balances, causes, predictions.as_ref());

    // A lead is not proven: the verdict asks what the model predicts without it.
    let mut proven = found.best.hypothesis.clone();
    for lead in &judgement.leads {
        if let Some(effect) = Effect::from_id(&lead.id) {
            proven = proven.without(effect, problem.nominal);
        }
    }
    let kept = match judgement.leads.is_empty() {
        true => None,
        // Without any cause it was fitted already.
        false if proven.effects.is_empty() => Some(found.null.clone()),
        false => problem.fit(proven, 6),
    };
    if let Some(kept) = &kept {
        predictions = predictions_of(kept);
    }
    let mut kept = kept.unwrap_or_else(|| found.best.clone());
    let ended: Vec<Effect> = effects.iter().copied().filter(|effect| ends_at_bound(&kept, *effect)).collect();
    judgement.doubt(&ended);
    let at =
        |predictions: &Option<Predictions<'_>>, horizon_s: f64| predictions.as_ref()?.gain(problem, None, horizon_s);
    let mut nearest = at(&predictions, hold_out::HORIZON_S);
    // Without a lead nominal values may have to be off all at once: then it stands for a part of the gap.
    if !judgement.leads.is_empty() {
        kept = problem.with_errors(kept);
    }
    let likely = judgement.leads.is_empty() || verdict::is_likely_rig(&kept);
    let predicted = || nearest.as_ref().is_none_or(|(gain, _)| gain.closed());
    // Where every equation holds to within noise, what predictions err beyond it is of values that the log tells poorly, as what
    // holds a resting piston: no gap of the model.
    let holds = || judgement.open == 0 && closure::holds_like_noise(problem, &kept);
    // Values that only the part held back tells, as openings that the valve has nowhere else, may be as stated or not.
    let by_all = || {
        let asked = judgement.open == 0 && kept.hypothesis.effects.is_empty();
        let all = asked.then(|| closure::held_by_all(problem, &kept)).flatten();
        all.is_some_and(|fit| verdict::is_likely_rig(&fit) && verdict::closes(problem, predictions_of(&fit).as_ref()))
    };
    let closed = likely && (predicted() || holds() || by_all());
    // A model that errs as a whole is no place for names whose alternatives were never tried.
    if !closed {
        judgement.doubt(&found.unrivalled);
    }
    // What a lead takes up is no part of a named cause's value.
    if !judgement.leads.is_empty() {
        for cause in &mut judgement.causes {
            if let Some(index) = effects.iter().position(|effect| effect.id() == cause.id) {
                *cause = cause::cause(problem, &found, &kept, index);
            }
        }
    }
    let named: Vec<Effect> = judgement.causes.iter().filter_map(|cause| Effect::from_id(&cause.id)).collect();
    let verdict = judgement.verdict(closed);
    // The extended rig has all that the part held back supports, named or not.
    let mut extended = kept.clone();
    if matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained) {
        let floor = nearest.as_ref().map(|(gain, _)| gain.holdout.noise_floor);
        let all = support::supported(problem, &found, (&named, &kept), floor.as_ref(), judgement.open != 0 || !closed);
        if all.hypothesis.effects != kept.hypothesis.effects {
            extended = Fit { covariance: None, ..all };
            predictions = predictions_of(&extended);
            nearest = at(&predictions, hold_out::HORIZON_S);
        }
    }
    if extended.covariance.is_none() {
        extended = problem.with_errors(extended);
    }
    let mut extended_rig = extended.hypothesis.rig(rig, &extended.hypothesis.values);
    extended_rig.name = format!("{}, extended", rig.name);
    let horizons =
        hold_out::OTHER_HORIZONS_S.into_iter().filter_map(|horizon_s| Some(at(&predictions, horizon_s)?.0)).collect();
    let (gain, overlay) = nearest.map_or_else(Default::default, |(gain, overlay)| (Some(gain), overlay));
    let extension = extension::extension(problem, &extended, &judgement.causes);
    let description = match verdict {
        Verdict::Unexplained | Verdict::PartlyExplained => {
            description(problem, &kept, judgement.open | verdict::acted_on(&judgement.leads))
        }
        Verdict::NoGap | Verdict::Explained => None,
    };
    let mut hypotheses: Vec<Hypothesised> = found
        .memory
        .tried
        .iter()
        .map(|t| Hypothesised { effects: t.effects.iter().map(|e| e.id()).collect(), cost: t.cost, fitted: t.fitted })
        .collect();
    hypotheses.push(Hypothesised { effects: vec![], cost: found.null.undispersed(), fitted: true });
    hypotheses.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    hypotheses.dedup_by(|a, b| a.effects == b.effects && a.fitted == b.fitted);
    let evidence = evidence(problem, innovations, overlay);
    let residuals = Residuals::new(&evidence, &record.quality, &rig.rig);
    for (balance, channel) in balances.iter_mut().zip(closure::judged(problem)) {
        balance.depends_on = residuals.dependences(channel);
        balance.peak = residuals.peak(channel);
    }
    Diagnosis {
        verdict,
        next_experiment: experiments::next_experiment(verdict, (&judgement.causes, &balances), problem),
        causes: judgement.causes,
        extension,
        calibration: calibration::calibration(problem, &extended),
        gain,
        horizons,
        not_identifiable: identifiability::not_identifiable(problem, &extended),
        leads: if verdict == Verdict::NoGap { Vec::new() } else { judgement.leads },
        description,
        balances,
        log: LogSummary {
            available: record.available,
            quality: record.quality.clone(),
            held_back_s: held_back_s(record),
        },
        hypotheses,
        extended_rig,
        evidence,
    }
}

/// How much of a record is held back, s.
fn held_back_s(record: &Record) -> f64 {
    let held = record.stretches.iter().filter(|s| s.held_back);
    held.map(|s| record.t_s[s.end - 1] - record.t_s[s.start]).sum()
}

/// Terms outside the catalogue that the balances in `lacking` need in addition to the fit; `None` if there are none.
///
/// Over-dispersion, which makes names uncertain, is left out of account: what is described is what makes it.
fn description(problem: &Problem<'_>, fit: &Fit, lacking: Channels) -> Option<Description> {
    let problem = &problem.with_white_noise();
    let extended = foreign_terms::extend(problem, fit, lacking, constants::most_terms());
    let found =
        (!extended.terms.is_empty()).then(|| foreign_terms::describe(problem, &problem.held_back(), fit, extended));
    // What does not hold on the part held back describes only the part it was fitted to.
    found.filter(|found| !found.terms.is_empty() && (found.holdout_share.is_nan() || found.holdout_share > 0.0))
}

fn evidence(problem: &Problem<'_>, innovations: [Innovations; 2], overlay: Overlay) -> Evidence {
    let record = problem.record;
    let samples: Vec<usize> = record.rows_of(&problem.stretches).collect();
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
