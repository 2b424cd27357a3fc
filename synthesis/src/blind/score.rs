//! Scoring one diagnosis against the truth, in the manner of the DAMADICS benchmark: hits, ties, misnamings, false alarms.

use crate::cause::Cause;
use plant_model::Effect;
use rig_files::Verdict;

/// A parameter as a diagnosis reports it.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// Name as in the catalogue.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard error.
    pub std_error: f64,
}

/// A named cause.
#[derive(Clone, Debug, PartialEq)]
pub struct Named {
    /// Identifier.
    pub id: String,
    /// Parameters.
    pub parameters: Vec<Estimate>,
    /// Identifiers this log cannot tell from it.
    pub ties: Vec<String>,
}

/// Prediction errors of one channel on the data held back.
#[derive(Clone, Debug, PartialEq)]
pub struct Holdout {
    /// Channel, e.g. `p_a_pa`.
    pub channel: String,
    /// With the rig file as it was.
    pub baseline: f64,
    /// With the causes found.
    pub extended: f64,
    /// What noise alone would leave.
    pub noise_floor: f64,
}

/// A diagnosis, reduced to what is scored.
#[derive(Clone, Debug, PartialEq)]
pub struct Answer {
    /// The verdict.
    pub verdict: Verdict,
    /// Causes in order of importance.
    pub causes: Vec<Named>,
    /// Corrected nominal values: key, value over nominal.
    pub calibration: Vec<(String, f64)>,
    /// Errors on the hold-out.
    pub holdout: Vec<Holdout>,
}

impl Answer {
    /// A verdict and nothing else.
    #[must_use]
    pub fn silent(verdict: Verdict) -> Self {
        Self { verdict, causes: vec![], calibration: vec![], holdout: vec![] }
    }
}

/// How a diagnosis did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Outcome {
    /// Exactly the hidden causes, no other.
    Exact,
    /// As many causes as hidden, each of them hidden or declared tied with a hidden one.
    Tied,
    /// Some of several hidden causes, by name or tie, and nothing wrong.
    Partial,
    /// Nothing named.
    Abstained,
    /// A cause named that is not there and is not tied with one that is.
    Misnamed,
    /// Nothing hidden, nothing claimed.
    Quiet,
    /// Nothing hidden, but a gap claimed.
    FalseAlarm,
    /// Something outside the catalogue, and no claim to have explained it.
    Rejected,
    /// Something outside the catalogue, and no gap seen.
    Overlooked,
    /// Something outside the catalogue, explained with confidence by something else.
    Seduced,
}

impl Outcome {
    /// Word in tables.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::Tied => "tied",
            Self::Partial => "partial",
            Self::Abstained => "abstained",
            Self::Misnamed => "misnamed",
            Self::Quiet => "quiet",
            Self::FalseAlarm => "false alarm",
            Self::Rejected => "rejected",
            Self::Overlooked => "overlooked",
            Self::Seduced => "explained falsely",
        }
    }

    /// Whether somebody acting on it would be led astray.
    #[must_use]
    pub const fn is_wrong(self) -> bool {
        matches!(self, Self::Misnamed | Self::FalseAlarm | Self::Seduced)
    }
}

/// More candidates than this, the named one included, and a tie no longer says anything: nothing was named.
pub const LARGEST_TIE: usize = 5;

/// One parameter compared with the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct ParameterScore {
    /// Effect.
    pub effect: &'static str,
    /// Parameter.
    pub name: &'static str,
    /// True value.
    pub truth: f64,
    /// Reported value.
    pub value: f64,
    /// Error over the true value.
    pub relative_error: f64,
    /// Error in reported standard errors; infinite where none is reported.
    pub in_std_errors: f64,
}

impl ParameterScore {
    /// Within 5 % or two standard errors.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.relative_error <= 0.05 || self.in_std_errors <= 2.0
    }

    /// Within the 95 % interval.
    #[must_use]
    pub fn is_covered(&self) -> bool {
        self.in_std_errors <= 1.96
    }
}

/// The score of one diagnosis.
#[derive(Clone, Debug, PartialEq)]
pub struct Score {
    /// How it did.
    pub outcome: Outcome,
    /// Parameters of causes that were named rightly.
    pub parameters: Vec<ParameterScore>,
    /// A hidden cause with a structural tie was named, and the tie was (or was not) declared.
    pub structural_tie_declared: Option<bool>,
    /// Worst ratio of extended error to noise floor over the channels, where both are reported.
    pub worst_floor_ratio: Option<f64>,
}

/// Scores an answer against the hidden causes.
#[must_use]
pub fn score(hidden: &[Cause], answer: &Answer) -> Score {
    Score {
        outcome: outcome(hidden, answer),
        parameters: parameters(hidden, answer),
        structural_tie_declared: structural_tie(hidden, answer),
        worst_floor_ratio: answer
            .holdout
            .iter()
            .filter(|channel| channel.noise_floor > 0.0)
            .map(|channel| channel.extended / channel.noise_floor)
            .filter(|ratio| ratio.is_finite())
            .reduce(f64::max),
    }
}

fn outcome(hidden: &[Cause], answer: &Answer) -> Outcome {
    if hidden.is_empty() {
        let quiet = answer.causes.is_empty() && answer.verdict == Verdict::NoGap;
        return if quiet { Outcome::Quiet } else { Outcome::FalseAlarm };
    }
    if hidden.iter().any(|cause| cause.effect().is_none()) {
        return match answer.verdict {
            Verdict::Explained => Outcome::Seduced,
            Verdict::NoGap => Outcome::Overlooked,
            // Whatever is named beside it is not there.
            Verdict::PartlyExplained | Verdict::Unexplained if !answer.causes.is_empty() => Outcome::Misnamed,
            Verdict::PartlyExplained | Verdict::Unexplained => Outcome::Rejected,
        };
    }
    if answer.causes.is_empty() {
        return Outcome::Abstained;
    }
    // covers[c][h]: cause c stands for hidden h.
    let covers = |by_tie: bool| -> Vec<Vec<bool>> {
        answer
            .causes
            .iter()
            .map(|named| {
                hidden
                    .iter()
                    .map(|cause| named.id == cause.id() || by_tie && named.ties.iter().any(|tie| tie == cause.id()))
                    .collect()
            })
            .collect()
    };
    let (count, all) = (answer.causes.len(), hidden.len());
    if matching(&covers(false)) == count && count == all {
        return Outcome::Exact;
    }
    if answer.causes.iter().any(|named| 1 + named.ties.len() > LARGEST_TIE) {
        // A list of suspects: right only if it names nobody else by itself.
        return if matching(&covers(true)) == count { Outcome::Abstained } else { Outcome::Misnamed };
    }
    match matching(&covers(true)) {
        matched if matched < count => Outcome::Misnamed,
        matched if matched == all => Outcome::Tied,
        _ => Outcome::Partial,
    }
}

/// Size of the largest set of pairs in which nobody appears twice (Kuhn's algorithm; the sets are tiny).
fn matching(covers: &[Vec<bool>]) -> usize {
    fn assign(row: usize, covers: &[Vec<bool>], seen: &mut [bool], owner: &mut [Option<usize>]) -> bool {
        for column in 0..owner.len() {
            if covers[row][column] && !seen[column] {
                seen[column] = true;
                let free = match owner[column] {
                    None => true,
                    Some(other) => assign(other, covers, seen, owner),
                };
                if free {
                    owner[column] = Some(row);
                    return true;
                }
            }
        }
        false
    }
    let columns = covers.first().map_or(0, Vec::len);
    let mut owner = vec![None; columns];
    (0..covers.len()).filter(|&row| assign(row, covers, &mut vec![false; columns], &mut owner)).count()
}

fn structural_tie(hidden: &[Cause], answer: &Answer) -> Option<bool> {
    let mut declared = None;
    for named in &answer.causes {
        let Some(effect) = Effect::from_id(&named.id) else { continue };
        for other in effect.structural_ties() {
            // Where neither is hidden, the name is wrong and the tie beside the point.
            if hidden.iter().filter_map(Cause::effect).any(|hidden| hidden == effect || hidden == other) {
                declared = Some(declared.unwrap_or(true) && named.ties.iter().any(|tie| tie == other.id()));
            }
        }
    }
    declared
}

fn parameters(hidden: &[Cause], answer: &Answer) -> Vec<ParameterScore> {
    let mut scores = Vec::new();
    for cause in hidden {
        let Cause::Catalogue(effect, values) = cause else { continue };
        let Some(named) = answer.causes.iter().find(|named| named.id == effect.id()) else { continue };
        for (place, (info, &truth)) in effect.info().parameters.iter().zip(values).enumerate() {
            // The parameters of a part that is absent mean nothing.
            let absent =
                |part: &&[usize]| part.contains(&place) && part.iter().take(1).all(|first| values[*first] == 0.0);
            if effect.identification().parts.iter().any(absent) {
                continue;
            }
            let Some(estimate) = named.parameters.iter().find(|estimate| estimate.name == info.name) else { continue };
            let factor = effect
                .identification()
                .stands_for
                .inherits_tolerance_of()
                .iter()
                .find_map(|key| answer.calibration.iter().find(|(name, _)| name == key))
                .map_or(1.0, |(_, ratio)| *ratio);
            let (value, std_error) = (estimate.value * factor, estimate.std_error * factor);
            let error = (value - truth).abs();
            scores.push(ParameterScore {
                effect: effect.id(),
                name: info.name,
                truth,
                value,
                relative_error: error / truth.abs(),
                in_std_errors: if std_error > 0.0 { error / std_error } else { f64::INFINITY },
            });
        }
    }
    scores
}
