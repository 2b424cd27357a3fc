//! A strict CSV table of numbers: header row, known columns, finite values, blanks where a sample is missing.

use crate::document::shorten;
use crate::error::{InputError, closest};
use crate::write::to_text;
use plant_model::Short;
use std::path::Path;

/// A column a table may have.
#[derive(Clone, Copy, Debug)]
pub struct Expected {
    /// Header text.
    pub name: &'static str,
    /// A table without it is refused.
    pub required: bool,
    /// A blank field is a missing sample (read as NaN); otherwise it is an error.
    pub blanks: bool,
}

/// Numbers by column, in the order of the expected columns; absent columns are `None`, missing samples NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// One entry per expected column.
    pub columns: Vec<Option<Vec<f64>>>,
    /// Number of data rows.
    pub rows: usize,
}

/// What to do with a logger's file.
const IMPORT: &str = "convert a logger's file with `plant-sim import`, whose --suggest drafts the mapping";
/// What to do about other encodings than UTF-8.
const ENCODING_REMEDY: &str = "save it as UTF-8 text, or convert a logger's file with `plant-sim import`";
/// What to do where fields are not those of the header.
const SEPARATOR_REMEDY: &str = "separate fields by commas, with a point for decimals; or convert a logger's file with \
                                `plant-sim import`, whose --suggest drafts the mapping";

impl Table {
    /// Reads a table from a file.
    ///
    /// # Errors
    /// The file cannot be read, or [`Table::parse`] refuses it.
    pub fn read(path: &Path, expected: &[Expected]) -> Result<Self, InputError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| InputError::unreadable(&file, &error))?;
        Self::parse(bytes, &file, expected)
    }

    /// Parses a table; the first expected column is the time and must increase from row to row.
    ///
    /// # Errors
    /// Encoding, separators, header (missing, unknown or duplicate column), a field that is no finite number, a row of
    /// another length, time that repeats or goes backwards, no data at all; each with its line.
    pub fn parse(bytes: Vec<u8>, file: &str, expected: &[Expected]) -> Result<Self, InputError> {
        let text = to_text(bytes, file, ENCODING_REMEDY)?;
        let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(text.as_bytes());
        let mut record = csv::StringRecord::new();
        let bad_csv = |error: csv::Error| InputError::new(file, format!("is not CSV: {error}"), SEPARATOR_REMEDY);

        if !reader.read_record(&mut record).map_err(bad_csv)? {
            return Err(InputError::new(file, "has no header row", "name the columns in the first line"));
        }
        let header_line = record.position().map_or(1, csv::Position::line);
        let places = header(&record, file, header_line, expected)?;
        let width = record.len();

        let guess = text.len() / (8 * width).max(1);
        let mut columns: Vec<Option<Vec<f64>>> = vec![None; expected.len()];
        for &place in &places {
            columns[place] = Some(Vec::with_capacity(guess));
        }
        let mut rows = 0;
        let mut last_t = f64::NEG_INFINITY;
        while reader.read_record(&mut record).map_err(bad_csv)? {
            let line = record.position().map_or(0, csv::Position::line);
            let at_line = |error: InputError| error.at_line(line);
            quotes_close(record.as_slice(), file, line)?;
            if record.len() != width {
                let problem = format!("has {} fields where the header names {width}", record.len());
                return Err(at_line(InputError::new(file, problem, SEPARATOR_REMEDY)));
            }
            for (&place, field) in places.iter().zip(&record) {
                let column = &expected[place];
                let value = number(field, column).map_err(|(problem, remedy)| {
                    at_line(InputError::new(file, format!("column `{}` {problem}", column.name), remedy))
                })?;
                if place == 0 {
                    if value <= last_t {
                        let problem =
                            format!("column `{}` goes from {} to {}", column.name, Short(last_t), Short(value));
                        let remedy = "time must increase from row to row: sort the rows and remove repeated ones";
                        return Err(at_line(InputError::new(file, problem, remedy)));
                    }
                    last_t = value;
                }
                if let Some(values) = &mut columns[place] {
                    values.push(value);
                }
            }
            rows += 1;
        }
        if rows == 0 {
            let remedy = "check that the program that made it has finished";
            return Err(InputError::new(file, "has a header row but no data", remedy));
        }
        Ok(Self { columns, rows })
    }
}

/// Refuses a row of which a field between quotes goes on in the next line: it is no measured number, and nearly always a quote
/// that is never closed and takes the rows below into its field.
///
/// # Errors
/// The text of the row's fields has a line break.
pub fn quotes_close(fields: &str, file: &str, line: u64) -> Result<(), InputError> {
    if !fields.contains('\n') && !fields.contains('\r') {
        return Ok(());
    }
    let problem = "a quote opens in this line and is not closed in it, which makes one cell of the lines below";
    let remedy = "remove the quote, or write the cell in one line";
    Err(InputError::new(file, problem, remedy).at_line(line))
}

/// Which expected column each field of the header is.
fn header(record: &csv::StringRecord, file: &str, line: u64, expected: &[Expected]) -> Result<Vec<usize>, InputError> {
    let fail = |problem: String, remedy: String| Err(InputError::new(file, problem, remedy).at_line(line));
    let known = || expected.iter().map(|column| column.name);
    let whole = record.get(0).filter(|_| record.len() == 1).unwrap_or_default();
    for (mark, marks) in [(';', "semicolons"), ('\t', "tabs")] {
        if whole.contains(mark) {
            return fail(format!("has {marks} between its fields, where commas belong"), IMPORT.to_string());
        }
    }
    let mut places = Vec::with_capacity(record.len());
    for field in record {
        let name = field.trim_ascii().to_string();
        if name.is_empty() {
            let column = places.len() + 1;
            return fail(format!("column {column} has no name"), "name it, or remove it from all rows".to_string());
        }
        let Some(place) = known().position(|known| known == name) else {
            if name.parse::<f64>().is_ok() {
                let remedy = format!("put a header row on top, of: {}", known().collect::<Vec<_>>().join(","));
                let name = shorten(&name);
                return fail(format!("has the number {name} where the header row should be"), remedy);
            }
            let remedy = match closest(&name, known()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => {
                    let is_known = |field: &str| known().any(|known| known == field.trim_ascii());
                    // A table of which no column is known is a logger's.
                    let what = if record.iter().any(is_known) { "remove it" } else { IMPORT };
                    format!("{what}; known columns: {}", known().collect::<Vec<_>>().join(", "))
                }
            };
            return fail(format!("column `{}` is not known", shorten(&name)), remedy);
        };
        if places.contains(&place) {
            return fail(format!("column `{name}` appears twice"), "remove or rename one of them".to_string());
        }
        places.push(place);
    }
    for (place, column) in expected.iter().enumerate() {
        if column.required && !places.contains(&place) {
            let remedy = format!("add it to the header row, which has: {}", header_text(record));
            return fail(format!("column `{}` is missing", column.name), remedy);
        }
    }
    Ok(places)
}

fn header_text(record: &csv::StringRecord) -> String {
    record.iter().map(|field| shorten(field.trim_ascii())).collect::<Vec<_>>().join(",")
}

/// A field as a number; NaN for a blank one where blanks are allowed.
fn number(field: &str, column: &Expected) -> Result<f64, (String, String)> {
    let field = field.trim_ascii();
    if field.is_empty() {
        return if column.blanks {
            Ok(f64::NAN)
        } else {
            Err(("is blank".to_string(), "give every row a value, or remove the row".to_string()))
        };
    }
    match field.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => {
            let remedy = if column.blanks { "leave the field blank for a missing sample" } else { "give it a value" };
            Err((format!("is `{}`, which is not a finite number", shorten(field)), remedy.to_string()))
        }
        Err(_) => {
            let remedy = "write plain numbers such as -1.5e-3, and leave the field blank for a missing sample";
            Err((format!("is `{}` where a number belongs", shorten(field)), remedy.to_string()))
        }
    }
}
