//! The verdict in sentences, for the terminal and the top of the report.

use super::picture::balance_name;
use super::units::{estimate, quantity, with_error};
use diagnosis::{Balance, Calibration, Diagnosis, Gain, HoldOut, PerChannel, Standing};
use plant_model::Effect;
use report_html::Tone;
use rig_files::Verdict;
use std::fmt::Write as _;

/// What a technician calls an effect.
pub(crate) fn title(id: &str) -> String {
    Effect::from_id(id).map_or_else(|| id.to_string(), |effect| effect.info().title.to_string())
}

fn list(ids: &[String]) -> String {
    let titles: Vec<String> = ids.iter().map(|id| title(id)).collect();
    match titles.as_slice() {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} and {last}", most.join(", ")),
    }
}

/// The verdict in one sentence, and whether it is good news.
#[must_use]
pub fn headline(diagnosis: &Diagnosis) -> (Tone, String) {
    let causes: Vec<String> = diagnosis.causes.iter().map(|cause| cause.id.clone()).collect();
    let tied = diagnosis.causes.iter().any(|cause| !cause.ties.is_empty());
    let unsure = if tied { " (this log leaves an alternative open, see below)" } else { "" };
    match diagnosis.verdict {
        // One chamber's pressure and the position: only vented strokes were judged.
        Verdict::NoGap if diagnosis.balances.is_empty() => (
            Tone::Neutral,
            "Nothing is proven wrong, but little can be judged from this log: see what it says nothing about.".to_string(),
        ),
        Verdict::PartlyExplained if diagnosis.balances.is_empty() => (
            Tone::Caution,
            format!("As far as one pressure and the position allow: {}{unsure}. The rest cannot be judged.", list(&causes)),
        ),
        Verdict::NoGap if diagnosis.calibration.is_empty() && predicts(diagnosis) => {
            (Tone::Good, "No gap: the rig file predicts this log as well as its noise allows.".to_string())
        }
        Verdict::NoGap if diagnosis.calibration.iter().any(Calibration::is_strained) => (
            Tone::Caution,
            format!(
                "No gap that this log proves, but the rig file fits it only with values further off than their stated tolerance \
                 makes likely: check {}.",
                list(&strained(diagnosis))
            ),
        ),
        Verdict::NoGap if !predicts(diagnosis) => (
            Tone::Good,
            "No gap: with values that their stated tolerance makes likely, every equation of the rig file holds on this log to \
             within its noise."
                .to_string(),
        ),
        Verdict::NoGap => (
            Tone::Good,
            "No gap: with values that their stated tolerance makes likely, the rig file predicts this log as well as its noise \
             allows."
                .to_string(),
        ),
        Verdict::Explained => (Tone::Caution, format!("The gap is explained: {}{unsure}.", list(&causes))),
        Verdict::PartlyExplained => (
            Tone::Bad,
            format!("The gap is partly explained: {}{unsure}; a significant rest has no known cause.", list(&causes)),
        ),
        Verdict::Unexplained if is_small_rest(diagnosis) => (
            Tone::Caution,
            "A small rest has no known cause: the adjusted rig predicts as well as noise allows, but its balances err by a little \
             more. No cause is named, because a wrong name would be worse than none."
                .to_string(),
        ),
        Verdict::Unexplained => (
            Tone::Bad,
            "There is a gap, and no known cause explains it. No cause is \
             named, because a wrong name would be worse than none."
                .to_string(),
        ),
    }
}

/// Whether the whole model predicts the part held back as well as noise allows; true where nothing tells.
fn predicts(diagnosis: &Diagnosis) -> bool {
    diagnosis.gain.as_ref().is_none_or(Gain::closed)
}

/// What is to be said of predictions that err beyond noise although every balance errs like noise.
pub(crate) fn sensitive(diagnosis: &Diagnosis) -> Option<String> {
    let gain = diagnosis.gain.filter(|gain| !gain.closed())?;
    matches!(diagnosis.verdict, Verdict::NoGap | Verdict::Explained).then(|| {
        format!(
            "Each balance errs like noise, yet predictions {:.0} ms ahead err {:.1} times as much as noise alone would make them. \
             They depend on values that this log tells poorly, as the friction that holds a resting piston: a longer log tells more.",
            gain.horizon_s * 1e3,
            gain.worst_ratio
        )
    })
}

/// What is to be said of a measured supply that is no constant.
pub(crate) fn supply_varies(diagnosis: &Diagnosis) -> Option<String> {
    let supply = diagnosis.balances.iter().find(|balance| balance.varies_by_itself())?;
    Some(format!(
        "The measured supply varies by itself, and not with the flow drawn: as a constant it has {:.1} times the misfit of noise. The \
         chambers are fed with it as measured, so that it is no gap of the model.",
        supply.extended_misfit
    ))
}

/// Whether what is left is below [`SMALL`] in every balance, and the whole model predicts the part held back as well as noise allows.
fn is_small_rest(diagnosis: &Diagnosis) -> bool {
    let small = diagnosis.balances.iter().all(|balance| balance.extended_misfit < SMALL);
    small && diagnosis.gain.as_ref().is_some_and(Gain::closed)
}

/// Below this misfit, in times noise, a balance errs by little: its errors are told by being no white noise.
const SMALL: f64 = 1.5;

/// A balance that noise does not explain, and by how much.
fn open_balance(balance: &Balance) -> String {
    let name = balance_name(balance.channel);
    if balance.extended_misfit < SMALL {
        return format!("the {name} ({:.2} times the misfit of noise, and not white)", balance.extended_misfit);
    }
    format!("the {name} with {:.1} times the misfit of noise", balance.extended_misfit)
}

/// How far a nominal value was corrected, compared with its tolerance.
pub(crate) fn how_far(value: &Calibration) -> String {
    match value.tolerances() {
        times if times <= 1.0 => "within its stated tolerance".to_string(),
        times => format!("{times:.1} times its stated tolerance"),
    }
}

/// The names of values that are further off than their tolerance makes likely, farthest first, three at most.
fn strained(diagnosis: &Diagnosis) -> Vec<String> {
    let strained = diagnosis.calibration.iter().filter(|value| value.is_strained());
    farthest_first(strained).into_iter().take(3).map(|value| value.name.clone()).collect()
}

fn farthest_first<'a>(values: impl Iterator<Item = &'a Calibration>) -> Vec<&'a Calibration> {
    let mut values: Vec<_> = values.collect();
    values.sort_by(|a, b| b.tolerances().total_cmp(&a.tolerances()));
    values
}

/// The adjusted values, farthest off first, but the points of the table of the opening, and of those how many there are and the farthest.
pub(crate) fn adjusted(diagnosis: &Diagnosis) -> (Vec<&Calibration>, Option<(usize, &Calibration)>) {
    let (points, values): (Vec<_>, Vec<_>) = diagnosis.calibration.iter().partition(|value| value.is_opening_point());
    let farthest = points.iter().max_by(|a, b| a.tolerances().total_cmp(&b.tolerances()));
    (farthest_first(values.into_iter()), farthest.map(|farthest| (points.len(), *farthest)))
}

/// A correction in percent; `None` where the nominal value is zero.
pub(crate) fn percent(value: &Calibration) -> Option<String> {
    value.relative().map(|relative| format!("{:+.1} %", 100.0 * relative))
}

/// A correction in percent and in tolerances.
fn correction(value: &Calibration) -> String {
    percent(value).into_iter().chain([how_far(value)]).collect::<Vec<_>>().join(", ")
}

/// Share of the avoidable error that is gone: 1 when the extended rig predicts as well as noise allows; `None` where
/// there is nothing to close.
pub(crate) fn closed(baseline: f64, extended: f64, floor: f64) -> Option<f64> {
    let gap = baseline - floor;
    // A gap of a twentieth of the floor is none.
    (gap > 0.05 * floor).then(|| ((baseline - extended) / gap).clamp(-9.99, 1.0))
}

/// The prediction errors of one channel in words.
pub(crate) struct Errors {
    /// The channel.
    pub(crate) name: &'static str,
    /// Of the rig file as given, of the extended rig, and from noise alone, with their unit.
    pub(crate) quantities: [String; 3],
    /// See [`closed`].
    pub(crate) closed: Option<f64>,
}

/// The errors of a gain, channel by channel.
pub(crate) fn errors(gain: &Gain) -> impl Iterator<Item = Errors> {
    type Predicted = (&'static str, &'static str, fn(&PerChannel) -> Option<f64>);
    const CHANNELS: [Predicted; 3] = [
        ("position", "y_m", |channel| channel.y_m),
        ("pressure A", "p_a_pa", |channel| channel.p_a_pa),
        ("pressure B", "p_b_pa", |channel| channel.p_b_pa),
    ];
    let HoldOut { baseline_rmse, extended_rmse, noise_floor } = gain.holdout;
    CHANNELS.into_iter().filter_map(move |(name, key, get)| {
        let [baseline, extended, floor] = [get(&baseline_rmse)?, get(&extended_rmse)?, get(&noise_floor)?];
        let quantities = [baseline, extended, floor].map(|error| quantity(key, error));
        Some(Errors { name, quantities, closed: closed(baseline, extended, floor) })
    })
}

/// Everything a technician needs on the terminal.
#[must_use]
pub fn summary(diagnosis: &Diagnosis) -> String {
    let mut text = format!("{}\n", headline(diagnosis).1);
    // Writing to a String cannot fail.
    for (place, cause) in diagnosis.causes.iter().enumerate() {
        let _ = writeln!(text, "\n{}. {} ({})", place + 1, title(&cause.id), cause.id);
        let _ = writeln!(text, "   {}", cause.evidence);
        for p in &cause.parameters {
            let _ = writeln!(text, "   {} = {}", p.name, estimate(&cause.id, p));
        }
        if !cause.ties.is_empty() {
            let _ = writeln!(text, "   This log cannot tell it from: {}.", list(&cause.ties));
        }
    }
    let open: Vec<String> = diagnosis.balances.iter().filter(|balance| !balance.closed).map(open_balance).collect();
    if !open.is_empty() {
        let _ = writeln!(text, "\nWhat shows the rest: {}.", open.join(", "));
    }
    for lead in &diagnosis.leads {
        let _ = writeln!(text, "\nA lead, not a proven cause: {} ({}).", title(&lead.id), lead.id);
        let _ = writeln!(text, "   {}", lead.evidence);
    }
    let working = diagnosis.extension.iter().filter(|effect| effect.standing == Standing::WorkingHypothesis);
    let working: Vec<String> = working.map(|effect| effect.id.clone()).collect();
    if !working.is_empty() {
        let _ = writeln!(
            text,
            "\nThe extended rig has these working hypotheses, because it predicts better with them: {}.",
            list(&working)
        );
    }
    if let Some(description) = &diagnosis.description {
        let words: Vec<&str> = description.terms.iter().map(|term| term.words).collect();
        let _ = writeln!(text, "\nThe model lacks a term like {}: a description, not a cause.", words.join(", and "));
    }
    let (values, points) = adjusted(diagnosis);
    for value in values {
        let to = with_error(&value.name, value.value, value.std_error);
        let from = quantity(&value.name, value.nominal);
        let _ = writeln!(text, "\nAdjusted: {} from {from} to {to} ({})", value.name, correction(value));
    }
    if let Some((count, farthest)) = points {
        let (from, to) = (farthest.nominal, farthest.value);
        let far = correction(farthest);
        let _ = writeln!(
            text,
            "\nAdjusted: points of valve.opening, {count} in all, the farthest from {from:.3} to {to:.3} ({far})"
        );
    }
    if let Some(gain) = &diagnosis.gain {
        let _ =
            writeln!(text, "\nPrediction error {:.0} ms ahead, on data held back from the fit:", gain.horizon_s * 1e3);
        for Errors { name, quantities: [before, after, floor], closed } in errors(gain) {
            let share = match closed {
                None => "nothing to close".to_owned(),
                Some(share) if errs_more(share) => "it errs more".to_owned(),
                Some(share) => format!("{:.0} % closed", 100.0 * share),
            };
            let _ = writeln!(text, "  {name:<10}  {before} before, {after} after, {floor} from noise alone: {share}");
        }
    }
    for remark in [supply_varies(diagnosis), sensitive(diagnosis)].into_iter().flatten() {
        let _ = writeln!(text, "\n{remark}");
    }
    if let Some(next) = &diagnosis.next_experiment {
        let _ = writeln!(text, "\nNext: {next}");
    }
    text
}

/// Whether a share of the gap that is closed means that the extended rig errs more than the one as given.
pub(super) fn errs_more(share: f64) -> bool {
    share <= -0.005
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_gap_below_zero_is_more_error_unless_it_rounds_to_nothing() {
        assert!(errs_more(-7.26) && errs_more(-0.01) && !errs_more(-0.001) && !errs_more(0.4));
    }

    #[test]
    fn an_adjustment_is_told_in_units_of_its_tolerance() {
        let at =
            |value| Calibration { name: "load.mass_kg".into(), nominal: 10.0, value, std_error: 0.01, tolerance: 0.2 };
        assert_eq!(how_far(&at(9.85)), "within its stated tolerance");
        assert_eq!(how_far(&at(10.62)), "3.1 times its stated tolerance");
        assert!(at(10.62).is_strained() && !at(10.4).is_strained());
    }
}
