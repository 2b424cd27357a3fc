//! Walking a TOML document with line numbers, for files whose every key is checked.

use crate::error::{InputError, closest};
use plant_model::Short;
use std::collections::HashSet;
use toml::de::{DeTable, DeValue};

/// A parsed TOML file that knows the line of every key.
pub struct Document<'t> {
    file: &'t str,
    text: &'t str,
    root: DeTable<'t>,
}

/// One key of a TOML document with its value.
#[derive(Clone)]
pub struct Entry<'d> {
    file: &'d str,
    text: &'d str,
    /// The key alone, e.g. `mass_kg`.
    pub name: &'d str,
    /// The key with its tables, e.g. `load.mass_kg`.
    pub path: String,
    /// Line of the key, from 1.
    pub line: u64,
    value: &'d DeValue<'d>,
}

impl<'t> Document<'t> {
    /// Parses TOML.
    ///
    /// # Errors
    /// The text is not TOML (a duplicate key included); the error names the line.
    pub fn parse(text: &'t str, file: &'t str) -> Result<Self, InputError> {
        match DeTable::parse(text) {
            Ok(root) => Ok(Self { file, text, root: root.into_inner() }),
            Err(error) => {
                let at = error.span().map_or(0, |span| span.start);
                let line = line_of(text, at);
                let near = shorten(text.lines().nth(line as usize - 1).unwrap_or_default().trim());
                let problem = format!("is not valid TOML near `{near}`: {}", error.message().replace('\n', " "));
                let remedy = "write `key = value` lines under `[table]` headers, numbers with a decimal point and text in quotes";
                Err(InputError::new(file, problem, remedy).at_line(line))
            }
        }
    }

    /// The top-level entries in the order of the file.
    #[must_use]
    pub fn entries(&self) -> Vec<Entry<'_>> {
        entries(&self.root, "", self.file, self.text)
    }
}

impl<'d> Entry<'d> {
    /// An error at this key.
    #[must_use]
    pub fn error(&self, problem: impl AsRef<str>, remedy: impl Into<String>) -> InputError {
        InputError::new(self.file, format!("`{}` {}", self.path, problem.as_ref()), remedy).at_line(self.line)
    }

    /// The error of a key that is not one of `known`, with the likely intention where one is near.
    #[must_use]
    pub fn unknown<'k>(&self, known: impl IntoIterator<Item = &'k str>) -> InputError {
        let mut once = HashSet::new();
        let known: Vec<&str> = known.into_iter().filter(|word| once.insert(*word)).collect();
        let remedy = match closest(self.name, known.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("remove it; known here: {}", known.join(", ")),
        };
        let kind = if self.value.is_table() { "is not a known table" } else { "is not a known key" };
        self.error(kind, remedy)
    }

    /// A finite number, written with or without a decimal point.
    ///
    /// # Errors
    /// Text, a table, a date; NaN or infinity.
    pub fn number(&self) -> Result<f64, InputError> {
        self.number_in(self.value)
    }

    /// A whole number in a range, ends included.
    ///
    /// # Errors
    /// Not a number, not whole or outside the range.
    pub fn whole(&self, low: u32, high: u32) -> Result<u32, InputError> {
        let value = self.number()?;
        if value.fract() != 0.0 || value < f64::from(low) || value > f64::from(high) {
            let problem = format!("= {} must be a whole number from {low} to {high}", Short(value));
            return Err(self.error(problem, "correct the value"));
        }
        Ok(value as u32)
    }

    /// An array of exactly `N` finite numbers.
    ///
    /// # Errors
    /// Not an array, another length, or an element that is no finite number.
    pub fn numbers<const N: usize>(&self) -> Result<[f64; N], InputError> {
        let wrong = || self.error(format!("must be {N} numbers in brackets"), "write it like [-0.5, 0.5]");
        let array = self.value.as_array().ok_or_else(wrong)?;
        if array.len() != N {
            return Err(wrong());
        }
        let mut numbers = [0.0; N];
        for (number, value) in numbers.iter_mut().zip(array.iter()) {
            *number = self.number_in(value.get_ref())?;
        }
        Ok(numbers)
    }

    /// An array of pairs of finite numbers.
    ///
    /// # Errors
    /// Any other type.
    pub fn points(&self) -> Result<Vec<[f64; 2]>, InputError> {
        let wrong = || self.error("must be pairs of numbers in brackets", "write it like [[-5, -1], [0, 0], [5, 1]]");
        let array = self.value.as_array().ok_or_else(wrong)?;
        let point = |value: &toml::Spanned<DeValue<'_>>| match value.get_ref().as_array() {
            Some(pair) if pair.len() == 2 => {
                let mut point = [0.0; 2];
                for (number, value) in point.iter_mut().zip(pair.iter()) {
                    *number = self.number_in(value.get_ref())?;
                }
                Ok(point)
            }
            _ => Err(wrong()),
        };
        array.iter().map(point).collect()
    }

    /// A string.
    ///
    /// # Errors
    /// Any other type.
    pub fn string(&self) -> Result<&'d str, InputError> {
        self.value.as_str().ok_or_else(|| self.error("must be text in quotes", "write it like \"text\""))
    }

    /// An array of strings.
    ///
    /// # Errors
    /// Any other type.
    pub fn strings(&self) -> Result<Vec<&'d str>, InputError> {
        let wrong = || self.error("must be texts in brackets", "write it like [\"one\", \"other\"]");
        let array = self.value.as_array().ok_or_else(wrong)?;
        array.iter().map(|value| value.get_ref().as_str().ok_or_else(wrong)).collect()
    }

    /// True or false.
    ///
    /// # Errors
    /// Any other type.
    pub fn flag(&self) -> Result<bool, InputError> {
        self.value.as_bool().ok_or_else(|| self.error("must be true or false", "write it without quotes"))
    }

    /// Whether the value is a table.
    #[must_use]
    pub fn is_table(&self) -> bool {
        self.value.is_table()
    }

    /// Whether the value is a string.
    #[must_use]
    pub fn is_string(&self) -> bool {
        self.value.is_str()
    }

    /// Whether the value is an array.
    #[must_use]
    pub fn is_array(&self) -> bool {
        self.value.is_array()
    }

    /// The entries of a table in the order of the file.
    ///
    /// # Errors
    /// The value is not a table.
    pub fn table(&self) -> Result<Vec<Entry<'d>>, InputError> {
        match self.value.as_table() {
            Some(table) => Ok(entries(table, &self.path, self.file, self.text)),
            None => Err(self.error("must be a table", format!("write it as `[{}]` on a line of its own", self.path))),
        }
    }

    fn number_in(&self, value: &DeValue<'_>) -> Result<f64, InputError> {
        let parsed = match value {
            DeValue::Float(float) => float.as_str().parse().ok(),
            DeValue::Integer(integer) => i64::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
            _ => {
                let found = match value {
                    DeValue::String(text) => format!("the text \"{}\"", shorten(text)),
                    other => with_article(other.type_str()),
                };
                return Err(self.error(format!("must be a number but is {found}"), "write it without quotes and units"));
            }
        };
        match parsed {
            Some(number) if f64::is_finite(number) => Ok(number),
            _ => Err(self.error("must be a finite number", "replace NaN, infinity or overflow by the real value")),
        }
    }
}

/// `a table`, `an array`.
fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}

/// A value from a file, cut to a length that an error message can carry.
#[must_use]
pub fn shorten(text: &str) -> String {
    let mut short: String = text.chars().take(40).flat_map(char::escape_debug).collect();
    if text.chars().nth(40).is_some() {
        short.push('…');
    }
    short
}

fn entries<'d>(table: &'d DeTable<'d>, prefix: &str, file: &'d str, text: &'d str) -> Vec<Entry<'d>> {
    let mut entries: Vec<(usize, Entry<'d>)> = table
        .iter()
        .map(|(key, value)| {
            let name: &str = key.get_ref();
            let path = if prefix.is_empty() { name.to_string() } else { format!("{prefix}.{name}") };
            let at = key.span().start;
            (at, Entry { file, text, name, path, line: line_of(text, at), value: value.get_ref() })
        })
        .collect();
    entries.sort_by_key(|(at, _)| *at);
    entries.into_iter().map(|(_, entry)| entry).collect()
}

fn line_of(text: &str, at: usize) -> u64 {
    1 + text.as_bytes().iter().take(at).filter(|&&byte| byte == b'\n').count() as u64
}
