//! Which column is the time, or at which interval the rows come.

use super::super::stamps;
use super::super::units::{self, Quantity};
use super::layout::{Kind, Layout};
use super::seen::Seen;
use super::{Page, from, names, short};

/// How the rows are timed.
pub(super) struct Found {
    columns: Vec<usize>,
    way: Way,
}

enum Way {
    /// Number, unit, from zero, reason.
    Number { from: String, unit: String, from_zero: bool, why: [String; 2] },
    /// `datetime` or `clock`.
    Stamps { from: String, kind: &'static str, formats: Vec<String>, why: String },
    /// A fixed interval, or `"?"`.
    Interval { key: &'static str, value: String, why: String },
}

/// Chooses the time.
pub(super) fn choose(layout: &Layout, columns: &[Seen]) -> Found {
    let named =
        |seen: &&Seen| names::is_time(&seen.bare) || seen.name == "t_s" || seen.stated(Quantity::Time).is_some();
    let rising = || columns.iter().filter(|seen| seen.kind == Kind::Number && seen.rises());
    if let Some(seen) = rising().find(named) {
        return number(layout, columns, seen, "its name, and it rises from row to row");
    }
    let of = |kind: Kind| columns.iter().find(|seen| seen.kind == kind);
    if let Some(found) = of(Kind::DateTime).or(of(Kind::Clock)) {
        return stamped(layout, columns, found, of(Kind::Date));
    }
    if let Some((key, value, why)) = stated_interval(layout) {
        return Found { columns: Vec::new(), way: Way::Interval { key, value, why } };
    }
    let even = |seen: &&Seen| {
        let (step, first) = (seen.step(), seen.values[0]);
        let last = seen.values[seen.values.len() - 1];
        let steady = ((last - first) - step * (seen.values.len() - 1) as f64).abs() < 0.2 * (last - first);
        let counts = step == 1.0 && seen.values.iter().all(|value| value.fract() == 0.0);
        steady && !counts && !names::is_index(&seen.bare) && seen.unit.is_none()
    };
    if let Some(seen) = rising().find(even) {
        return number(layout, columns, seen, "uncertain, by its data only: it rises evenly from row to row");
    }
    let why = "left to you: no column is a time; how far apart are the rows, in seconds (1 kHz: 0.001)?".into();
    Found { columns: Vec::new(), way: Way::Interval { key: "interval_s", value: "\"?\"".into(), why } }
}

/// Time as numbers: the unit that is stated, or that makes a usual logger.
fn number(layout: &Layout, columns: &[Seen], seen: &Seen, why: &str) -> Found {
    let step = seen.step();
    let first = seen.values.first().copied().unwrap_or(0.0);
    let since_1970 = [("s", 1.0), ("ms", 1.0e3), ("us", 1.0e6), ("ns", 1.0e9)]
        .into_iter()
        .find(|(_, per_s)| (1.0e9..4.0e9).contains(&(first / per_s)));
    let usual = |factor: f64| (2.0e-5..=0.5).contains(&(step * factor));
    let (unit, reason) = if let Some((unit, factor)) = seen.stated(Quantity::Time) {
        if usual(factor) {
            (unit, format!("from {}", seen.unit_from))
        } else {
            let text = format!(
                "left to you: {} says {unit}, but rows {} {unit} apart are unusual",
                seen.unit_from,
                short(step)
            );
            ("?", text)
        }
    } else if let Some((unit, _)) = since_1970 {
        (unit, format!("the numbers are those of {unit} since 1970"))
    } else if (3.0e4..6.0e4).contains(&first) && step < 1.0e-5 {
        ("d", "the numbers are those of days since 1900, as spreadsheets count".into())
    } else {
        let fitting: Vec<(&str, f64)> = [("s", 1.0), ("ms", 1.0e-3), ("us", 1.0e-6)]
            .into_iter()
            .filter(|(_, factor)| (1.0e-4..=0.05).contains(&(step * factor)))
            .collect();
        match fitting[..] {
            [(unit, factor)] => (
                unit,
                format!(
                    "by the step of {}: {} rows a second, as loggers do",
                    short(step),
                    short(1.0 / (step * factor))
                ),
            ),
            _ => ("?", format!("left to you: the rows are {} apart; s, ms or us?", short(step))),
        }
    };
    let large = since_1970.is_some() || unit == "d";
    Found {
        columns: vec![seen.number],
        way: Way::Number {
            from: from(seen, columns, layout),
            unit: unit.into(),
            from_zero: large,
            why: [why.into(), reason],
        },
    }
}

fn stamped(layout: &Layout, columns: &[Seen], seen: &Seen, date: Option<&Seen>) -> Found {
    let mut taken = vec![seen.number];
    if seen.repeats() {
        let span_s = span_s(seen);
        let about = (span_s > 0.0).then(|| short(span_s / (seen.stamps.len() - 1) as f64));
        let about = about.map_or(String::new(), |s| format!(", about {s} on average"));
        let why = format!(
            "left to you: the stamps of {} repeat, so they do not time the rows; how far apart are the rows in s{about}?",
            seen.called()
        );
        return Found { columns: taken, way: Way::Interval { key: "interval_s", value: "\"?\"".into(), why } };
    }
    let (mut source, mut kind) = (from(seen, columns, layout), "clock");
    let mut why = "a time of day; midnight may pass".to_string();
    let mut formats = Vec::new();
    if seen.kind == Kind::DateTime {
        (kind, why) = ("datetime", "a date with a time".into());
        formats = seen.formats().unwrap_or_default();
    } else if let Some(date) = date
        && layout.header
    {
        taken.push(date.number);
        source = format!("[{}, {}]", from(date, columns, layout), source);
        (kind, why) = ("datetime", "date and time stand in two columns".into());
        let stamps = date.stamps.iter().zip(&seen.stamps).map(|(date, time)| format!("{date} {time}")).collect();
        formats = Seen { stamps, ..date.clone() }.formats().unwrap_or_default();
    }
    if kind == "datetime" && source.starts_with('[') && !source.contains('"') {
        // Columns can be joined by name only.
        taken.truncate(1);
        (source, kind) = (from(seen, columns, layout), "clock");
        why = "a time of day; midnight may pass".into();
        formats.clear();
    }
    Found { columns: taken, way: Way::Stamps { from: source, kind, formats, why } }
}

/// From the first stamp to the last, s; 0 if they cannot be read.
fn span_s(seen: &Seen) -> f64 {
    let ns = |cell: &String| {
        let stamp = stamps::Reader::default().read(cell).map(|stamp| stamp.ns);
        stamp.or_else(|| stamps::time_of_day(cell))
    };
    match (seen.stamps.first().and_then(ns), seen.stamps.last().and_then(ns)) {
        (Some(first), Some(last)) => (last - first) as f64 * 1.0e-9,
        _ => 0.0,
    }
}

/// An interval or a rate that a line above the table states: key, value and reason.
fn stated_interval(layout: &Layout) -> Option<(&'static str, String, String)> {
    const INTERVALS: [&str; 9] = [
        "sample interval",
        "sampling interval",
        "sample period",
        "sampling period",
        "increment",
        "abtastintervall",
        "abtastzeit",
        "zykluszeit",
        "cycle time",
    ];
    const RATES: [&str; 7] =
        ["sample rate", "sampling rate", "sampling frequency", "abtastrate", "abtastfrequenz", "scan rate", "messrate"];
    for (number, line) in &layout.above {
        let lower = line.to_lowercase();
        let at = |words: &[&str]| words.iter().find_map(|word| lower.find(word).map(|at| at + word.len()));
        let (key, rest) = match (at(&INTERVALS), at(&RATES)) {
            (Some(at), _) => ("interval_s", &lower[at..]),
            (None, Some(at)) => ("rate_hz", &lower[at..]),
            _ => continue,
        };
        let begin = rest.find(|c: char| c.is_ascii_digit())?;
        let text = &rest[begin..];
        let is_number = |c: char| c.is_ascii_digit() || matches!(c, '.' | ',' | '-' | '+');
        // An exponent only if a digit or a sign follows.
        let mut end = text.find(|c: char| !is_number(c)).unwrap_or(text.len());
        if text[end..].starts_with('e')
            && text[end + 1..].starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+')
        {
            end += 1 + text[end + 1..].find(|c: char| !is_number(c)).unwrap_or(text.len() - end - 1);
        }
        let digits = text[..end].trim_end_matches(',');
        let value: f64 =
            if layout.decimal_comma { digits.replace(',', ".") } else { digits.replace(',', "") }.parse().ok()?;
        let before = rest[..begin].trim_matches(|c: char| !c.is_alphanumeric() && c != 'µ');
        let after = text[end..].trim_start_matches(|c: char| !c.is_alphanumeric() && c != 'µ');
        let after = after.split(|c: char| c.is_whitespace() || matches!(c, ';' | ',' | '\t' | ')' | ']')).next()?;
        let unit = if after.is_empty() { before } else { after };
        let factor = if key == "rate_hz" {
            match unit {
                "khz" | "ks/s" => 1.0e3,
                "mhz" => 1.0e6,
                _ => 1.0,
            }
        } else {
            units::read(unit).and_then(|w| w.unit).filter(|unit| unit.0 == Quantity::Time).map_or(1.0, |unit| unit.2)
        };
        // Digits as they were meant: 5 ms are 0.005 s.
        let value = format!("{:.9e}", value * factor).parse::<f64>().unwrap_or(value * factor);
        return Some((key, value.to_string(), format!("line {number}: {}", line.trim())));
    }
    None
}

impl Found {
    /// The columns it uses.
    pub(super) fn columns(&self) -> &[usize] {
        &self.columns
    }

    /// Lines under `[source]`.
    pub(super) fn write_source(&self, page: &mut Page) {
        match &self.way {
            Way::Interval { key, value, why } => page.key(key, value, why.clone()),
            Way::Number { from_zero: true, .. } => page.key("time_from_zero", true, "the first row is t = 0"),
            _ => {}
        }
    }

    /// The table of the time.
    pub(super) fn write(&self, page: &mut Page, _: &Layout) {
        match &self.way {
            Way::Interval { .. } => {}
            Way::Number { from, unit, why: [why, reason], .. } => {
                page.table("column.t_s");
                page.key("from", from, why.clone());
                page.key("unit", format!("\"{unit}\""), reason.clone());
            }
            Way::Stamps { from, kind, formats, why } => {
                page.table("column.t_s");
                page.key("from", from, why.clone());
                page.key("time", format!("\"{kind}\""), "the first row is t = 0");
                match &formats[..] {
                    [] => {}
                    [one] => {
                        page.key("format", format!("\"{one}\""), "the only order of day and month that fits all rows")
                    }
                    [day, month, ..] => {
                        page.comment(format!("day first: \"{day}\"; month first: \"{month}\""));
                        page.key("format", "\"?\"", "left to you: the dates can be read in both ways");
                    }
                }
            }
        }
    }
}
