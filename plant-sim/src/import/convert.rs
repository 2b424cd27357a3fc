//! Rows of a foreign table → a log, and what was done on the way.

use super::cells::Cell;
use super::hints::{self, Place};
use super::separator::{LOOKED_AT, Separator, clean};
use super::stamps::{self, DAY_NS, SECOND_NS};
use super::units::{self, Quantity};
use super::{ColumnRule, Mapping, Source, TimeCells};
use rig_files::{Column, InputError, Log, Short, quotes_close};

/// A log, and sentences about what was done to get it.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The log.
    pub log: Log,
    /// What was left out, joined, or taken from the header.
    pub notes: Vec<String>,
}

/// How many names of columns an error carries.
const MOST_NAMES: usize = 40;

/// A row of the table.
#[derive(Default)]
struct Row {
    /// The line it begins in.
    line: u64,
    fields: Vec<String>,
    /// The error that a field goes on in the next line: names may, numbers may not.
    broken: Option<InputError>,
}

/// Where a rule finds its cell.
#[derive(Clone, Debug)]
enum Found {
    At(usize),
    Joined(Vec<usize>),
    Constant(f64),
}

/// What was left out or joined.
#[derive(Default)]
struct Count {
    rows: usize,
    repeated_headers: usize,
    joined: usize,
    without_time: (usize, u64),
    cut_off: bool,
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

    /// The error of a column that the header does not name, with the line of the mapping that would find it.
    fn no_column(&self, name: &str, source: &Table<'_>) -> InputError {
        let problem = format!("has no column `{}`, which {} asks for", name.escape_debug(), self.file);
        // Whether a line names all columns of the mapping.
        let names_all = |cells: &[String]| {
            let mut asked = self.columns.iter().flat_map(|rule| match &rule.source {
                Source::Name(name) => std::slice::from_ref(name),
                Source::Joined(names) => names,
                Source::Number(_) | Source::Constant(_) => &[],
            });
            asked.all(|name| !named(cells, name).is_empty())
        };
        // This separator first: then a line to be skipped is all that is wrong.
        let others = Separator::ALL.into_iter().filter(|other| *other != self.separator);
        let header = std::iter::once(self.separator).chain(others).find_map(|separator| {
            let at = source.lines.iter().take(LOOKED_AT).position(|line| names_all(&separator.cells(line)))?;
            Some((separator, source.numbers[at] - 1)).filter(|found| *found != (self.separator, self.skip_lines as u64))
        });
        let cut = || self.separator.other(|other| source.names.len() == 1 && source.is_cut_by(other, 2));
        let header = header.or_else(|| Some((cut()?, self.skip_lines as u64)));
        let remedy = match header {
            Some((separator, skipped)) => {
                let separator =
                    (separator != self.separator).then(|| format!("`separator = \"{}\"`", separator.name()));
                let skipped = (skipped > self.skip_lines as u64).then(|| format!("`skip_lines = {skipped}`"));
                let lines: Vec<String> = separator.into_iter().chain(skipped).collect();
                format!("set {} under [source] in {}", lines.join(" and "), self.file)
            }
            None => {
                let known: Vec<String> =
                    source.names.iter().filter(|name| !name.is_empty()).map(|name| shown(name)).collect();
                let more = known.len().saturating_sub(MOST_NAMES);
                let more = if more > 0 { format!(" and {more} more") } else { String::new() };
                format!("use one of: {}{more}", known[..known.len().min(MOST_NAMES)].join(", "))
            }
        };
        InputError::new(source.file, problem, remedy)
    }

    /// Where each rule finds its cell, or its constant.
    fn places(&self, source: &Table<'_>) -> Result<Vec<Found>, InputError> {
        let place = |name: &str| match named(source.names, name)[..] {
            [at] => Ok(at),
            [] => Err(self.no_column(name, source)),
            [first, second, ..] => Err(InputError::new(
                source.file,
                format!("has more than one column `{}`, which {} asks for", name.escape_debug(), self.file),
                format!("give its number: from = {} or from = {}", first + 1, second + 1),
            )),
        };
        self.columns
            .iter()
            .map(|rule| match &rule.source {
                Source::Constant(value) => Ok(Found::Constant(*value)),
                Source::Number(number) => Ok(Found::At(number - 1)),
                Source::Name(name) => place(name).map(Found::At),
                Source::Joined(names) => {
                    names.iter().map(|name| place(name)).collect::<Result<_, _>>().map(Found::Joined)
                }
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

/// The table as it was read.
struct Table<'a> {
    file: &'a str,
    /// Of its columns; none without a header.
    names: &'a [String],
    /// Its lines, the header first, and their numbers in the file.
    lines: &'a [&'a str],
    numbers: &'a [u64],
}

impl Table<'_> {
    /// How a message calls a column.
    fn column(&self, place: usize) -> String {
        match self.names.get(place) {
            Some(name) if !name.is_empty() => format!("`{}`", shown(name)),
            _ => (place + 1).to_string(),
        }
    }

    /// Whether a separator cuts the first two lines into so many cells or more, one of them at most with a separator at its end.
    fn is_cut_by(&self, separator: Separator, least: usize) -> bool {
        let [first, second] = [0, 1].map(|at| self.lines.get(at).map_or(0, |line| separator.cells(line).len()));
        first.min(second) >= least && first.abs_diff(second) <= 1
    }
}

/// The places of a name: as it stands; else without its unit, capitals aside.
fn named(names: &[String], name: &str) -> Vec<usize> {
    let alike = |known: &String| units::split(known).0.eq_ignore_ascii_case(name.trim());
    let places = |is: &dyn Fn(&String) -> bool| (0..names.len()).filter(|at| is(&names[*at])).collect::<Vec<usize>>();
    let exact = places(&|known| known == name);
    if exact.is_empty() { places(&alike) } else { exact }
}

/// Text of a file, as much of it as an error carries.
fn shown(text: &str) -> String {
    text.chars().take(40).flat_map(char::escape_debug).collect()
}

/// The rows read so far.
struct Rows<'a> {
    mapping: &'a Mapping,
    rules: &'a [ColumnRule],
    found: &'a [Found],
    source: &'a Table<'a>,
    /// How many fields a row can have: those of the header, or of the first row.
    width: Option<usize>,
    /// How many the row before had.
    before: usize,
    clock: Clock,
    /// The time, then each other column of the mapping.
    values: Vec<Vec<f64>>,
    count: Count,
}

/// Where the time stands.
#[derive(Default)]
struct Clock {
    reader: stamps::Reader,
    /// The first stamp in nanoseconds, or the first number.
    origin_ns: Option<i128>,
    origin: Option<f64>,
    zoned: bool,
    /// Time of day of the last row, and how often midnight has passed.
    last_ns: i128,
    days: i128,
    /// A stamp had a fraction of a second.
    fractions: bool,
}

impl<'a> Rows<'a> {
    fn new(mapping: &'a Mapping, rules: &'a [ColumnRule], found: &'a [Found], source: &'a Table<'a>) -> Self {
        let columns = 1 + rules.iter().filter(|rule| rule.target.is_some()).count();
        let width = mapping.header.then_some(source.names.len());
        let values = vec![Vec::new(); columns];
        Self {
            mapping,
            rules,
            found,
            source,
            width,
            before: 0,
            clock: Clock::default(),
            values,
            count: Count::default(),
        }
    }

    fn error(&self, line: u64, problem: String, remedy: String) -> InputError {
        InputError::new(self.source.file, problem, remedy).at_line(line)
    }

    fn take(&mut self, line: u64, fields: &[String], last: bool) -> Result<(), InputError> {
        let map = &self.mapping.file;
        let width = *self.width.get_or_insert(fields.len());
        for found in self.found {
            if let Found::At(place) = found
                && *place >= width
            {
                let fields = if width == 1 { "field" } else { "fields" };
                let problem = format!("has {width} {fields}, but column {} is asked for", place + 1);
                let other = self.mapping.separator.other(|other| self.source.is_cut_by(other, place + 1));
                let remedy = match other {
                    Some(other) => format!("set `separator = \"{}\"` under [source] in {map}", other.name()),
                    None => format!("check `separator` and the column numbers (counted from 1) in {map}"),
                };
                return Err(self.error(line, problem, remedy));
            }
        }
        // A quote that the last line leaves open is cut off, too, and the number behind it.
        let open = || self.source.lines.last().is_some_and(|line| self.mapping.separator.leaves_open(line));
        if last && (fields.len() < self.before || open()) {
            self.count.cut_off = true;
            return Ok(());
        }
        self.before = fields.len();
        if fields.get(width..).is_some_and(|more| more.iter().any(|field| !field.is_empty())) {
            let commas = self.mapping.separator == Separator::Byte(b',') && fields.len() + 1 >= 2 * width;
            let remedy = if commas {
                "numbers with decimal commas must be quoted, or separated by semicolons or tabs".into()
            } else {
                format!("check `separator` and `skip_lines` in {map}; a cell that holds the separator must be quoted")
            };
            return Err(self.error(line, format!("has {} fields where {width} belong", fields.len()), remedy));
        }
        self.count.rows += 1;
        let Some(t_s) = self.time(line, fields)? else {
            let (count, first) = self.count.without_time;
            self.count.without_time = (count + 1, if count == 0 { line } else { first });
            return Ok(());
        };
        let mut row = Vec::with_capacity(self.values.len());
        for (rule, found) in self.rules.iter().zip(self.found).filter(|(rule, _)| rule.target.is_some()) {
            row.push(match found {
                Found::Constant(value) => *value,
                Found::At(place) => self.sample(rule, *place, fields.get(*place).map_or("", String::as_str), line)?,
                Found::Joined(_) => f64::NAN,
            });
        }
        match self.values[0].last() {
            Some(before) if t_s == *before => self.join(line, t_s, &row),
            Some(before) if t_s < *before => Err(self.backwards(line, *before, t_s)),
            _ => {
                self.values[0].push(t_s);
                self.values[1..].iter_mut().zip(row).for_each(|(values, value)| values.push(value));
                Ok(())
            }
        }
    }

    /// A second row of one time: what one of them lacks the other may have.
    fn join(&mut self, line: u64, t_s: f64, row: &[f64]) -> Result<(), InputError> {
        let contradicts = self.values[1..]
            .iter()
            .zip(row)
            .any(|(values, new)| values.last().is_some_and(|old| !old.is_nan() && !new.is_nan() && old != new));
        if contradicts {
            let stamped = self.clock.origin_ns.is_some() && !self.clock.fractions;
            let (problem, remedy) = if stamped {
                (
                    "has the time of the row before and other values: the stamps seem to be without fractions of a second".into(),
                    format!(
                        "export them with fractions; or remove [column.t_s] in {} and give `interval_s` under [source]",
                        self.mapping.file
                    ),
                )
            } else {
                (
                    format!("has the time of the row before, {} s, and other values", Short(t_s)),
                    format!(
                        "remove one of the rows, export the time with more digits, or remove [column.t_s] in {} and give \
                         `interval_s` under [source]",
                        self.mapping.file
                    ),
                )
            };
            return Err(self.error(line, problem, remedy));
        }
        for (values, new) in self.values[1..].iter_mut().zip(row) {
            if let Some(old) = values.last_mut()
                && old.is_nan()
            {
                *old = *new;
            }
        }
        self.count.joined += 1;
        Ok(())
    }

    fn backwards(&self, line: u64, before: f64, t_s: f64) -> InputError {
        let back_s = before - t_s;
        let remedy = if self.clock.origin_ns.is_some() && (3500.0..=3600.0).contains(&back_s) {
            "the clock was put back by an hour: cut the file here, or export the stamps with their zone or in UTC"
                .to_string()
        } else if t_s <= self.values[0].first().copied().unwrap_or(t_s) {
            "a second recording seems to begin here: cut the file here; or check the unit and the column of the time"
                .into()
        } else {
            "sort the rows, and check the unit and the column of the time".into()
        };
        let [before, t_s] = [before, t_s].map(Short);
        self.error(line, format!("the time goes from {before} s to {t_s} s"), remedy)
    }

    /// The time of a row, s; `None` if its cell is empty.
    fn time(&mut self, line: u64, fields: &[String]) -> Result<Option<f64>, InputError> {
        if let Some(interval_s) = self.mapping.interval_s {
            return Ok(Some((self.count.rows - 1) as f64 * interval_s));
        }
        let Some((rule, found)) = self.rules.iter().zip(self.found).find(|(rule, _)| rule.target.is_none()) else {
            return Ok(None);
        };
        let (cell, place) = match found {
            Found::At(place) => (fields.get(*place).cloned().unwrap_or_default(), *place),
            Found::Joined(places) => {
                let parts: Vec<&str> = places.iter().filter_map(|at| fields.get(*at)).map(String::as_str).collect();
                (parts.join(" "), places[0])
            }
            Found::Constant(_) => return Ok(None),
        };
        if self.mapping.numbers.is_missing(&cell) {
            return Ok(None);
        }
        let wrong = |rows: &Self| Err(rows.wrong(rule, place, &cell, line));
        if rule.time == TimeCells::Number {
            let Cell::Number(value) = self.mapping.numbers.read(&cell, rule.unit.as_ref().map(|unit| &unit.0[..]))
            else {
                return wrong(self);
            };
            let factor = rule.sign * rule.unit.as_ref().map_or(1.0, |unit| unit.1);
            // The difference of large numbers, such as seconds since 1970, before they lose digits in the unit.
            let t_s = if self.mapping.rebase_time {
                (value - *self.clock.origin.get_or_insert(value)) * factor
            } else {
                value * factor + rule.offset
            };
            return if t_s.is_finite() { Ok(Some(t_s)) } else { Err(self.too_large(rule, place, &cell, line)) };
        }
        let ns = if let TimeCells::DateTime { format } = &rule.time {
            let stamp = match format {
                Some(format) => stamps::formatted(&cell, format),
                None => self.clock.reader.read(&cell),
            };
            let Some(stamp) = stamp else { return wrong(self) };
            if self.clock.origin_ns.is_some() && stamp.zoned != self.clock.zoned {
                let problem = "some stamps say their zone, others do not".to_string();
                return Err(self.error(line, problem, "export all stamps in one way".into()));
            }
            self.clock.zoned = stamp.zoned;
            stamp.ns
        } else {
            let Some(ns) = stamps::time_of_day(&cell) else { return wrong(self) };
            if self.clock.origin_ns.is_some() && ns < self.clock.last_ns - DAY_NS / 2 {
                self.clock.days += 1;
            }
            self.clock.last_ns = ns;
            ns + self.clock.days * DAY_NS
        };
        self.clock.fractions |= ns % SECOND_NS != 0;
        Ok(Some((ns - *self.clock.origin_ns.get_or_insert(ns)) as f64 * 1.0e-9))
    }

    /// One sample in SI; NaN where it is missing.
    fn sample(&self, rule: &ColumnRule, place: usize, cell: &str, line: u64) -> Result<f64, InputError> {
        // Of a signal, a percentage for instance, two points say what it means.
        let signals = rule.points.iter().flat_map(|_| units::SIGNALS);
        let units = rule.unit.iter().map(|unit| &unit.0[..]).chain(signals);
        let value = match self.mapping.numbers.read(cell, units) {
            Cell::Missing => return Ok(f64::NAN),
            Cell::Number(value) => value,
            Cell::Other => return Err(self.wrong(rule, place, cell, line)),
        };
        let value = match rule.points {
            Some([[x0, y0], [x1, y1]]) => y0 + (value - x0) * (y1 - y0) / (x1 - x0),
            None => value,
        };
        let factor = rule.sign * rule.unit.as_ref().map_or(1.0, |unit| unit.1);
        let value = value * factor + rule.offset;
        if value.is_finite() { Ok(value) } else { Err(self.too_large(rule, place, cell, line)) }
    }

    /// The error of a number that its unit or its points carry beyond what a computer can hold.
    fn too_large(&self, rule: &ColumnRule, place: usize, cell: &str, line: u64) -> InputError {
        let column = self.source.column(place);
        let problem = format!("column {column} is `{}`, which is no finite number in SI", shown(cell));
        let remedy =
            format!("correct the cell, or `unit` and `points` under [column.{}] in {}", rule.name, self.mapping.file);
        self.error(line, problem, remedy)
    }

    fn wrong(&self, rule: &ColumnRule, place: usize, cell: &str, line: u64) -> InputError {
        let column = self.source.column(place);
        let mapping = self.mapping;
        let (problem, remedy) = hints::of(
            cell,
            &Place {
                map: &mapping.file,
                rule,
                numbers: &mapping.numbers,
                separator: mapping.separator,
                column: &column,
                first: self.values[0].is_empty(),
            },
        );
        self.error(line, problem, remedy)
    }
}
