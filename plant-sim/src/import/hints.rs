//! What a cell is that should have been a number or a time, and which line of the mapping would take it.

use super::cells::Numbers;
use super::separator::Separator;
use super::units::Quantity;
use super::{ColumnRule, TimeCells, stamps, units};
use rig_files::shorten;

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
    let shown = shorten(cell.trim());
    let column = place.column;
    let wanted = match place.rule.time {
        TimeCells::Number => "a number",
        TimeCells::DateTime { .. } => "a date with a time",
        TimeCells::Clock => "a time of day",
    };
    let (what, remedy) = what(cell.trim(), place);
    let what = if what.is_empty() { String::new() } else { format!(", {what},") };
    (format!("column {column} is `{shown}`{what} where {wanted} belongs"), in_the_mapping(&remedy, cell.trim(), place))
}

/// A remedy with the tables of the mapping in full, its file behind the first of them, and the cell.
fn in_the_mapping(remedy: &str, cell: &str, place: &Place<'_>) -> String {
    let of_column = format!("[column.{}]", place.rule.name);
    let tables = [("[t_s]", "[column.t_s]"), ("[c]", &of_column), ("[s]", "[source]")];
    let first = tables.into_iter().filter_map(|(short, table)| Some((remedy.find(short)?, short, table))).min();
    let with_file = first.map_or(remedy.to_string(), |(_, short, table)| {
        remedy.replacen(short, &format!("under {table} in {}", place.map), 1)
    });
    let full =
        tables.into_iter().fold(with_file, |text, (short, table)| text.replace(short, &format!("under {table}")));
    full.replace("[cell]", &cell.escape_debug().to_string())
}

/// What the cell seems to be, and the line to write; `[t_s]`, `[c]` and `[s]` stand for the table it belongs to: that of the time,
/// of the column, or `[source]`; `[cell]` for the cell.
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
        (Some((what, _)), false) => return (what, wrong_column()),
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
            ("", not_a_row())
        };
    }
    if let Some((what, line)) = otherwise_written(cell, place.numbers) {
        return (what, format!("set {line} [s]"));
    }
    if let Some(unit) = with_unit(cell, place.numbers) {
        let remedy = match unit {
            Some(units::Written { unit: Some((_, unit, _)), .. }) => format!("set `unit = \"{unit}\"` [c]"),
            Some(units::Written { signal: Some(signal), .. }) if !is_time => {
                let points = units::two_readings(signal, Quantity::of(place.rule.name));
                format!("{points} [c]; or let `from` name another column")
            }
            _ => "export the numbers without units, or let `from` [c] name another column".into(),
        };
        return ("a number with a unit", remedy);
    }
    let several = |other: Separator| other != Separator::Blanks && other.cells(cell).len() > 1;
    if let Some(other) = place.separator.other(several) {
        return ("several cells", format!("set `separator = \"{}\"` [s]", other.name()));
    }
    let digits = cell.bytes().any(|byte| byte.is_ascii_digit());
    if ["true", "false", "on", "off", "ein", "aus"].contains(&cell.to_lowercase().as_str()) {
        return ("a switch", wrong_column());
    }
    if cell.to_lowercase().trim_start_matches(['+', '-', '1', '.', '#']).starts_with("inf")
        || (digits && cell.parse::<f64>().is_ok())
    {
        return ("no finite number", "set `missing = [\"[cell]\"]` [s] if it marks a missing sample".into());
    }
    if place.first && units::read(cell).is_some() {
        return ("a unit", "set `units_line = true` [s]".into());
    }
    if place.first || (digits && cell.contains(' ')) {
        return ("", "set `skip_lines`, `header` and `separator` [s] so that the table begins below its header".into());
    }
    if !digits && cell.chars().count() <= 20 {
        return ("", format!("set `missing = [\"[cell]\"]` [s] if it marks a missing sample; {}", not_a_row()));
    }
    ("", not_a_row())
}

/// The remedy for a name that has more than one meaning, such as CST, or changes in the night when the clocks do.
fn zone_by_name(place: &Place<'_>) -> String {
    let export = "names of zones are not understood; export the";
    match place.rule.time {
        TimeCells::DateTime { .. } => format!(
            "{export} stamps with an offset such as +01:00, or in UTC; or, if all rows have the same name, write it at the end of \
             `format` [t_s], e.g. \"%d.%m.%Y %H:%M:%S%.f CET\""
        ),
        _ => format!(
            "{export} times without one, or with their date and an offset such as +01:00 and set `time = \"datetime\"` [t_s]"
        ),
    }
}

fn wrong_column() -> String {
    "let `from` [c] name another column".into()
}

fn not_a_row() -> String {
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

/// The text behind a number as a unit, if it is one; `None` where there is no number with text behind it.
fn with_unit(cell: &str, numbers: &Numbers) -> Option<Option<units::Written>> {
    let end = cell.rfind(|c: char| c.is_ascii_digit())? + 1;
    let (number, text) = cell.split_at(end);
    numbers.number(number)?;
    let text = text.trim();
    (!text.is_empty() && text.chars().count() <= 8).then(|| units::read(text))
}

/// A sentence about a unit in the header that is not the mapping's.
pub(super) fn other_unit(rule: &ColumnRule, written: &units::Written) -> Option<String> {
    let (quantity, name, factor) = written.unit?;
    let (stated, taken) = rule.unit.as_ref()?;
    (quantity == Quantity::of(rule.name) && factor != *taken && rule.points.is_none())
        .then(|| format!("{}: the header says {name}, the mapping {stated}; the mapping holds", rule.name))
}
