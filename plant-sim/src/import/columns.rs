//! Which column of a foreign table each rule of a mapping takes.

use super::separator::{LOOKED_AT, Separator};
use super::units;
use super::{Mapping, Source};
use rig_files::{InputError, shorten};

/// How many names of columns an error carries.
const MOST_NAMES: usize = 40;

/// Where a rule finds its cell.
#[derive(Clone, Debug)]
pub(super) enum Found {
    At(usize),
    Joined(Vec<usize>),
    Constant(f64),
}

impl Mapping {
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
                    source.names.iter().filter(|name| !name.is_empty()).map(|name| shorten(name)).collect();
                let more = known.len().saturating_sub(MOST_NAMES);
                let more = if more > 0 { format!(" and {more} more") } else { String::new() };
                format!("use one of: {}{more}", known[..known.len().min(MOST_NAMES)].join(", "))
            }
        };
        InputError::new(source.file, problem, remedy)
    }

    /// Where each rule finds its cell, or its constant.
    pub(super) fn places(&self, source: &Table<'_>) -> Result<Vec<Found>, InputError> {
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
}

/// The table as it was read.
pub(super) struct Table<'a> {
    pub(super) file: &'a str,
    /// Of its columns; none without a header.
    pub(super) names: &'a [String],
    /// Its lines, the header first, and their numbers in the file.
    pub(super) lines: &'a [&'a str],
    pub(super) numbers: &'a [u64],
}

impl Table<'_> {
    /// How a message calls a column.
    pub(super) fn column(&self, place: usize) -> String {
        match self.names.get(place) {
            Some(name) if !name.is_empty() => format!("`{}`", shorten(name)),
            _ => (place + 1).to_string(),
        }
    }

    /// Whether a separator cuts the first two lines into so many cells or more, one of them at most with a separator at its end.
    pub(super) fn is_cut_by(&self, separator: Separator, least: usize) -> bool {
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
