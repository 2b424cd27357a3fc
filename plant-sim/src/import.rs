//! Foreign tables → logs, by a mapping file: which column, which unit, which sign, gauge or absolute.
//!
//! A value becomes `sign · value · unit + offset`, and a gauge pressure gains the atmosphere. Units, offsets and the
//! atmosphere are those of the mapping; the result is SI as the log format wants it.

mod units;

use rig_files::{Column, Document, Entry, InputError, Log, read_text};
use std::path::Path;
use units::{UNITS, unit_factor};

/// A parsed mapping file.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapping {
    file: String,
    separator: Separator,
    header: bool,
    skip_lines: usize,
    comment: Option<char>,
    decimal_comma: bool,
    rebase_time: bool,
    columns: Vec<ColumnRule>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Separator {
    Byte(u8),
    Blanks,
}

#[derive(Clone, Debug, PartialEq)]
struct ColumnRule {
    /// `None` is the time.
    target: Option<Column>,
    source: Source,
    factor: f64,
    offset: f64,
}

/// The line a row begins in, and its fields.
type Row = (u64, Vec<String>);

#[derive(Clone, Debug, PartialEq)]
enum Source {
    Number(usize),
    Name(String),
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
const SOURCE_KEYS: [&str; 7] =
    ["separator", "header", "skip_lines", "comment", "decimal_comma", "atmosphere_pa", "time_from_zero"];
const COLUMN_KEYS: [&str; 6] = ["from", "value", "unit", "sign", "offset", "gauge"];
const SEPARATORS: [(&str, Separator); 8] = [
    ("comma", Separator::Byte(b',')),
    (",", Separator::Byte(b',')),
    ("semicolon", Separator::Byte(b';')),
    (";", Separator::Byte(b';')),
    ("tab", Separator::Byte(b'\t')),
    ("\t", Separator::Byte(b'\t')),
    ("space", Separator::Blanks),
    (" ", Separator::Blanks),
];

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
    /// Not TOML; an unknown key, unit, separator or target column; a column without a source; no time or position.
    pub fn parse(text: &str, file: &str) -> Result<Self, InputError> {
        let document = Document::parse(text, file)?;
        let mut mapping = Self {
            file: file.to_string(),
            separator: Separator::Byte(b','),
            header: true,
            skip_lines: 0,
            comment: None,
            decimal_comma: false,
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
                mapping.columns.push(rule);
            }
        }
        for (needed, target) in [("t_s", None), ("y_m", Some(Column::Y))] {
            if !mapping.columns.iter().any(|rule| rule.target == target) {
                let remedy = format!("add a table [column.{needed}] that says where it comes from");
                return Err(InputError::new(file, format!("`column.{needed}` is missing"), remedy));
            }
        }
        if mapping.decimal_comma && mapping.separator == Separator::Byte(b',') {
            let remedy = "a table with decimal commas is separated by \"semicolon\" or \"tab\"";
            return Err(InputError::new(file, "`source.decimal_comma` contradicts the separator", remedy));
        }
        Ok(mapping)
    }

    fn source(&mut self, table: &Entry<'_>, atmosphere_pa: &mut Option<f64>) -> Result<(), InputError> {
        for entry in table.table()? {
            match entry.name {
                "separator" => {
                    let name = entry.string()?;
                    let known = SEPARATORS.iter().find(|(known, _)| *known == name);
                    self.separator = known.map(|(_, separator)| *separator).ok_or_else(|| {
                        entry.error(
                            format!("= \"{}\" is not known", name.escape_debug()),
                            "use \"comma\", \"semicolon\", \"tab\" or \"space\"",
                        )
                    })?;
                }
                "header" => self.header = entry.flag()?,
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
                "decimal_comma" => self.decimal_comma = entry.flag()?,
                "time_from_zero" => self.rebase_time = entry.flag()?,
                "atmosphere_pa" => {
                    let value = entry.number()?;
                    if !(1.0e4..=1.2e5).contains(&value) {
                        return Err(entry.error(format!("= {value} is not plausible"), "give it in Pa, about 1.013e5"));
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
    /// The table cannot be read, a mapped column is not in it, a field is no number, or the result is no log (see
    /// [`Log::parse`]): each with the line in the foreign file.
    pub fn convert_file(&self, path: &Path) -> Result<Log, InputError> {
        self.convert(&read_text(path)?, &path.display().to_string())
    }

    /// [`Mapping::convert_file`] on text.
    ///
    /// # Errors
    /// As [`Mapping::convert_file`].
    pub fn convert(&self, text: &str, file: &str) -> Result<Log, InputError> {
        let (numbers, lines): (Vec<u64>, Vec<&str>) = text
            .lines()
            .enumerate()
            .map(|(at, line)| (at as u64 + 1, line))
            .skip(self.skip_lines)
            .filter(|(_, line)| !line.trim().is_empty())
            .filter(|(_, line)| self.comment.is_none_or(|mark| !line.trim_start().starts_with(mark)))
            .unzip();
        let mut rows = self.rows(&numbers, &lines, file);

        let mut names = Vec::new();
        if self.header {
            let Some(row) = rows.next() else {
                return Err(InputError::new(file, "has no header row", "check `skip_lines` in the mapping"));
            };
            names = row?.1;
        }
        let places = self.places(&names, file)?;
        let mut values: Vec<Vec<f64>> = vec![Vec::new(); self.columns.len()];
        let mut last_t = f64::NEG_INFINITY;
        for row in rows {
            let (number, fields) = row?;
            for (at, rule) in self.columns.iter().enumerate() {
                let value = match places[at] {
                    Err(constant) => constant,
                    Ok(place) => self.number(&fields, place, rule.target.is_none(), file, number)? * rule.factor,
                } + rule.offset;
                if rule.target.is_none() {
                    if value <= last_t {
                        let problem = format!("the time goes from {last_t} s to {value} s");
                        let remedy = "remove repeated rows, and check the unit and the column of the time";
                        return Err(InputError::new(file, problem, remedy).at_line(number));
                    }
                    last_t = value;
                }
                values[at].push(value);
            }
        }
        self.assemble(values, file)
    }

    fn assemble(&self, values: Vec<Vec<f64>>, file: &str) -> Result<Log, InputError> {
        let mut log = Log::default();
        for (rule, values) in self.columns.iter().zip(values) {
            match rule.target {
                None => log.t_s = values,
                Some(column) => {
                    let any = values.iter().any(|value| value.is_finite());
                    log.set(column, any.then_some(values));
                }
            }
        }
        if log.is_empty() {
            return Err(InputError::new(
                file,
                "has no data",
                "check `skip_lines`, `comment` and `header` in the mapping",
            ));
        }
        if self.rebase_time {
            let start_s = log.t_s[0];
            for t_s in &mut log.t_s {
                *t_s -= start_s;
            }
        }
        // What was written must be readable: the same rules as for any log.
        Log::parse(log.to_csv().into_bytes(), file)
    }

    /// Where each rule finds its field, or its constant.
    fn places(&self, names: &[String], file: &str) -> Result<Vec<Result<usize, f64>>, InputError> {
        self.columns
            .iter()
            .map(|rule| match &rule.source {
                Source::Constant(value) => Ok(Err(*value)),
                Source::Number(number) => Ok(Ok(number - 1)),
                Source::Name(name) => match names.iter().position(|known| known == name) {
                    Some(place) => Ok(Ok(place)),
                    None => Err(InputError::new(
                        file,
                        format!("has no column `{name}`, which {} asks for", self.file),
                        format!("use one of: {}", names.join(", ")),
                    )),
                },
            })
            .collect()
    }

    /// The fields of each row and the number of the line it begins in. `numbers` belong to `lines`, which hold no comments.
    fn rows<'a>(
        &self,
        numbers: &'a [u64],
        lines: &'a [&str],
        file: &'a str,
    ) -> Box<dyn Iterator<Item = Result<Row, InputError>> + 'a> {
        let clean = |field: &str| field.trim().trim_matches('"').trim().to_string();
        let Separator::Byte(byte) = self.separator else {
            let fields = move |line: &str| line.split_whitespace().map(clean).collect();
            return Box::new(numbers.iter().zip(lines).map(move |(number, line)| Ok((*number, fields(line)))));
        };
        let table = std::io::Cursor::new(lines.join("\n"));
        let mut reader = csv::ReaderBuilder::new();
        let records = reader.delimiter(byte).has_headers(false).flexible(true).from_reader(table).into_records();
        Box::new(records.map(move |record| {
            let record = record.map_err(|error| {
                InputError::new(file, format!("is no table: {error}"), "check `separator` in the mapping")
            })?;
            // A field between quotes may go on over several lines.
            let line = record.position().map_or(0, |position| position.line().saturating_sub(1)) as usize;
            Ok((numbers.get(line).copied().unwrap_or_default(), record.iter().map(clean).collect()))
        }))
    }

    fn number(
        &self,
        fields: &[String],
        place: usize,
        required: bool,
        file: &str,
        line: u64,
    ) -> Result<f64, InputError> {
        let Some(field) = fields.get(place) else {
            let problem = format!("has {} fields, but column {} is asked for", fields.len(), place + 1);
            let remedy = "check the separator and the column numbers of the mapping (counted from 1)";
            return Err(InputError::new(file, problem, remedy).at_line(line));
        };
        let blank = field.is_empty() || field.eq_ignore_ascii_case("nan");
        if blank && !required {
            return Ok(f64::NAN);
        }
        let text = if self.decimal_comma { field.replace(',', ".") } else { field.clone() };
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let shown: String = field.chars().take(40).flat_map(char::escape_debug).collect();
                let problem = format!("column {} is `{shown}` where a number belongs", place + 1);
                let remedy = "check `header`, `skip_lines`, `separator` and `decimal_comma` in the mapping";
                Err(InputError::new(file, problem, remedy).at_line(line))
            }
        }
    }
}

fn column_rule(entry: &Entry<'_>, header: bool, atmosphere_pa: Option<f64>) -> Result<ColumnRule, InputError> {
    let Some((name, target)) = TARGETS.iter().find(|(name, _)| *name == entry.name) else {
        return Err(entry.unknown(TARGETS.iter().map(|(name, _)| *name)));
    };
    let (mut source, mut factor, mut sign, mut offset) = (None, 1.0, 1.0, 0.0);
    for key in entry.table()? {
        match key.name {
            "from" if key.is_string() => {
                if !header {
                    let remedy = "give the column's number from 1, or set source.header = true";
                    return Err(key.error("is a name, but the table has no header", remedy));
                }
                source = Some(Source::Name(key.string()?.to_string()));
            }
            "from" => source = Some(Source::Number(key.whole(1, 10_000)? as usize)),
            "value" => source = Some(Source::Constant(key.number()?)),
            "unit" => {
                let unit = key.string()?;
                factor = unit_factor(name, unit).ok_or_else(|| {
                    let fitting = UNITS.iter().filter(|(column, _, _)| column.contains(name)).map(|(_, unit, _)| *unit);
                    let fitting = fitting.collect::<Vec<_>>().join(", ");
                    key.error(
                        format!("= \"{}\" is no unit of {name}", unit.escape_debug()),
                        format!("use one of: {fitting}"),
                    )
                })?;
            }
            "sign" => {
                sign = key.number()?;
                if sign.abs() != 1.0 {
                    return Err(key.error(format!("= {sign} must be 1 or -1"), "scale with `unit` instead"));
                }
            }
            "offset" => offset += key.number()?,
            "gauge" => {
                if !name.starts_with("p_") {
                    return Err(key.error("belongs to pressures only", "remove it"));
                }
                if key.flag()? {
                    let remedy = "add `atmosphere_pa = 1.013e5` under [source]";
                    offset += atmosphere_pa.ok_or_else(|| key.error("needs the atmospheric pressure", remedy))?;
                }
            }
            _ => return Err(key.unknown(COLUMN_KEYS)),
        }
    }
    let source = source
        .ok_or_else(|| entry.error("has no source", "add `from = NUMBER`, `from = \"NAME\"` or `value = NUMBER`"))?;
    // A constant stands in the mapping as it is meant, in SI.
    let (factor, offset) = if matches!(source, Source::Constant(_)) { (1.0, 0.0) } else { (sign * factor, offset) };
    Ok(ColumnRule { target: *target, source, factor, offset })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MAP: &str = "[source]\ncomment = \"#\"\nskip_lines = 1\n[column.t_s]\nfrom = \"t\"\n\
                       [column.y_m]\nfrom = \"stroke, from mid\"\nunit = \"mm\"\n[column.u_v]\nvalue = 1.0\n";

    #[test]
    fn separators_between_quotes_separate_nothing() {
        let mapping = Mapping::parse(MAP, "map.toml").expect("a mapping");
        let table = "made, by hand\n\n t ,\"stroke, from mid\",\"a \"\"b\"\"\"\n# 1, \"\n0.0,\"1.5\",x\n0.1, \"2.5\" ,\"x,\ny\"\n0.2,3,x\n";
        let log = mapping.convert(table, "table.csv").expect("a log");
        assert_eq!((log.t_s, log.y_m), (vec![0.0, 0.1, 0.2], vec![1.5e-3, 2.5e-3, 3.0e-3]));
    }

    #[test]
    fn an_error_names_the_line_of_the_file_whatever_was_left_out_before() {
        let mapping = Mapping::parse(MAP, "map.toml").expect("a mapping");
        let table = "x\nt,\"stroke, from mid\"\n\n# 1\n0.0,\"1\n\"\n0.1,mid\n";
        let error = mapping.convert(table, "table.csv").expect_err("`mid` is no number").to_string();
        assert!(error.contains("table.csv, line 7") && error.contains("`mid`"), "{error}");
    }
}
