//! A cell → a number, a missing sample, or neither.

/// How a table writes its numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Numbers {
    /// The decimal sign is a comma.
    pub(super) decimal_comma: bool,
    /// What stands between groups of three digits.
    pub(super) thousands: Option<char>,
    /// Words for a missing sample beside [`MISSING`].
    pub(super) missing: Vec<String>,
}

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell {
    /// No sample.
    Missing,
    /// A finite number.
    Number(f64),
    /// Something else.
    Other,
}

/// Words that programs write where there is no sample, in lower case; blank cells and dashes besides.
pub(super) const MISSING: [&str; 17] = [
    "nan", "n/a", "na", "n.a.", "#n/a", "#na", "#nv", "k.a.", "null", "none", "nil", "#value!", "#wert!", "#div/0!",
    "#num!", "1.#qnan", "-1.#ind",
];

impl Numbers {
    /// Whether the cell says that there is no sample.
    pub(super) fn is_missing(&self, cell: &str) -> bool {
        let cell = cell.trim();
        let dashes = cell.chars().all(|c| matches!(c, '-' | '–' | '—' | '−'));
        dashes || MISSING.iter().any(|word| cell.eq_ignore_ascii_case(word)) || self.is_marked(cell)
    }

    /// Whether the mapping names this cell as missing, by its text or by its value.
    fn is_marked(&self, cell: &str) -> bool {
        !self.missing.is_empty()
            && self.missing.iter().any(|word| {
                let same = || Some(self.number(word)? == self.number(cell)?);
                word.eq_ignore_ascii_case(cell) || same().unwrap_or(false)
            })
    }

    /// Reads a cell; a unit behind the number is allowed if it is one of the column's.
    pub(super) fn read<'u>(&self, cell: &str, units: impl IntoIterator<Item = &'u str>) -> Cell {
        if self.is_missing(cell) {
            return Cell::Missing;
        }
        let bare = units.into_iter().find_map(|unit| cell.trim().strip_suffix(unit)).unwrap_or(cell);
        self.number(bare).map_or(Cell::Other, Cell::Number)
    }

    /// A finite number in this table's way of writing.
    pub(super) fn number(&self, cell: &str) -> Option<f64> {
        let mut text = cell.trim().replace('−', "-");
        let decimal = if self.decimal_comma { ',' } else { '.' };
        if let Some(separator) = self.thousands {
            text = without_groups(&text, separator, decimal)?;
        }
        if self.decimal_comma {
            if text.contains('.') {
                return None;
            }
            text = text.replace(',', ".");
        }
        // Rust would read `inf` and `nan`, too.
        let plain = text.chars().all(|c| c.is_ascii_digit() || matches!(c, '+' | '-' | '.' | 'e' | 'E'));
        text.parse().ok().filter(|value: &f64| plain && value.is_finite())
    }
}

/// Whether `found` is the group separator that a mapping calls `separator`: a blank may be any, an apostrophe either.
fn separates(separator: char, found: char) -> bool {
    match separator {
        ' ' => matches!(found, ' ' | '\u{a0}' | '\u{2009}' | '\u{202f}'),
        '\'' => matches!(found, '\'' | '’'),
        other => other == found,
    }
}

/// The number without its group separators, if its groups are such: one to three digits, the first no zero, then three each.
fn without_groups(text: &str, separator: char, decimal: char) -> Option<String> {
    let whole_ends = text.find([decimal, 'e', 'E']).unwrap_or(text.len());
    let (whole, rest) = text.split_at(whole_ends);
    if rest.chars().any(|c| separates(separator, c)) {
        return None;
    }
    let groups: Vec<&str> = whole.split(|c| separates(separator, c)).collect();
    let first = groups[0].trim_start_matches(['+', '-']);
    let begins = (1..=3).contains(&first.len()) && !first.starts_with('0');
    let grouped = groups.len() == 1 || (begins && groups[1..].iter().all(|group| group.len() == 3));
    grouped.then(|| groups.concat() + rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_the_mapping_says_and_in_no_other_way() {
        for (decimal_comma, thousands, cell, value) in [
            (false, None, "1.25", Some(1.25)),
            (false, None, "+1.5e-3", Some(1.5e-3)),
            (false, None, "−3", Some(-3.0)),
            (false, None, " .5 ", Some(0.5)),
            (false, None, "1,25", None),
            (false, None, "1,234.5", None),
            (false, None, "inf", None),
            (false, None, "1e999", None),
            (false, None, "0x10", None),
            (false, Some(','), "1,234.5", Some(1234.5)),
            (false, Some(','), "-1,234,567", Some(-1_234_567.0)),
            (false, Some(','), "12,34.5", None),
            (false, Some(','), "1.234,5", None),
            (false, Some('\''), "1’234.5", Some(1234.5)),
            (true, None, "1,25", Some(1.25)),
            (true, None, "1.25", None),
            (true, None, "1.234,5", None),
            (true, Some('.'), "1.234,5", Some(1234.5)),
            (true, Some('.'), "234,5", Some(234.5)),
            (true, Some('.'), "0.250", None),
            (true, Some('.'), "1.23,5", None),
            (true, Some(' '), "1 234,5", Some(1234.5)),
            (true, Some(' '), "1\u{202f}234,5", Some(1234.5)),
            (true, Some(' '), "1,5 2", None),
        ] {
            let numbers = Numbers { decimal_comma, thousands, missing: Vec::new() };
            assert_eq!(numbers.number(cell), value, "{cell} {decimal_comma} {thousands:?}");
        }
    }

    #[test]
    fn words_for_missing_samples_are_known_or_stated() {
        let plain = Numbers::default();
        for cell in ["", " ", "-", "---", "–", "NaN", "n/a", "#N/A", "#NV", "NULL", "-1.#IND"] {
            assert_eq!(plain.read(cell, None), Cell::Missing, "{cell}");
        }
        assert_eq!(plain.read("OL", None), Cell::Other);
        let stated = Numbers { missing: vec!["ol".into(), "-9999".into()], ..Numbers::default() };
        assert_eq!(stated.read("OL", None), Cell::Missing);
        assert_eq!(stated.read("-9999.0", None), Cell::Missing);
        assert_eq!(stated.read("-9998", None), Cell::Number(-9998.0));
    }

    #[test]
    fn a_unit_behind_the_number_is_that_of_the_column_or_none() {
        let plain = Numbers::default();
        assert_eq!(plain.read("6.2 bar", Some("bar")), Cell::Number(6.2));
        assert_eq!(plain.read("6.2 psi", Some("bar")), Cell::Other);
        assert_eq!(plain.read("6.2 bar", None), Cell::Other);
    }
}
