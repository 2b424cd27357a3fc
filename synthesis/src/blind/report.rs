//! Tables of a suite: rates, parameters, confusion matrix, the cases that failed, and one CSV line per case.

use super::plan::{Class, Nominal};
use super::run::Entry;
use super::score::Outcome;
use super::tally::{Rate, Tally};
use crate::cause::Cause;
use crate::foreign::Foreign;
use plant_model::Effect;
use rig_files::Verdict;
use std::fmt::Write as _;

/// The whole result as Markdown. `command` is what reproduces it; of `planned` cases these are the ones that ran.
#[must_use]
pub fn markdown(entries: &[Entry], planned: usize, command: &str) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write(&mut text, entries, planned, command);
    text
}

fn write(text: &mut String, entries: &[Entry], planned: usize, command: &str) -> std::fmt::Result {
    writeln!(text, "# Blind tests of the diagnosis\n")?;
    writeln!(
        text,
        "{} cases, drawn at random and kept from the diagnosis, which sees the rig file and the log alone. Reproduce with\n\n    {command}\n",
        entries.len()
    )?;
    if entries.len() < planned {
        writeln!(
            text,
            "**{} of {planned} cases have run; the suite was interrupted or is still running.**\n",
            entries.len()
        )?;
    }
    writeln!(text, "A single case is replayed with `plant-sim blind --case CASE`, the case as named below.\n")?;
    naming(text, entries)?;
    silence(text, entries)?;
    figures(text, entries)?;
    by_effect(text, entries)?;
    breakdown(text, entries)?;
    confusion(text, entries)?;
    failures(text, entries)
}

fn percent(rate: Rate) -> String {
    if rate.of == 0 {
        return "–".into();
    }
    let (low, high) = rate.interval();
    format!("{:.1} % ({:.0}–{:.0})", 100.0 * rate.share(), 100.0 * low, 100.0 * high)
}

fn groups(entries: &[Entry]) -> Vec<(Class, Nominal, Vec<&Entry>)> {
    let mut groups = Vec::new();
    for class in Class::ALL {
        for nominal in Nominal::ALL {
            let of: Vec<&Entry> =
                entries.iter().filter(|e| e.plan.class == class && e.plan.nominal == nominal).collect();
            if !of.is_empty() {
                groups.push((class, nominal, of));
            }
        }
    }
    groups
}

fn naming(text: &mut String, entries: &[Entry]) -> std::fmt::Result {
    let wanted = |class: &Class| !matches!(class, Class::Null | Class::Unknown);
    let groups: Vec<_> = groups(entries).into_iter().filter(|(class, ..)| wanted(class)).collect();
    if groups.is_empty() {
        return Ok(());
    }
    writeln!(text, "## Effects of the catalogue\n")?;
    writeln!(
        text,
        "*Exact*: the hidden causes and no other. *With ties*: as many causes, each hidden or declared tied with a hidden one \
         (at most four ties). *Failed*: no answer, as for a log whose columns make no balance. Intervals are 95 % (Wilson).\n"
    )?;
    writeln!(
        text,
        "| class | nominal | cases | exact | with ties | partial | abstained | misnamed or alarm | failed |"
    )?;
    writeln!(text, "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")?;
    for (class, nominal, of) in groups {
        let tally = Tally::of(of.iter().copied());
        // A poor experiment may hide nothing; silence is then right.
        let exact = tally.rate(&[Outcome::Exact, Outcome::Quiet]);
        let tied = tally.rate(&[Outcome::Exact, Outcome::Quiet, Outcome::Tied]);
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {} | {} |",
            class.word(),
            nominal.word(),
            tally.len(),
            percent(exact),
            percent(tied),
            tally.rate(&[Outcome::Partial]).hits,
            tally.rate(&[Outcome::Abstained]).hits,
            percent(tally.rate(&[Outcome::Misnamed, Outcome::FalseAlarm])),
            tally.failed()
        )?;
    }
    writeln!(text)
}

fn silence(text: &mut String, entries: &[Entry]) -> std::fmt::Result {
    let groups: Vec<_> =
        groups(entries).into_iter().filter(|(class, ..)| matches!(class, Class::Null | Class::Unknown)).collect();
    if groups.is_empty() {
        return Ok(());
    }
    writeln!(text, "## Nothing hidden, and effects outside the catalogue\n")?;
    writeln!(
        text,
        "*Right*: `no-gap` for a null log; `unexplained` or `partly-explained` for an effect that has no name. *Overlooked*: \
         `no-gap` where there is one. *Wrong*: a claim on a null log; a name, whatever the verdict, that is not the cause.\n"
    )?;
    writeln!(text, "| class | nominal | cases | right | overlooked | wrong | failed |")?;
    writeln!(text, "| --- | --- | ---: | ---: | ---: | ---: | ---: |")?;
    for (class, nominal, of) in groups {
        let tally = Tally::of(of.iter().copied());
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} |",
            class.word(),
            nominal.word(),
            tally.len(),
            percent(tally.rate(&[Outcome::Quiet, Outcome::Rejected])),
            tally.rate(&[Outcome::Overlooked]).hits,
            percent(tally.rate(&[Outcome::FalseAlarm, Outcome::Seduced, Outcome::Misnamed])),
            tally.failed()
        )?;
    }
    writeln!(text)
}

fn figures(text: &mut String, entries: &[Entry]) -> std::fmt::Result {
    writeln!(text, "## Parameters, hold-out, time\n")?;
    writeln!(
        text,
        "Parameters of rightly named causes: within 5 % or two reported standard errors; inside the reported 95 % interval; median \
         relative error. Hold-out: the worst channel within 1.3 of the noise floor. *Ties*: named causes that carry any; \
         structural ties declared where they must be. *Doubted*: right, but not with the verdict `explained`.\n"
    )?;
    writeln!(
        text,
        "| class | nominal | parameters good | in interval | median error | hold-out ≤ 1.3 | ties | structural | doubted | time median | worst |"
    )?;
    writeln!(text, "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")?;
    for (class, nominal, of) in groups(entries) {
        let tally = Tally::of(of.iter().copied());
        let error = tally.median_parameter_error();
        let structural = tally.structural_ties();
        writeln!(
            text,
            "| {} | {} | {} | {} | {} | {} | {} | {}/{} | {} | {:.2} s | {:.2} s |",
            class.word(),
            nominal.word(),
            percent(tally.parameters_good()),
            percent(tally.parameters_covered()),
            if error.is_nan() { "–".into() } else { format!("{:.2} %", 100.0 * error) },
            percent(tally.at_floor(1.3)),
            percent(tally.tied_names()),
            structural.hits,
            structural.of,
            tally.doubted(),
            tally.seconds(0.5),
            tally.seconds(1.0)
        )?;
    }
    writeln!(text)
}

fn by_effect(text: &mut String, entries: &[Entry]) -> std::fmt::Result {
    let singles: Vec<&Entry> =
        entries.iter().filter(|e| matches!(e.plan.class, Class::Single | Class::Weak) && e.hidden.len() == 1).collect();
    if !singles.is_empty() {
        writeln!(text, "## By effect (single and weak)\n")?;
        writeln!(
            text,
            "| effect | exact | tied | abstained | misnamed | weak: exact | tied | abstained | misnamed | median error |"
        )?;
        writeln!(text, "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")?;
        for effect in Effect::ALL {
            let of = |class: Class| {
                Tally::of(
                    singles.iter().copied().filter(|e| e.plan.class == class && e.hidden[0].effect() == Some(effect)),
                )
            };
            let (single, weak) = (of(Class::Single), of(Class::Weak));
            let row = |tally: &Tally| {
                let at = |outcome| tally.rate(&[outcome]).hits;
                format!(
                    "{}/{} | {} | {} | {}",
                    at(Outcome::Exact),
                    tally.len(),
                    at(Outcome::Tied),
                    at(Outcome::Abstained),
                    at(Outcome::Misnamed)
                )
            };
            let error = single.median_parameter_error();
            let error = if error.is_nan() { "–".into() } else { format!("{:.2} %", 100.0 * error) };
            writeln!(text, "| {} | {} | {} | {error} |", effect.id(), row(&single), row(&weak))?;
        }
        writeln!(text)?;
    }
    let unknown: Vec<&Entry> = entries.iter().filter(|e| e.plan.class == Class::Unknown).collect();
    if !unknown.is_empty() {
        writeln!(text, "| effect outside the catalogue | cases | rejected | overlooked | explained falsely |")?;
        writeln!(text, "| --- | ---: | ---: | ---: | ---: |")?;
        for foreign in Foreign::ALL {
            let tally =
                Tally::of(unknown.iter().copied().filter(|e| e.hidden.first().is_some_and(|c| c.id() == foreign.id())));
            let at = |outcome| tally.rate(&[outcome]).hits;
            writeln!(
                text,
                "| {} | {} | {} | {} | {} |",
                foreign.id(),
                tally.len(),
                at(Outcome::Rejected),
                at(Outcome::Overlooked),
                at(Outcome::Seduced)
            )?;
        }
        writeln!(text)?;
    }
    Ok(())
}

fn breakdown(text: &mut String, entries: &[Entry]) -> std::fmt::Result {
    let singles: Vec<&Entry> = entries.iter().filter(|e| e.plan.class == Class::Single).collect();
    if singles.is_empty() {
        return Ok(());
    }
    writeln!(text, "## Single effects by rig and experiment\n")?;
    writeln!(text, "| rig | experiment | cases | exact | with ties | misnamed |")?;
    writeln!(text, "| --- | --- | ---: | ---: | ---: | ---: |")?;
    let mut keys: Vec<(&str, &str)> = singles.iter().map(|e| (e.rig.as_str(), e.experiment)).collect();
    keys.sort_unstable();
    keys.dedup();
    for (rig, experiment) in keys {
        let tally = Tally::of(singles.iter().copied().filter(|e| e.rig == rig && e.experiment == experiment));
        writeln!(
            text,
            "| {rig} | {experiment} | {} | {} | {} | {} |",
            tally.len(),
            tally.rate(&[Outcome::Exact]).hits,
            tally.rate(&[Outcome::Exact, Outcome::Tied]).hits,
            tally.rate(&[Outcome::Misnamed]).hits
        )?;
    }
    writeln!(text)
}

/// Rows: hidden; columns: named first. Single and weak cases.
fn confusion(text: &mut String, entries: &[Entry]) -> std::fmt::Result {
    let of: Vec<&Entry> =
        entries.iter().filter(|e| matches!(e.plan.class, Class::Single | Class::Weak) && e.hidden.len() == 1).collect();
    if of.is_empty() {
        return Ok(());
    }
    writeln!(text, "## Confusion matrix (single and weak)\n")?;
    writeln!(
        text,
        "Rows: the hidden effect. Columns: the cause named first, by the number of its row; `no-gap`: no gap seen; `?`: a gap \
         without a name; `!`: failed.\n"
    )?;
    let numbers: Vec<String> = (1..=Effect::ALL.len()).map(|n| n.to_string()).collect();
    writeln!(text, "| | hidden | {} | no-gap | ? | ! |", numbers.join(" | "))?;
    writeln!(text, "| ---: | --- |{}", " ---: |".repeat(numbers.len() + 3))?;
    for (row, effect) in Effect::ALL.into_iter().enumerate() {
        let mut counts = vec![0_usize; Effect::ALL.len() + 3];
        for entry in of.iter().filter(|e| e.hidden[0].effect() == Some(effect)) {
            counts[column(entry)] += 1;
        }
        let cells: Vec<String> = counts
            .iter()
            .enumerate()
            .map(|(at, count)| match count {
                0 => String::new(),
                count if at == row => format!("**{count}**"),
                count => count.to_string(),
            })
            .collect();
        writeln!(text, "| {} | {} | {} |", row + 1, effect.id(), cells.join(" | "))?;
    }
    writeln!(text)
}

fn column(entry: &Entry) -> usize {
    let effects = Effect::ALL.len();
    let Ok(answer) = &entry.answer else { return effects + 2 };
    let first = answer.causes.first().and_then(|cause| Effect::ALL.iter().position(|e| e.id() == cause.id));
    match first {
        Some(at) => at,
        None if answer.verdict == Verdict::NoGap => effects,
        None => effects + 1,
    }
}

fn failures(text: &mut String, entries: &[Entry]) -> std::fmt::Result {
    let bad: Vec<&Entry> = entries
        .iter()
        .filter(|e| {
            let fine = [Outcome::Exact, Outcome::Tied, Outcome::Quiet, Outcome::Rejected];
            e.score.as_ref().is_none_or(|score| !fine.contains(&score.outcome))
        })
        .collect();
    writeln!(text, "## Cases that went wrong\n")?;
    if bad.is_empty() {
        return writeln!(text, "None.");
    }
    writeln!(text, "| case | rig | experiment | hidden | outcome | answer |")?;
    writeln!(text, "| --- | --- | --- | --- | --- | --- |")?;
    for entry in bad {
        let outcome = entry.score.as_ref().map_or("failed", |score| score.outcome.word());
        writeln!(
            text,
            "| {} | {} | {} | {} | {outcome} | {} |",
            entry.plan,
            entry.rig,
            entry.experiment,
            hidden(entry),
            said(entry)
        )?;
    }
    Ok(())
}

fn hidden(entry: &Entry) -> String {
    let causes: Vec<String> = entry
        .hidden
        .iter()
        .map(|cause| {
            let values: Vec<String> = cause.parameters().iter().map(|(_, value)| format!("{value:.4e}")).collect();
            format!("{} ({})", cause.id(), values.join(", "))
        })
        .collect();
    if causes.is_empty() { "nothing".into() } else { causes.join("; ") }
}

fn said(entry: &Entry) -> String {
    match &entry.answer {
        Err(error) => error.clone(),
        Ok(answer) => {
            let causes: Vec<String> = answer
                .causes
                .iter()
                .map(|cause| {
                    if cause.ties.is_empty() {
                        cause.id.clone()
                    } else {
                        format!("{} (ties: {})", cause.id, cause.ties.join(", "))
                    }
                })
                .collect();
            format!("{}: {}", answer.verdict.word(), if causes.is_empty() { "–".into() } else { causes.join("; ") })
        }
    }
}

/// One CSV line per case, with its case name, so that any of them can be replayed.
#[must_use]
pub fn case_lines(entries: &[Entry]) -> String {
    let mut text = String::from(
        "case,class,nominal,rig,experiment,hidden,outcome,verdict,named,ties,parameters_good,parameters_covered,\
         parameters,in_standard_errors,worst_floor_ratio,seconds\n",
    );
    for entry in entries {
        let describe = |causes: &[Cause]| causes.iter().map(Cause::describe).collect::<Vec<_>>().join(" ");
        let (verdict, named, ties) = match &entry.answer {
            Ok(answer) => (
                answer.verdict.word(),
                answer.causes.iter().map(|cause| cause.id.as_str()).collect::<Vec<_>>().join(" "),
                answer.causes.iter().map(|cause| cause.ties.join("+")).collect::<Vec<_>>().join(" "),
            ),
            Err(_) => ("", String::new(), String::new()),
        };
        let parameters = entry.score.as_ref().map_or(&[][..], |score| &score.parameters);
        let errors = parameters.iter().map(|p| {
            let error = (p.value - p.truth).signum() * p.in_std_errors;
            format!("{}:{}={error:.2}", p.effect, p.name)
        });
        // Writing to a String cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{},{},\"{}\",{},{verdict},{named},{ties},{},{},{},{},{},{:.3}",
            entry.plan,
            entry.plan.class.word(),
            entry.plan.nominal.word(),
            entry.rig.replace(',', ";"),
            entry.experiment,
            describe(&entry.hidden),
            entry.score.as_ref().map_or("failed", |score| score.outcome.word()),
            parameters.iter().filter(|p| p.is_good()).count(),
            parameters.iter().filter(|p| p.is_covered()).count(),
            parameters.len(),
            errors.collect::<Vec<_>>().join(" "),
            entry.score.as_ref().and_then(|s| s.worst_floor_ratio).map_or(String::new(), |r| format!("{r:.3}")),
            entry.took.as_secs_f64()
        );
    }
    text
}
