//! Rows of a foreign table → a log, and what was done on the way.

use super::columns::{Found, Table};
use super::hints;
use super::rows::{Count, Rows};
use super::separator::{Separator, clean};
use super::units::{self, Quantity};
use super::{ColumnRule, Mapping};
use rig_files::{Column, InputError, Log, quotes_close};

/// A log, and sentences about what was done to get it.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The log.
    pub log: Log,
    /// What was left out, joined, or taken from the header.
    pub notes: Vec<String>,
}

/// A row of the table.
#[derive(Default)]
struct Row {
    /// The line it begins in.
    line: u64,
    fields: Vec<String>,
    /// The error that a field goes on in the next line: names may, numbers may not.
    broken: Option<InputError>,
}

impl Mapping {
    pub(super) fn convert_text(&self, text: &str, file: &str) -> Result<Imported, InputError> {
        let (numbers, lines): (Vec<u64>, Vec<&str>) = text
            .lines()
            .enumerate()
            .map(|(at, line)| (at as u64 + 1, line))
            .skip(self.skip_lines)
            .filter(|(_, line)| !line.trim().is_empty())
            .filter(|(_, line)| self.comment.is_none_or(|mark| !line.trim_start().starts_with(mark)))
            .unzip();
        if self.numbers.decimal_comma && self.separator == Separator::Byte(b',') && !text.contains('"') {
            let remedy = "a table with decimal commas is separated by \"semicolon\" or \"tab\", or quotes its numbers";
            return Err(InputError::new(&self.file, "`source.decimal_comma` contradicts the separator", remedy));
        }
        let mut rows = self.rows(&numbers, &lines, file).peekable();
        let mut next = |what: &str, key: &str| {
            let missing = || InputError::new(file, format!("has no {what}"), format!("check `{key}` in {}", self.file));
            let row = rows.next().ok_or_else(missing)??;
            match row.broken {
                // A quote that no line closes has taken all rows.
                Some(error) if rows.peek().is_none() => Err(error),
                _ => Ok(row.fields),
            }
        };
        let (mut names, mut written) = (Vec::new(), Vec::new());
        if self.header {
            names = next("header row", "skip_lines")?;
        }
        if self.units_line {
            written = next("line of units", "units_line")?;
        }
        let source = Table { file, names: &names, numbers: &numbers, lines: &lines };
        let found = self.places(&source)?;
        let mut notes = Vec::new();
        let rules = self.with_units(&names, &written, &found, &mut notes);
        let mut table = Rows::new(self, &rules, &found, &source);
        while let Some(row) = rows.next() {
            let Row { line, fields, broken } = row?;
            if self.header && (fields == names || (self.units_line && fields == written)) {
                table.count.repeated_headers += usize::from(fields == names);
                continue;
            }
            broken.map_or(Ok(()), Err)?;
            table.take(line, &fields, rows.peek().is_none())?;
        }
        let (columns, count) = (table.values, table.count);
        self.say(&count, &mut notes);
        let mut log = self.assemble(&rules, &found, columns, &count, &source, &mut notes)?;
        for rule in rules.iter().filter(|rule| rule.shift_s != 0.0) {
            if let Some(column) = rule.target {
                log.set(column, log.shifted(column, rule.shift_s));
            }
        }
        for column in Column::ALL {
            let Some(values) = log.column(column) else { continue };
            let blank = values.iter().filter(|value| value.is_nan()).count();
            if blank > 0 {
                notes.push(format!("{}: {blank} of {} samples are missing", column.name(), values.len()));
            }
        }
        Ok(Imported { log, notes })
    }

    fn say(&self, count: &Count, notes: &mut Vec<String>) {
        let times = |count: usize, what: &str, whats: &str| match count {
            1 => format!("1 {what}"),
            count => format!("{count} {whats}"),
        };
        notes.insert(0, format!("{} read", times(count.rows, "row", "rows")));
        if count.repeated_headers > 0 {
            notes.push(format!("{} left out", times(count.repeated_headers, "repeated header", "repeated headers")));
        }
        if count.without_time.0 > 0 {
            let (rows, first) = count.without_time;
            notes.push(format!("{} without a time left out, the first in line {first}", times(rows, "row", "rows")));
        }
        if count.joined > 0 {
            notes.push(format!("{} joined with the row before, of the same time", times(count.joined, "row", "rows")));
        }
        if count.cut_off {
            notes.push("the last line is cut off, and left out".into());
        }
    }

    /// The rules with the units that the header states where the mapping does not.
    fn with_units(
        &self,
        names: &[String],
        written: &[String],
        found: &[Found],
        notes: &mut Vec<String>,
    ) -> Vec<ColumnRule> {
        let mut rules = self.columns.clone();
        for (rule, found) in rules.iter_mut().zip(found) {
            let Found::At(place) = found else { continue };
            let of_line = written.get(*place).and_then(|text| units::read(text));
            let of_name = || names.get(*place).and_then(|name| units::split(name).1);
            let Some(unit) = of_line.or_else(of_name) else { continue };
            notes.extend(hints::other_unit(rule, &unit));
            if let (Some((quantity, name, factor)), None, None) = (unit.unit, &rule.unit, rule.points)
                && quantity == Quantity::of(rule.name)
            {
                rule.unit = Some((name.to_string(), factor));
                if factor != 1.0 {
                    notes.push(format!("{}: unit {name} taken from the header", rule.name));
                }
            }
        }
        rules
    }

    /// The log, of the values of the time and of each other column.
    fn assemble(
        &self,
        rules: &[ColumnRule],
        found: &[Found],
        values: Vec<Vec<f64>>,
        count: &Count,
        source: &Table<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Log, InputError> {
        let file = source.file;
        let mut log = Log::default();
        let mut values = values.into_iter();
        log.t_s = values.next().unwrap_or_default();
        let of_rule = |of: Option<Column>| rules.iter().zip(found).find(|(rule, _)| rule.target == of);
        let empty = |(rule, found): (&ColumnRule, &Found)| {
            let places = match found {
                Found::At(place) => std::slice::from_ref(place),
                Found::Joined(places) => places,
                Found::Constant(_) => &[],
            };
            let columns: Vec<String> = places.iter().map(|place| source.column(*place)).collect();
            let (name, columns) = (rule.name, columns.join(" and "));
            let problem = format!("no row has a sample in column {columns}, which {} takes for {name}", self.file);
            let remedy = format!("record it, or let `from` under [column.{name}] in {} name another column", self.file);
            InputError::new(file, problem, remedy)
        };
        if log.is_empty() {
            if let Some(time) = of_rule(None).filter(|_| count.without_time.0 > 0) {
                return Err(empty(time));
            }
            let remedy = format!("check `skip_lines`, `comment` and `header` in {}", self.file);
            return Err(InputError::new(file, "has no data", remedy));
        }
        let mut without = Vec::new();
        for (rule, values) in rules.iter().filter(|rule| rule.target.is_some()).zip(values) {
            if let Some(column) = rule.target {
                let any = values.iter().any(|value| value.is_finite());
                log.set(column, any.then_some(values));
                without.extend((!any).then_some(column));
            }
        }
        let others = Column::ALL.into_iter().any(|column| column != Column::Y && log.column(column).is_some());
        let needed = without.iter().find(|column| **column == Column::Y || !others);
        if let Some(column) = needed.and_then(|column| of_rule(Some(*column))) {
            return Err(empty(column));
        }
        notes
            .extend(without.into_iter().filter_map(|column| of_rule(Some(column))).map(|column| empty(column).problem));
        // What was written must be readable: the same rules as for any log.
        Log::parse(log.to_csv().into_bytes(), file)
    }

    /// The fields of each row and the number of the line it begins in. `numbers` belong to `lines`, which hold no comments.
    fn rows<'a>(
        &self,
        numbers: &'a [u64],
        lines: &'a [&str],
        file: &'a str,
    ) -> Box<dyn Iterator<Item = Result<Row, InputError>> + 'a> {
        let separator = self.separator;
        let Separator::Byte(byte) = separator else {
            let row = move |(line, text): (&u64, &&str)| {
                Ok(Row { line: *line, fields: separator.cells(text), ..Row::default() })
            };
            return Box::new(numbers.iter().zip(lines).map(row));
        };
        let table = std::io::Cursor::new(lines.join("\n"));
        let mut reader = csv::ReaderBuilder::new();
        let records = reader.delimiter(byte).has_headers(false).flexible(true).from_reader(table).into_records();
        let map = self.file.clone();
        Box::new(records.map(move |record| {
            let record = record.map_err(|error| {
                InputError::new(file, format!("is no table: {error}"), format!("check `separator` in {map}"))
            })?;
            // A field between quotes may go on over several lines.
            let line = record.position().map_or(0, |position| position.line().saturating_sub(1)) as usize;
            let line = numbers.get(line).copied().unwrap_or_default();
            let broken = quotes_close(record.as_slice(), file, line).err();
            Ok(Row { line, fields: record.iter().map(clean).collect(), broken })
        }))
    }
}
