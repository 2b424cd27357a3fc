//! What a cell is that should have been a number or a time, and which line of the mapping would take it.

use super::cells::Numbers;
use super::units::Quantity;
use super::{ColumnRule, Separator, TimeCells, stamps, units};

/// What the hints may look at.
pub(super) struct Place<'a> {
    /// The mapping file.
    pub(super) map: &'a str,
    pub(super) rule: &'a ColumnRule,
    pub(super) numbers: &'a Numbers,
    pub(super) separator: Separator,
    /// How the message calls the column.
    pub(super) column: &'a str,
    /// No row has been read yet.
    pub(super) first: bool,
}

/// The problem and the remedy.
pub(super) fn of(cell: &str, place: &Place<'_>) -> (String, String) {
    let shown: String = cell.trim().chars().take(40).flat_map(char::escape_debug).collect();
    let Place { map, rule, column, .. } = place;
    let wanted = match rule.time {
        TimeCells::Number => "a number",
        TimeCells::DateTime { .. } => "a date with a time",
        TimeCells::Clock => "a time of day",
    };
    let (what, remedy) = what(cell.trim(), place);
    let what = if what.is_empty() { String::new() } else { format!(", {what},") };
    (
        format!("column {column} is `{shown}`{what} where {wanted} belongs"),
        remedy.replace("[t_s]", "under [column.t_s]").replace("[s]", "under [source]") + &format!(" in {map}"),
    )
}

/// What the cell seems to be, and the line to write; `[t_s]` and `[s]` stand for the table it belongs to.
fn what(cell: &str, place: &Place<'_>) -> (&'static str, String) {
    let is_time = place.rule.target.is_none();
    let stated = matches!(&place.rule.time, TimeCells::DateTime { format: Some(_) });
    let zone = stamps::zone_by_name(cell);
    if zone.is_some() && is_time && place.rule.time != TimeCells::Number {
        return ("a time in a zone called by its name", zone_by_name(place));
    }
    let cell = zone.map_or(cell, |(time, _)| time);
    let kind = if stamps::Reader::default().read(cell).is_some() || stamps::formats(cell).is_some() {
        Some(("a date with a time", "datetime"))
    } else {
        stamps::time_of_day(cell).map(|_| ("a time of day", "clock"))
    };
    match (kind, is_time) {
        (Some((what, _)), false) => return (what, wrong_column(place)),
        (Some((what, _)), true) if stated => return (what, "correct `format` [t_s]".into()),
        (Some((_, "datetime")), true) if let Some([day, month]) = stamps::formats(cell) => {
            let choice = match (day, month) {
                (Some(day), Some(month)) => format!("`format = \"{day}\"` or, if the month comes first, \"{month}\""),
                (Some(one), None) | (None, Some(one)) => format!("`format = \"{one}\"`"),
                (None, None) => "`format`".into(),
            };
            return ("a date with a time", format!("set `time = \"datetime\"` and {choice} [t_s]"));
        }
        (Some((what, time)), true) => return (what, format!("set `time = \"{time}\"` [t_s]")),
        (None, _) => {}
    }
    if is_time && place.rule.time != TimeCells::Number {
        let number = place.numbers.number(cell).is_some();
        return if number {
            ("a number", "remove `time` [t_s] and give the `unit`".into())
        } else if cell.matches(':').count() == 1 && cell.bytes().all(|b| b.is_ascii_digit() || b":.,".contains(&b)) {
            (
                "a time without seconds or hours",
                "export it with hours, minutes and seconds, or give `interval_s` [s]".into(),
            )
        } else if cell.bytes().any(|byte| byte.is_ascii_digit()) {
            let text = "set `format` [t_s], e.g. \"%d.%m.%Y %H:%M:%S%.f\"; the date may be in a column of its own: \
                        `from = [\"DATE\", \"TIME\"]`";
            ("", text.into())
        } else {
            ("", not_a_row(place))
        };
    }
    if let Some((what, line)) = otherwise_written(cell, place.numbers) {
        return (what, format!("set {line} [s]"));
    }
    if let Some((number, unit)) = with_unit(cell, place.numbers) {
        let _ = number;
        return match unit {
            Some(unit) => {
                ("a number with a unit", format!("set `unit = \"{unit}\"` under [column.{}]", place.rule.name))
            }
            None => ("a number with a unit", "export the numbers without units".into()),
        };
    }
    let others: [(&str, &str, Separator); 3] = [
        (";", "semicolon", Separator::Byte(b';')),
        ("\t", "tab", Separator::Byte(b'\t')),
        (",", "comma", Separator::Byte(b',')),
    ];
    for (mark, name, separator) in others {
        if separator != place.separator && cell.contains(mark) {
            return ("several cells", format!("set `separator = \"{name}\"` [s]"));
        }
    }
    let digits = cell.bytes().any(|byte| byte.is_ascii_digit());
    if ["true", "false", "on", "off", "ein", "aus"].contains(&cell.to_lowercase().as_str()) {
        return ("a switch", wrong_column(place));
    }
    if cell.to_lowercase().trim_start_matches(['+', '-', '1', '.', '#']).starts_with("inf")
        || (digits && cell.parse::<f64>().is_ok())
    {
        return (
            "no finite number",
            format!("set `missing = [\"{}\"]` [s] if it marks a missing sample", cell.escape_debug()),
        );
    }
    if place.first && units::read(cell).is_some() {
        return ("a unit", "set `units_line = true` [s]".into());
    }
    if place.first || (digits && cell.contains(' ')) {
        return ("", "set `skip_lines`, `header` and `separator` [s] so that the table begins below its header".into());
    }
    if !digits && cell.chars().count() <= 20 {
        let word = cell.escape_debug();
        return ("", format!("set `missing = [\"{word}\"]` [s] if it marks a missing sample; {}", not_a_row(place)));
    }
    ("", not_a_row(place))
}

/// The remedy for a name that has more than one meaning, such as CST, or changes in the night when the clocks do.
fn zone_by_name(place: &Place<'_>) -> String {
    let export = "names of zones are not understood; export the";
    match place.rule.time {
        TimeCells::DateTime { .. } => format!(
            "{export} stamps with an offset such as +01:00, or in UTC; or, if all rows have the same name, write it at the end of \
             `format` [t_s], e.g. \"%d.%m.%Y %H:%M:%S%.f CET\","
        ),
        _ => format!(
            "{export} times without one, or with their date and an offset such as +01:00 and set `time = \"datetime\"` [t_s]"
        ),
    }
}

fn wrong_column(place: &Place<'_>) -> String {
    format!("let `from` under [column.{}] name another column", place.rule.name)
}

fn not_a_row(_: &Place<'_>) -> String {
    "delete the line if it is no part of the table, or set `comment` [s] if all such lines begin with one character"
        .into()
}

/// The keys under which the cell would be a number.
fn otherwise_written(cell: &str, numbers: &Numbers) -> Option<(&'static str, String)> {
    let now = (numbers.decimal_comma, numbers.thousands);
    let mut ways = vec![(true, None), (false, None)];
    ways.extend(['.', ' ', '\''].map(|mark| (true, Some(mark))));
    ways.extend([',', ' ', '\''].map(|mark| (false, Some(mark))));
    let reads = |(decimal_comma, thousands): (bool, Option<char>)| {
        Numbers { decimal_comma, thousands, missing: Vec::new() }.number(cell).is_some()
    };
    // The nearest to what the mapping says comes first.
    ways.sort_by_key(|way| (way.0 != now.0, way.1 != now.1));
    let (comma, thousands) = ways.into_iter().find(|way| *way != now && reads(*way))?;
    let what = match (comma, thousands) {
        (_, Some(_)) => "a number with groups of thousands",
        (true, None) => "a number with a decimal comma",
        (false, None) => "a number with a decimal point",
    };
    let decimal = (comma != now.0).then(|| format!("`decimal_comma = {comma}`"));
    let group = thousands.filter(|_| thousands != now.1).map(|mark| format!("`thousands = \"{mark}\"`"));
    let lines: Vec<String> = decimal.into_iter().chain(group).collect();
    (!lines.is_empty()).then(|| (what, lines.join(" and ")))
}

/// A number with text behind it, and the unit of a mapping that this text is.
fn with_unit(cell: &str, numbers: &Numbers) -> Option<(f64, Option<&'static str>)> {
    let end = cell.rfind(|c: char| c.is_ascii_digit())? + 1;
    let (number, text) = cell.split_at(end);
    let value = numbers.number(number)?;
    if text.trim().is_empty() || text.trim().chars().count() > 8 {
        return None;
    }
    Some((value, units::read(text).and_then(|written| written.unit).map(|(_, name, _)| name)))
}

/// A sentence about a unit in the header that is not the mapping's.
pub(super) fn other_unit(rule: &ColumnRule, written: &units::Written) -> Option<String> {
    let (quantity, name, factor) = written.unit?;
    let (stated, taken) = rule.unit.as_ref()?;
    (quantity == Quantity::of(rule.name) && factor != *taken && rule.points.is_none())
        .then(|| format!("{}: the header says {name}, the mapping {stated}; the mapping holds", rule.name))
}
