//! Where the table is in the file: separator, decimal sign, header, units, first row.

use super::super::cells::Numbers;
use super::super::separator::{LOOKED_AT, Separator};
use super::super::{stamps, units};

/// Part of the cells of a row that are numbers, times or missing.
const ROW_LIKE: f64 = 0.6;
/// The table begins where so many rows follow upon each other, or all that are left.
const IN_A_ROW: usize = 4;
const GROUPS: [char; 4] = ['.', ',', ' ', '\''];
const COMMENTS: [char; 4] = ['#', '%', '!', '*'];

/// The table in a file.
#[derive(Clone, Debug)]
pub(super) struct Layout {
    pub(super) separator: Separator,
    pub(super) decimal_comma: bool,
    pub(super) thousands: Option<char>,
    /// Lines above the header, or above the first row if there is no usable header.
    pub(super) skip_lines: usize,
    /// The header can be read by the mapping.
    pub(super) header: bool,
    pub(super) units_line: bool,
    /// Character that begins lines between the rows.
    pub(super) comment: Option<char>,
    /// Names by column; empty where there are none.
    pub(super) names: Vec<String>,
    /// Units by column, from a line of their own.
    pub(super) units: Vec<String>,
    /// Lines above the header with their numbers.
    pub(super) above: Vec<(usize, String)>,
    /// Cells by row.
    pub(super) rows: Vec<Vec<String>>,
    /// Number of the line of the first row.
    pub(super) first_line: usize,
}

/// What a cell of a row can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Missing,
    Number,
    /// A number only with groups of thousands.
    Grouped,
    DateTime,
    Date,
    Clock,
    Text,
}

/// What a cell is, under a decimal sign.
pub(super) fn kind(cell: &str, decimal_comma: bool) -> Kind {
    let plain = Numbers { decimal_comma, ..Numbers::default() };
    if plain.is_missing(cell) {
        return Kind::Missing;
    }
    let cell = number_part(cell);
    let cell = stamps::zone_by_name(cell).map_or(cell, |(time, _)| time);
    if plain.number(cell).is_some() {
        Kind::Number
    } else if stamps::time_of_day(cell).is_some() {
        Kind::Clock
    } else if stamps::Reader::default().read(cell).is_some() || (cell.contains(':') && stamps::two_ways(cell).is_some())
    {
        Kind::DateTime
    } else if stamps::Reader::default().read(&format!("{cell} 00:00")).is_some() || stamps::two_ways(cell).is_some() {
        Kind::Date
    } else if group(cell, decimal_comma).is_some() {
        Kind::Grouped
    } else {
        Kind::Text
    }
}

/// The number of a cell that carries its unit.
pub(super) fn number_part(cell: &str) -> &str {
    match cell.trim().split_once(' ') {
        Some((number, unit)) if units::read(unit).is_some() => number,
        _ => cell.trim(),
    }
}

/// The group separator with which a cell is a number.
pub(super) fn group(cell: &str, decimal_comma: bool) -> Option<char> {
    let decimal = if decimal_comma { ',' } else { '.' };
    GROUPS
        .into_iter()
        .filter(|mark| *mark != decimal)
        .find(|mark| Numbers { decimal_comma, thousands: Some(*mark), missing: Vec::new() }.number(cell).is_some())
}

/// How much a line looks like a row: 1 if every cell is a number, a time or missing; 0 for fewer than two cells or no number.
fn row_like(cells: &[String], decimal_comma: bool) -> f64 {
    if cells.len() < 2 {
        return 0.0;
    }
    let (mut sum, mut numbers) = (0.0, 0);
    for cell in cells {
        let kind = kind(cell, decimal_comma);
        numbers += usize::from(matches!(kind, Kind::Number | Kind::Grouped));
        sum += match kind {
            Kind::Text => 0.0,
            Kind::Grouped => 0.9,
            _ => 1.0,
        };
    }
    if numbers == 0 { 0.0 } else { sum / cells.len() as f64 }
}

/// The width that most row-like lines have, and how much they look like rows altogether.
fn judge(lines: &[&str], separator: Separator, decimal_comma: bool) -> (usize, f64) {
    let mut by_width = std::collections::BTreeMap::<usize, f64>::new();
    for line in lines {
        let cells = separator.cells(line);
        let like = row_like(&cells, decimal_comma);
        if like >= ROW_LIKE {
            *by_width.entry(cells.len()).or_default() += like;
        }
    }
    by_width.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0))
}

/// Finds the table; `None` if no two columns of numbers are in the file.
pub(super) fn find(text: &str) -> Option<Layout> {
    let all: Vec<&str> = text.lines().collect();
    let sample: Vec<&str> = all.iter().copied().filter(|line| !line.trim().is_empty()).take(LOOKED_AT).collect();
    let mut best: Option<(f64, Separator, bool, usize)> = None;
    for separator in Separator::ALL {
        for decimal_comma in [false, true] {
            if decimal_comma && separator == Separator::Byte(b',') && !text.contains('"') {
                continue;
            }
            let (width, score) = judge(&sample, separator, decimal_comma);
            // A hundredth more is no more: the first of equals holds.
            if score > 1.01 * best.map_or(0.0, |best| best.0) {
                best = Some((score, separator, decimal_comma, width));
            }
        }
    }
    let (_, separator, decimal_comma, width) = best?;
    let row = |line: &&str| {
        let cells = separator.cells(line);
        (cells.len() == width && row_like(&cells, decimal_comma) >= ROW_LIKE).then_some(cells)
    };
    let rows: Vec<Option<Vec<String>>> = all.iter().map(row).collect();
    // Lines above the table may look like a row, too; but rows follow upon each other.
    let filled: Vec<usize> = (0..all.len()).filter(|at| !all[*at].trim().is_empty()).collect();
    let begins = |at: &usize| filled[*at..].iter().take(IN_A_ROW).all(|line| rows[*line].is_some());
    let any = || (0..filled.len()).find(|at| rows[filled[*at]].is_some());
    let first = filled[(0..filled.len()).find(begins).or_else(any)?];
    let rows: Vec<Vec<String>> = rows.into_iter().skip(first).flatten().collect();
    let between = |mark: &char| all[first..].iter().any(|line| line.trim_start().starts_with(*mark));
    let grouped = |cell: &String| (kind(cell, decimal_comma) == Kind::Grouped).then(|| group(cell, decimal_comma))?;
    let mut layout = Layout {
        separator,
        decimal_comma,
        thousands: rows.iter().flatten().find_map(grouped),
        skip_lines: first,
        header: false,
        units_line: false,
        comment: COMMENTS.into_iter().find(between),
        names: Vec::new(),
        units: Vec::new(),
        above: Vec::new(),
        rows,
        first_line: first + 1,
    };
    layout.header(&all[..first], width);
    Some(layout)
}

impl Layout {
    /// Finds header and units among the lines above the first row.
    fn header(&mut self, above: &[&str], width: usize) {
        let filled: Vec<(usize, &str)> =
            above.iter().copied().enumerate().filter(|(_, line)| !line.trim().is_empty()).collect();
        let of = |nth_above: usize| -> Option<(usize, Vec<String>, bool)> {
            let (at, line) = *filled.iter().rev().nth(nth_above)?;
            let marked = line.trim_start().starts_with(COMMENTS);
            let mut cells = self.separator.cells(line);
            if marked && cells.len() == width + 1 && cells[0].len() == 1 {
                cells.remove(0);
            } else if marked && let Some(first) = cells.first_mut() {
                *first = first.trim_start_matches(COMMENTS).trim().to_string();
            }
            let numbers = cells.iter().filter(|cell| kind(cell, self.decimal_comma) == Kind::Number).count();
            // A separator may stand at the end of the rows or of the header only.
            let fits = cells.len().abs_diff(width) <= 1 && 2 * numbers < width;
            fits.then_some((at, cells, marked))
        };
        let is_units = |cells: &[String]| {
            let filled: Vec<&String> = cells.iter().filter(|cell| !cell.is_empty()).collect();
            let units = filled.iter().filter(|cell| units::read(cell).is_some()).count();
            units >= 1 && 10 * units >= 6 * filled.len()
        };
        let (mut lines, mut header) = (0, of(0));
        if let (Some((_, cells, _)), Some(over)) = (&header, of(1))
            && is_units(cells)
            && !is_units(&over.1)
        {
            (self.units_line, self.units) = (true, cells.clone());
            header = Some(over);
            lines = 1;
        }
        let known = header.as_ref().map_or(0, |_| lines + 1);
        let kept = filled.len().saturating_sub(known);
        self.above = filled[..kept].iter().map(|(at, line)| (at + 1, (*line).to_string())).collect();
        let Some((at, names, marked)) = header else { return };
        self.names = names;
        if marked {
            // The mapping would read the mark as a name, or leave the line out.
            self.units_line = false;
        } else {
            (self.header, self.skip_lines) = (true, at);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn separator_decimal_sign_and_header_are_found() {
        let semicolon = Separator::Byte(b';');
        let comma = Separator::Byte(b',');
        let tab = Separator::Byte(b'\t');
        for (text, separator, decimal_comma, skip, header, units, rows) in [
            ("t;y\n0,0;1,5\n0,1;2,5\n", semicolon, true, 0, true, false, 2),
            ("t,y\n0.0,1.5\n0.1,2.5\n", comma, false, 0, true, false, 2),
            ("gain,2\n\nt,y\n0,1\n1,2\n2,3\n3,4\n", comma, false, 2, true, false, 4),
            ("t,y\n0.0,1.5\n0.1,2.5\n,\n", comma, false, 0, true, false, 2),
            ("made by\nx: 3\n\nt\ty\ns\tmm\n0\t1\n1\t2\n", tab, false, 3, true, true, 2),
            ("# t y\n0 1\n1 2\n# end\n", Separator::Blanks, false, 1, false, false, 2),
            ("0 1\n1 2\n", Separator::Blanks, false, 0, false, false, 2),
            ("t;y;\n0;1;\n1;2;\n", semicolon, false, 0, true, false, 2),
            ("Zeit;y\n01.03.2026 10:00:00,125;1,5\n01.03.2026 10:00:00,135;1,6\n", semicolon, true, 0, true, false, 2),
            ("t,y\n\"0,0\",\"1,5\"\n\"0,1\",\"2,5\"\n", comma, true, 0, true, false, 2),
            ("t;y\n0,1;1.234,5\n0,2;1.235,5\n", semicolon, true, 0, true, false, 2),
        ] {
            let found = find(text).expect("a table");
            let seen = (found.separator, found.decimal_comma, found.skip_lines, found.header, found.units_line);
            assert_eq!((seen, found.rows.len()), ((separator, decimal_comma, skip, header, units), rows), "{text}");
        }
        assert!(find("no table\nat all\n").is_none());
    }
}
