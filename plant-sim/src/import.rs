//! Foreign tables → logs, by a mapping file: which column, which unit, which sign, gauge or absolute.
//!
//! A value becomes `sign · value · unit + offset`, and a gauge pressure gains the atmosphere. Where the mapping names two
//! points, the value goes through their line first. Units, offsets and the atmosphere are those of the mapping; the result
//! is SI as the log format wants it. [`suggest`] drafts a mapping from a table.

mod cells;
mod columns;
mod convert;
mod hints;
mod rows;
mod separator;
mod stamps;
pub mod suggest;
mod text;
mod units;

use cells::Numbers;
pub use convert::Imported;
use rig_files::{Column, Document, Entry, InputError, Log, Short, read_text};
use separator::Separator;
use std::path::Path;
use units::Quantity;

/// A parsed mapping file.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapping {
    file: String,
    separator: Separator,
    header: bool,
    units_line: bool,
    skip_lines: usize,
    comment: Option<char>,
    numbers: Numbers,
    interval_s: Option<f64>,
    rebase_time: bool,
    columns: Vec<ColumnRule>,
}

#[derive(Clone, Debug, PartialEq)]
struct ColumnRule {
    /// Its name in the log.
    name: &'static str,
    /// `None` is the time.
    target: Option<Column>,
    source: Source,
    /// Name and factor; `None` if the mapping does not state it.
    unit: Option<(String, f64)>,
    sign: f64,
    offset: f64,
    /// Two readings and what they mean in `unit`.
    points: Option<[[f64; 2]; 2]>,
    /// How long after the times of their rows the readings were taken, s.
    shift_s: f64,
    time: TimeCells,
}

/// What the cells of the time column are.
#[derive(Clone, Debug, PartialEq)]
enum TimeCells {
    Number,
    DateTime { format: Option<String> },
    Clock,
}

#[derive(Clone, Debug, PartialEq)]
enum Source {
    Number(usize),
    Name(String),
    /// A date and a time in columns of their own.
    Joined(Vec<String>),
    Constant(f64),
}

/// Columns a mapping may produce, the time first.
const TARGETS: [(&str, Option<Column>); 8] = [
    ("t_s", None),
    ("y_m", Some(Column::Y)),
    ("u_v", Some(Column::U)),
    ("p_a_pa", Some(Column::PA)),
    ("p_b_pa", Some(Column::PB)),
    ("p_sup_pa", Some(Column::PSup)),
    ("f_ext_n", Some(Column::FExt)),
    ("y_ref_m", Some(Column::YRef)),
];
const SOURCE_KEYS: [&str; 12] = [
    "separator",
    "header",
    "units_line",
    "skip_lines",
    "comment",
    "decimal_comma",
    "thousands",
    "missing",
    "atmosphere_pa",
    "interval_s",
    "rate_hz",
    "time_from_zero",
];
const COLUMN_KEYS: [&str; 10] =
    ["from", "value", "unit", "sign", "offset", "gauge", "points", "shift_s", "time", "format"];
/// Beyond this, s, a column belongs to another part of the recording.
const MOST_SHIFT_S: f64 = 1.0;
/// What a draft writes where it leaves a choice.
const OPEN: &str = "?";

impl Mapping {
    /// Reads a mapping file.
    ///
    /// # Errors
    /// The file cannot be read, or [`Mapping::parse`] refuses it.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&read_text(path)?, &path.display().to_string())
    }

    /// Parses the text of a mapping file.
    ///
    /// # Errors
    /// Not TOML; an unknown key, unit, separator or target column; a column without a source; no time or position; a choice
    /// that a draft left open.
    pub fn parse(text: &str, file: &str) -> Result<Self, InputError> {
        let document = Document::parse(text, file)?;
        let mut mapping = Self {
            file: file.to_string(),
            separator: Separator::Byte(b','),
            header: true,
            units_line: false,
            skip_lines: 0,
            comment: None,
            numbers: Numbers::default(),
            interval_s: None,
            rebase_time: false,
            columns: Vec::new(),
        };
        let mut atmosphere_pa = None;
        let top = document.entries();
        for entry in &top {
            match entry.name {
                "source" => mapping.source(entry, &mut atmosphere_pa)?,
                "column" => {}
                _ => return Err(entry.unknown(["source", "column"])),
            }
        }
        for entry in top.iter().filter(|entry| entry.name == "column") {
            for column in entry.table()? {
                let rule = column_rule(&column, mapping.header, atmosphere_pa)?;
                if rule.target.is_none() && mapping.interval_s.is_some() {
                    let remedy = "remove [column.t_s], or `interval_s` and `rate_hz`";
                    return Err(column.error("is a second source of the time beside the fixed interval", remedy));
                }
                mapping.columns.push(rule);
            }
        }
        for (needed, target) in [("t_s", None), ("y_m", Some(Column::Y))] {
            let given = target.is_none() && mapping.interval_s.is_some();
            if !given && !mapping.columns.iter().any(|rule| rule.target == target) {
                let or = if target.is_none() { ", or `interval_s = SECONDS` under [source]" } else { "" };
                let remedy = format!("add a table [column.{needed}] that says where it comes from{or}");
                return Err(InputError::new(file, format!("`column.{needed}` is missing"), remedy));
            }
        }
        let (comma, point) = (mapping.numbers.decimal_comma, !mapping.numbers.decimal_comma);
        if (comma && mapping.numbers.thousands == Some(',')) || (point && mapping.numbers.thousands == Some('.')) {
            let remedy =
                "`decimal_comma = true` goes with thousands = \".\", \" \" or \"'\"; without it \",\", \" \" or \"'\"";
            return Err(InputError::new(file, "`source.thousands` is the decimal sign, too", remedy));
        }
        if mapping.units_line && !mapping.header {
            let remedy = "set `header = true`, or skip the units' line with `skip_lines`";
            return Err(InputError::new(file, "`source.units_line` needs a header above it", remedy));
        }
        Ok(mapping)
    }

    fn source(&mut self, table: &Entry<'_>, atmosphere_pa: &mut Option<f64>) -> Result<(), InputError> {
        for entry in table.table()? {
            chosen(&entry)?;
            match entry.name {
                "separator" => {
                    let name = entry.string()?;
                    self.separator = Separator::from_name(name).ok_or_else(|| {
                        entry.error(
                            format!("= \"{}\" is not known", name.escape_debug()),
                            "use \"comma\", \"semicolon\", \"tab\" or \"space\"",
                        )
                    })?;
                }
                "header" => self.header = entry.flag()?,
                "units_line" => self.units_line = entry.flag()?,
                "skip_lines" => self.skip_lines = entry.whole(0, 1_000_000)? as usize,
                "comment" => {
                    let text = entry.string()?;
                    let mut chars = text.chars();
                    let (first, rest) = (chars.next(), chars.next());
                    if first.is_none() || rest.is_some() {
                        return Err(entry.error("must be a single character", "write it like \"#\""));
                    }
                    self.comment = first;
                }
                "decimal_comma" => self.numbers.decimal_comma = entry.flag()?,
                "thousands" => {
                    let text = entry.string()?;
                    let known = [".", ",", " ", "'"].into_iter().find(|known| *known == text);
                    let unknown = || {
                        let problem = format!("= \"{}\" is not known", text.escape_debug());
                        entry.error(problem, "use \".\", \",\", \" \" or \"'\"")
                    };
                    self.numbers.thousands = known.ok_or_else(unknown)?.chars().next();
                }
                "missing" => self.numbers.missing = entry.strings()?.into_iter().map(str::to_string).collect(),
                "time_from_zero" => self.rebase_time = entry.flag()?,
                "interval_s" | "rate_hz" => {
                    let value = entry.number()?;
                    let interval_s = if entry.name == "rate_hz" { 1.0 / value } else { value };
                    if !(1.0e-7..=10.0).contains(&interval_s) {
                        let remedy = "give interval_s in seconds, 0.001 for 1 kHz, or rate_hz in Hz";
                        return Err(entry.error(format!("= {} is not plausible", Short(value)), remedy));
                    }
                    if self.interval_s.replace(interval_s).is_some() {
                        return Err(entry.error("is there beside the other", "remove `interval_s` or `rate_hz`"));
                    }
                }
                "atmosphere_pa" => {
                    let value = entry.number()?;
                    if !(1.0e4..=1.2e5).contains(&value) {
                        let problem = format!("= {} is not plausible", Short(value));
                        return Err(entry.error(problem, "give it in Pa, about 1.013e5"));
                    }
                    *atmosphere_pa = Some(value);
                }
                _ => return Err(entry.unknown(SOURCE_KEYS)),
            }
        }
        Ok(())
    }

    /// Converts a foreign table.
    ///
    /// # Errors
    /// As [`Mapping::import`].
    pub fn convert_file(&self, path: &Path) -> Result<Log, InputError> {
        self.import(path).map(|imported| imported.log)
    }

    /// Converts a foreign table, and says what was done.
    ///
    /// # Errors
    /// The table cannot be read, a mapped column is not in it, a cell is not what the mapping says, or the result is no log
    /// (see [`Log::parse`]): each with the line in the foreign file.
    pub fn import(&self, path: &Path) -> Result<Imported, InputError> {
        let (text, note) = text::read(path)?;
        let mut imported = self.convert_text(&text, &path.display().to_string())?;
        imported.notes.splice(0..0, note);
        Ok(imported)
    }

    /// As [`Mapping::import`], of the bytes of a file.
    ///
    /// # Errors
    /// As [`Mapping::import`].
    pub fn convert(&self, bytes: &[u8], file: &str) -> Result<Imported, InputError> {
        let (text, note) = text::decode(bytes, file)?;
        let mut imported = self.convert_text(&text, file)?;
        imported.notes.splice(0..0, note);
        Ok(imported)
    }
}

/// Refuses what a draft left open.
fn chosen(entry: &Entry<'_>) -> Result<(), InputError> {
    if entry.is_string() && entry.string()?.trim() == OPEN {
        return Err(entry.error("= \"?\" is still to be chosen", "the comment above it says between what"));
    }
    Ok(())
}

fn column_rule(entry: &Entry<'_>, header: bool, atmosphere_pa: Option<f64>) -> Result<ColumnRule, InputError> {
    let Some((name, target)) = TARGETS.iter().find(|(name, _)| *name == entry.name) else {
        return Err(entry.unknown(TARGETS.iter().map(|(name, _)| *name)));
    };
    let (mut source, mut format) = (None, None);
    let mut rule = ColumnRule {
        name,
        target: *target,
        source: Source::Number(1),
        unit: None,
        sign: 1.0,
        offset: 0.0,
        points: None,
        shift_s: 0.0,
        time: TimeCells::Number,
    };
    let numbered = |key: &Entry<'_>| {
        let remedy = "give the column's number from 1, or set source.header = true";
        if header { Ok(()) } else { Err(key.error("is a name, but the table has no header", remedy)) }
    };
    for key in entry.table()? {
        chosen(&key)?;
        match key.name {
            "from" if key.is_string() => {
                numbered(&key)?;
                source = Some(Source::Name(key.string()?.to_string()));
            }
            "from" if key.is_array() => {
                numbered(&key)?;
                let names = key.strings()?;
                if target.is_some() || names.len() < 2 {
                    return Err(key.error("joins columns", "join only the date and the time of [column.t_s]"));
                }
                source = Some(Source::Joined(names.into_iter().map(str::to_string).collect()));
            }
            "from" => source = Some(Source::Number(key.whole(1, 10_000)? as usize)),
            "value" if target.is_none() => {
                return Err(
                    key.error("belongs to other columns", "give `interval_s` under [source] for a fixed interval")
                );
            }
            "value" => source = Some(Source::Constant(key.number()?)),
            "unit" => rule.unit = Some(unit(&key, name)?),
            "sign" => {
                rule.sign = key.number()?;
                if rule.sign.abs() != 1.0 {
                    let remedy = "scale with `unit` or `points` instead";
                    return Err(key.error(format!("= {} must be 1 or -1", Short(rule.sign)), remedy));
                }
            }
            "offset" => rule.offset += key.number()?,
            "points" => {
                let remedy = "write two readings and what they mean, like [[4, -5.0], [20, 5.0]]";
                let [one, other] = <[[f64; 2]; 2]>::try_from(key.points()?)
                    .map_err(|points| key.error(format!("has {} points", points.len()), remedy))?;
                let span = other[0] - one[0];
                if target.is_none() || span == 0.0 || one[1] == other[1] || !((other[1] - one[1]) / span).is_finite() {
                    return Err(key.error("does not give a straight line", remedy));
                }
                rule.points = Some([one, other]);
            }
            "shift_s" => {
                rule.shift_s = key.number()?;
                if target.is_none() {
                    return Err(key.error("belongs to other columns", "shift those that another clock has stamped"));
                }
                if rule.shift_s.abs() > MOST_SHIFT_S {
                    let remedy =
                        format!("give seconds within ±{MOST_SHIFT_S}; align recordings that lie farther apart first");
                    return Err(key.error(format!("= {} is no offset of a clock", rule.shift_s), remedy));
                }
            }
            "gauge" => {
                if !name.starts_with("p_") {
                    return Err(key.error("belongs to pressures only", "remove it"));
                }
                if key.flag()? {
                    let remedy = "add `atmosphere_pa = 1.013e5` under [source]";
                    rule.offset += atmosphere_pa.ok_or_else(|| key.error("needs the atmospheric pressure", remedy))?;
                }
            }
            "time" | "format" if target.is_some() => return Err(key.error("belongs to [column.t_s] only", "remove it")),
            "time" => {
                rule.time = match key.string()? {
                    "number" => TimeCells::Number,
                    "datetime" => TimeCells::DateTime { format: None },
                    "clock" => TimeCells::Clock,
                    other => {
                        let problem = format!("= \"{}\" is not known", other.escape_debug());
                        return Err(key.error(problem, "use \"number\", \"datetime\" or \"clock\" (time of day)"));
                    }
                };
            }
            "format" => {
                let text = key.string()?;
                if !stamps::is_format(text) {
                    let remedy = "write it like \"%d/%m/%Y %H:%M:%S%.f\"";
                    return Err(key.error(format!("= \"{}\" is no format", text.escape_debug()), remedy));
                }
                format = Some((text.to_string(), key.clone()));
            }
            _ => return Err(key.unknown(COLUMN_KEYS)),
        }
    }
    match (&mut rule.time, format) {
        (TimeCells::DateTime { format }, Some((text, _))) => *format = Some(text),
        (_, Some((_, key))) => return Err(key.error("needs `time = \"datetime\"`", "add it, or remove the format")),
        _ => {}
    }
    rule.source = source
        .ok_or_else(|| entry.error("has no source", "add `from = NUMBER`, `from = \"NAME\"` or `value = NUMBER`"))?;
    if rule.time == TimeCells::Number && matches!(rule.source, Source::Joined(_)) {
        return Err(entry.error("joins columns", "add `time = \"datetime\"`"));
    }
    if matches!(rule.source, Source::Constant(_)) {
        // A constant stands in the mapping as it is meant, in SI.
        (rule.unit, rule.sign, rule.offset, rule.points) = (None, 1.0, 0.0, None);
    }
    Ok(rule)
}

fn unit(key: &Entry<'_>, column: &str) -> Result<(String, f64), InputError> {
    let (text, quantity) = (key.string()?, Quantity::of(column));
    if let Some(factor) = units::factor(quantity, text) {
        return Ok((text.to_string(), factor));
    }
    let signal = units::read(text).and_then(|written| written.signal);
    let remedy = match signal {
        Some(signal) => format!("{}; units are: {}", units::two_readings(signal, quantity), units::names(quantity)),
        None => format!("use one of: {}", units::names(quantity)),
    };
    Err(key.error(format!("= \"{}\" is no unit of {column}", text.escape_debug()), remedy))
}
