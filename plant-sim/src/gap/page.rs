//! The report: what a technician reads in a minute, and below it everything else.

use super::apply::Applied;
use super::picture::{Scene, balance_name};
use super::units::{estimate, quantity, significant, with_error};
use super::words::{Errors, adjusted, errors, errs_more, headline, how_far, percent, sensitive, supply_varies, title};
use crate::charts::{BAR, MM, scaled};
use diagnosis::{Calibration, Cause, Channel, Diagnosis, Standing};
use report_html::{Block, Page, Plot, Series, Table, Tone};
use rig_files::{RigFile, Verdict};

/// Where the material came from.
#[derive(Clone, Debug)]
pub struct Source<'a> {
    /// The rig as given.
    pub rig: &'a RigFile,
    /// Its file.
    pub rig_file: String,
    /// The log's file.
    pub log_file: String,
    /// What looked suspicious about the log.
    pub warnings: Vec<String>,
    /// The closed loop before and after, if asked for.
    pub applied: Option<Applied>,
}

/// Seconds of held-back data shown at first; the rest is a zoom away.
const OVERLAY_S: f64 = 2.0;

/// A spectrum with no higher peak, over that of noise, is flat: the highest of several hundred values.
const PLAIN_PEAK: f64 = 2.5;

/// The report of a diagnosis.
#[must_use]
pub fn page(diagnosis: &Diagnosis, source: &Source<'_>) -> Page {
    let mut page = Page::new(format!("Diagnosis of {}", source.rig.name));
    let (tone, sentence) = headline(diagnosis);
    page.callout(tone, sentence);
    for warning in &source.warnings {
        page.callout(Tone::Caution, format!("Check the log first: {warning}"));
    }
    let scene = Scene::new(diagnosis, source.rig);
    for (place, cause) in diagnosis.causes.iter().enumerate() {
        page.section(format!("{}. {}", place + 1, title(&cause.id)));
        describe(&mut page, cause);
        page.plots(scene.of_cause(&cause.id));
    }
    rest(&mut page, diagnosis, &scene);
    gain(&mut page, diagnosis);
    if let Some(applied) = &source.applied {
        applied.write(&mut page);
    }
    next(&mut page, diagnosis);
    extension(&mut page, diagnosis);
    calibration(&mut page, diagnosis);
    unjudged(&mut page, diagnosis);
    log_quality(&mut page, diagnosis);
    everywhere(&mut page, diagnosis, &scene);
    appendix(&mut page, diagnosis);
    page.section("How to repeat it");
    page.block(Block::Code(format!(
        "plant-sim diagnose --rig {} --log {} --out DIR",
        source.rig_file, source.log_file
    )));
    page
}

fn describe(page: &mut Page, cause: &Cause) {
    page.text(cause.evidence.clone());
    let mut table = Table::new(["value found", "with its standard error"]);
    for p in &cause.parameters {
        table.row([format!("`{}`", p.name), estimate(&cause.id, p)]);
    }
    page.table(table);
    if !cause.ties.is_empty() {
        let ties: Vec<String> = cause.ties.iter().map(|id| format!("{} (`{id}`)", title(id))).collect();
        page.callout(
            Tone::Caution,
            format!("This log cannot tell it from: {}. Only another recording can separate them.", ties.join(", ")),
        );
    }
}

/// What no named cause explains: the open balances, and the leads.
fn rest(page: &mut Page, diagnosis: &Diagnosis, scene: &Scene<'_>) {
    let open: Vec<_> = diagnosis.balances.iter().filter(|balance| !balance.closed).collect();
    let whole = diagnosis.gain.filter(|gain| !gain.closed());
    let said = !open.is_empty() || !diagnosis.leads.is_empty() || diagnosis.description.is_some() || whole.is_some();
    if !said || !matches!(diagnosis.verdict, Verdict::Unexplained | Verdict::PartlyExplained) {
        return;
    }
    page.section("What stays unexplained");
    if let (true, Some(whole)) = (open.is_empty(), whole) {
        page.text(format!(
            "Each balance by itself comes close to noise, but the whole model, restarted from the measurement, still errs \
             {:.1} times as much as noise alone would make it: see the predictions below.",
            whole.worst_ratio
        ));
    }
    for balance in open {
        let share = 100.0 * (1.0 - balance.extended_misfit / balance.nominal_misfit);
        page.text(format!(
            "The {} stays open: its misfit is {:.1} times that of noise{}. It depends most on what is drawn here.",
            balance_name(balance.channel),
            balance.extended_misfit,
            if share > 1.0 { format!(", {share:.0} % less than with the rig file as given") } else { String::new() }
        ));
        page.plots(scene.of_rest(balance.channel));
    }
    if let Some(description) = &diagnosis.description {
        let taken = 100.0 * description.holdout_share;
        page.text(format!(
            "A description, not a cause: on the part of the log held back, these terms together {} of the misfit of the \
             balances they act on.",
            if taken >= 0.0 { format!("take away {taken:.0} %") } else { "take away nothing".to_string() }
        ));
        let mut table = Table::new(["balance", "missing term", "in closed form", "c"]);
        for term in &description.terms {
            let balances: Vec<&str> = term.channels.iter().map(|channel| balance_name(*channel)).collect();
            table.row([
                balances.join(", "),
                term.words.to_string(),
                term.formula.clone(),
                format!("{:.3} ± {:.3}", term.factor, term.std_error),
            ]);
        }
        page.table(table);
    }
    if !diagnosis.leads.is_empty() {
        page.text(
            "These effects lower the misfit, but they are not proven causes. They are leads: the true cause may act \
             in a similar way.",
        );
        let mut table = Table::new(["resembles", "as"]);
        for lead in &diagnosis.leads {
            table.row([title(&lead.id), lead.evidence.clone()]);
        }
        page.table(table);
    }
}

fn gain(page: &mut Page, diagnosis: &Diagnosis) {
    page.section("How much better the prediction gets");
    let Some(gain) = &diagnosis.gain else {
        page.text(
            "Full predictions need the valve command and both chamber pressures; this log lacks some of them, so only the \
             single balances were judged.",
        );
        return balances(page, diagnosis);
    };
    let mut table = Table::new(["", "rig file as given", "extended rig", "noise alone", "share of the gap closed"]);
    for Errors { name, quantities: [before, after, floor], closed } in errors(gain) {
        let share = match closed {
            None => "no gap".to_owned(),
            Some(share) if errs_more(share) => "none: it errs more".to_owned(),
            Some(share) => format!("{:.0} %", 100.0 * share),
        };
        table.row([name.to_string(), before, after, floor, share]);
    }
    page.table(table.caption(format!(
        "Root-mean-square error of predictions {:.0} ms ahead, restarted from the measured state, on parts of the log that \
         were kept back: neither choice nor fit has seen them.",
        gain.horizon_s * 1e3
    )));
    for remark in [supply_varies(diagnosis), sensitive(diagnosis)].into_iter().flatten() {
        page.text(remark);
    }
    horizons(page, diagnosis);
    page.plots(overlays(diagnosis));
    balances(page, diagnosis);
}

/// The gain for other horizons: what grows with the horizon is a wrong rate, what does not is a wrong reading.
fn horizons(page: &mut Page, diagnosis: &Diagnosis) {
    if diagnosis.horizons.is_empty() {
        return;
    }
    let mut table = Table::new(["ahead", "", "rig file as given", "extended rig", "noise alone"]);
    for gain in &diagnosis.horizons {
        let mut ahead = format!("{:.0} ms", gain.horizon_s * 1e3);
        for Errors { name, quantities: [before, after, floor], .. } in errors(gain) {
            table.row([std::mem::take(&mut ahead), name.to_string(), before, after, floor]);
        }
    }
    page.table(table.caption(
        "The same for other horizons. An error that grows with the horizon is that of a rate, one that does not is that of \
         a reading.",
    ));
}

fn balances(page: &mut Page, diagnosis: &Diagnosis) {
    if diagnosis.balances.is_empty() {
        return;
    }
    let mut table = Table::new(["balance", "misfit before", "misfit after", "long-run variance", ""]);
    for balance in &diagnosis.balances {
        table.row([
            balance_name(balance.channel).to_string(),
            format!("{:.2}", balance.nominal_misfit),
            format!("{:.2}", balance.extended_misfit),
            format!("{:.1}", balance.remaining_dispersion),
            if balance.closed { "closed: like noise" } else { "open: more than noise" }.to_string(),
        ]);
    }
    page.table(table.caption(
        "Each balance by itself, in multiples of what noise alone would give (1 is perfect). A long-run variance above 1 means \
         that the remaining errors are correlated.",
    ));
}

/// Measurement and both predictions, opened where the rig file as given errs most.
fn overlays(diagnosis: &Diagnosis) -> Vec<Plot> {
    let overlay = &diagnosis.evidence.overlay;
    let t = &overlay.t_s;
    if t.len() < 2 {
        return Vec::new();
    }
    let from = worst(diagnosis);
    let broken = |values: &[f64], factor: f64| broken_at_gaps(t, values, factor);
    let names = [("Position", "y, mm", MM), ("Pressure A", "p_a, bar", BAR), ("Pressure B", "p_b, bar", BAR)];
    let plots = names.iter().enumerate().map(|(channel, (title, label, factor))| {
        Plot::new(format!("{title}: predicted before and after"), "time, s", *label)
            .with(Series::line("measured", t.clone(), broken(&overlay.measured[channel], *factor)).colour(0))
            .with(Series::line("rig file as given", t.clone(), broken(&overlay.baseline[channel], *factor)).colour(1))
            .with(
                Series::line("extended rig", t.clone(), broken(&overlay.extended[channel], *factor)).colour(2).dashed(),
            )
            .cursor_group("held back")
            .x_range(from, from + OVERLAY_S)
            .height_px(280)
    });
    let errors = names.iter().enumerate().map(|(channel, (title, label, factor))| {
        let error = |predicted: &[f64]| -> Vec<f64> {
            let pairs = overlay.measured[channel].iter().zip(predicted);
            broken(&pairs.map(|(m, p)| m - p).collect::<Vec<_>>(), *factor)
        };
        let unit = label.rsplit(' ').next().unwrap_or_default();
        Plot::new(format!("{title}: measured − predicted"), "time, s", format!("error, {unit}"))
            .with(Series::line("rig file as given", t.clone(), error(&overlay.baseline[channel])).colour(1))
            .with(Series::line("extended rig", t.clone(), error(&overlay.extended[channel])).colour(2))
            .cursor_group("held back")
            .x_range(from, from + OVERLAY_S)
            .height_px(220)
    });
    let mut plots: Vec<Plot> = plots.zip(errors).flat_map(|(plot, error)| [plot, error]).collect();
    if let Some(first) = plots.first_mut() {
        first.note = format!(
            "Held-back data where the rig file errs most; every prediction starts anew from the measurement after {:.0} ms. \
             Double-click for all of it.",
            diagnosis.gain.map_or(200.0, |gain| gain.horizon_s * 1e3)
        );
    }
    plots
}

/// A line must not bridge the part of the log that was used for fitting.
fn broken_at_gaps(t_s: &[f64], values: &[f64], factor: f64) -> Vec<f64> {
    let usual = t_s.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min).max(1e-6);
    let mut out = scaled(values, factor);
    for (k, pair) in t_s.windows(2).enumerate() {
        if pair[1] - pair[0] > 10.0 * usual {
            out[k] = f64::NAN;
        }
    }
    out
}

/// The start of the part where the nominal prediction errs most over [`OVERLAY_S`].
fn worst(diagnosis: &Diagnosis) -> f64 {
    let overlay = &diagnosis.evidence.overlay;
    let mut scale = [0.0_f64; 3];
    for (channel, scale) in scale.iter_mut().enumerate() {
        let errors = overlay.measured[channel].iter().zip(&overlay.baseline[channel]).map(|(m, b)| (m - b).powi(2));
        *scale = errors.sum::<f64>() / overlay.t_s.len() as f64;
    }
    let error = |k: usize| -> f64 {
        (0..3).map(|c| (overlay.measured[c][k] - overlay.baseline[c][k]).powi(2) / scale[c].max(1e-30)).sum()
    };
    let (mut best, mut start, mut sum) = ((0.0, overlay.t_s[0]), 0, 0.0);
    for end in 0..overlay.t_s.len() {
        sum += error(end);
        while overlay.t_s[end] - overlay.t_s[start] > OVERLAY_S {
            sum -= error(start);
            start += 1;
        }
        if sum > best.0 {
            best = (sum, overlay.t_s[start]);
        }
    }
    best.1
}

fn next(page: &mut Page, diagnosis: &Diagnosis) {
    if let Some(next) = &diagnosis.next_experiment {
        page.section("What to record next");
        page.text(next.clone());
    }
}

/// What `extended-rig.toml` has beyond the rig file, where that is more than the named causes.
fn extension(page: &mut Page, diagnosis: &Diagnosis) {
    if diagnosis.extension.iter().all(|effect| effect.standing != Standing::WorkingHypothesis) {
        return;
    }
    page.section("What the extended rig has");
    let mut table = Table::new(["effect", "stands as", "value", "misfit taken away"]);
    for effect in &diagnosis.extension {
        let values = effect.parameters.iter().map(|p| format!("{} {}", p.name, estimate(&effect.id, p)));
        table.row([
            title(&effect.id),
            effect.standing.words().to_string(),
            values.collect::<Vec<_>>().join(", "),
            effect.gain.map_or("not known".to_string(), |gain| format!("{:.0} %", 100.0 * gain)),
        ]);
    }
    page.table(table.caption(
        "The extended rig is the model that predicts best, not a list of causes: a working hypothesis lowers the error on the \
         part of the log held back, but something else may be behind it. The last column: the share of the misfit, in the \
         balances it acts on, that returns there without it.",
    ));
}

fn calibration(page: &mut Page, diagnosis: &Diagnosis) {
    if diagnosis.calibration.is_empty() {
        return;
    }
    page.section("Nominal values adjusted");
    let mut table = Table::new(["value", "rig file", "adjusted", "by", "which is"]);
    let (values, points) = adjusted(diagnosis);
    let mut row = |name: String, value: &Calibration| {
        table.row([
            name,
            quantity(&value.name, value.nominal),
            with_error(&value.name, value.value, value.std_error),
            percent(value).unwrap_or_default(),
            how_far(value),
        ]);
    };
    for value in values {
        row(format!("`{}`", value.name), value);
    }
    if let Some((count, farthest)) = points {
        row(format!("`{}`, the farthest of {count} points", farthest.name), farthest);
    }
    page.table(table.caption(
        "Adjustments, not causes: a tolerance is a standard error, so one value in three is farther off than its own, and \
         hardly any by more than three times as much.",
    ));
}

fn unjudged(page: &mut Page, diagnosis: &Diagnosis) {
    page.section("What this log cannot tell");
    let has = &diagnosis.log.available;
    let columns = [
        (has.command, "`u_v` was not measured: valve and air balances could not be judged."),
        (
            has.pressure_a,
            "`p_a_pa` was not measured: neither the air balance of A nor the force balance could be judged.",
        ),
        (
            has.pressure_b,
            "`p_b_pa` was not measured: neither the air balance of B nor the force balance could be judged.",
        ),
        (has.supply, "`p_sup_pa` was not measured: a drooping supply looks like a smaller fill coefficient."),
    ];
    let mut items: Vec<String> =
        columns.iter().filter(|(has, _)| !has).map(|(_, sentence)| (*sentence).to_string()).collect();
    let moves =
        diagnosis.balances.is_empty() || diagnosis.balances.iter().any(|balance| balance.channel == Channel::Position);
    if has.pressure_a && has.pressure_b && !moves {
        items.push("The piston hardly moved: mechanics and friction could not be judged.".to_string());
    }
    if !diagnosis.not_identifiable.is_empty() {
        let keys: Vec<String> = diagnosis.not_identifiable.iter().map(|key| format!("`{key}`")).collect();
        items.push(format!("Values and effects this recording does not excite: {}.", keys.join(", ")));
    }
    if items.is_empty() {
        items.push("Every balance could be judged, and every effect would have shown.".to_string());
    }
    page.block(Block::List(items));
}

fn log_quality(page: &mut Page, diagnosis: &Diagnosis) {
    page.section("The log");
    let q = &diagnosis.log.quality;
    page.text(format!(
        "{} usable samples, usually {} ms apart (irregular by {:.1} %); {} interruption{}, {} row{} left out because a \
         field was blank{}{}. Nothing is interpolated.",
        q.samples,
        significant(q.interval_s * 1e3, 3),
        100.0 * q.jitter,
        q.interruptions,
        if q.interruptions == 1 { "" } else { "s" },
        q.blank_rows,
        if q.blank_rows == 1 { "" } else { "s" },
        match q.isolated_readings {
            0 => String::new(),
            1 => " or for a single reading far from all its neighbours".into(),
            count => format!(" or for one of {count} readings far from all their neighbours"),
        },
        match q.repeated_readings {
            0 => String::new(),
            count => format!(" or for one of {count} readings that only repeat the one before"),
        },
    ));
    let mut table = Table::new(["channel", "noise (standard deviation)", "smallest step"]);
    let has = &diagnosis.log.available;
    for (name, key, measured, noise) in [
        ("position", "_m", true, &q.position),
        ("pressure A", "_pa", has.pressure_a, &q.pressure_a),
        ("pressure B", "_pa", has.pressure_b, &q.pressure_b),
        ("supply", "_pa", has.supply, &q.supply),
    ] {
        if measured {
            let step = if noise.resolution > 0.0 { quantity(key, noise.resolution) } else { "none seen".to_string() };
            table.row([name.to_string(), quantity(key, noise.standard_deviation), step]);
        }
    }
    page.table(table.caption("Estimated from the log itself."));
}

/// Every balance against every quantity, folded away.
fn everywhere(page: &mut Page, diagnosis: &Diagnosis, scene: &Scene<'_>) {
    for balance in &diagnosis.balances {
        let plots = scene.everywhere(balance.channel);
        if plots.is_empty() {
            continue;
        }
        page.details(format!("Appendix: where the {} errs", balance_name(balance.channel)), |page| {
            let shares: Vec<String> = balance
                .depends_on
                .iter()
                .map(|d| format!("`{}` {:.0} % ({:.0} %)", d.quantity, 100.0 * d.nominal, 100.0 * d.extended))
                .collect();
            page.text(format!(
                "Share of the variance of the errors that goes with each quantity, before and (in brackets) after: {}. \
                 Shares overlap, because quantities move together; 1 % is chance.",
                shares.join(", ")
            ));
            if let Some(peak) = &balance.peak {
                page.text(if peak.nominal < PLAIN_PEAK {
                    "Over frequency they are no stronger than noise anywhere.".to_string()
                } else {
                    format!(
                        "They are strongest at {:.1} Hz: {:.1} times the noise there before, {:.1} times after.",
                        peak.hz, peak.nominal, peak.extended
                    )
                });
            }
            page.plots(plots);
        });
    }
}

fn appendix(page: &mut Page, diagnosis: &Diagnosis) {
    if diagnosis.hypotheses.is_empty() {
        return;
    }
    let mut table = Table::new(["effects", "misfit", "above the best", "fitted"]);
    let best = diagnosis.hypotheses.first().map_or(0.0, |best| best.cost);
    for hypothesis in &diagnosis.hypotheses {
        let name = if hypothesis.effects.is_empty() {
            "none: the rig file as given".into()
        } else {
            hypothesis.effects.join(" + ")
        };
        table.row([
            name,
            format!("{:.1}", hypothesis.cost),
            format!("{:.1}", hypothesis.cost - best),
            if hypothesis.fitted { "in full" } else { "to first order" }.to_string(),
        ]);
    }
    let table = table.caption(
        "Minus log-likelihood of the fitted part of the log, the tolerances of nominal values included. A difference of 10 \
         and more is beyond doubt for one parameter.",
    );
    page.details("Appendix: all hypotheses tried and their scores", |page| {
        page.table(table);
    });
}
