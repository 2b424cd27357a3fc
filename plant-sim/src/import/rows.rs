//! Rows of a foreign table → the values of each column: times that go on, cells in SI, and what was left out or joined.

use super::cells::Cell;
use super::columns::{Found, Table};
use super::hints::{self, Place};
use super::separator::Separator;
use super::stamps::{self, DAY_NS, SECOND_NS};
use super::{ColumnRule, Mapping, TimeCells, units};
use rig_files::{InputError, Short, shorten};

/// What was left out or joined.
#[derive(Default)]
pub(super) struct Count {
    pub(super) rows: usize,
    pub(super) repeated_headers: usize,
    pub(super) joined: usize,
    pub(super) without_time: (usize, u64),
    pub(super) cut_off: bool,
}

/// The rows read so far.
pub(super) struct Rows<'a> {
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
    pub(super) values: Vec<Vec<f64>>,
    pub(super) count: Count,
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
    pub(super) fn new(
        mapping: &'a Mapping,
        rules: &'a [ColumnRule],
        found: &'a [Found],
        source: &'a Table<'a>,
    ) -> Self {
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

    pub(super) fn take(&mut self, line: u64, fields: &[String], last: bool) -> Result<(), InputError> {
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
        let problem = format!("column {column} is `{}`, which is no finite number in SI", shorten(cell));
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
