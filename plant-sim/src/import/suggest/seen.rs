//! What the columns of a table hold.

use super::super::cells::Numbers;
use super::super::stamps;
use super::super::units::{self, Quantity, Written};
use super::layout::{Kind, Layout, kind, number_part};
use super::names::Meant;

/// A column as the data show it.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    /// From 1.
    pub(super) number: usize,
    /// As the header writes it; empty if there is none.
    pub(super) name: String,
    /// The name without its unit.
    pub(super) bare: String,
    pub(super) unit: Option<Written>,
    /// Where the unit stands.
    pub(super) unit_from: &'static str,
    /// What most cells are.
    pub(super) kind: Kind,
    /// The numbers, in the order of the rows.
    pub(super) values: Vec<f64>,
    /// The cells that are times or dates.
    pub(super) stamps: Vec<String>,
    pub(super) missing: usize,
    /// Words among numbers.
    pub(super) words: Vec<String>,
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Seen {
    fn of(layout: &Layout, at: usize) -> Self {
        let name = layout.names.get(at).cloned().unwrap_or_default();
        let of_line = layout.units.get(at).and_then(|text| units::read(text));
        let (bare, of_name) = units::split(&name);
        let (unit, unit_from) = match (of_line, of_name, units::ending(&name)) {
            (Some(unit), _, _) => (Some(unit), "the line of units"),
            (None, Some(unit), _) => (Some(unit), "the header"),
            (None, None, Some(unit)) => (Some(unit), "the end of the name"),
            _ => (None, ""),
        };
        let numbers = Numbers { decimal_comma: layout.decimal_comma, thousands: layout.thousands, missing: Vec::new() };
        let mut seen = Self {
            number: at + 1,
            bare: bare.to_string(),
            name,
            unit,
            unit_from,
            kind: Kind::Missing,
            values: Vec::new(),
            stamps: Vec::new(),
            missing: 0,
            words: Vec::new(),
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
        };
        let mut count = [0_usize; 5];
        for cell in layout.rows.iter().map(|row| &row[at]) {
            let kind = kind(cell, layout.decimal_comma);
            match kind {
                Kind::Missing => seen.missing += 1,
                Kind::Number | Kind::Grouped => {
                    count[0] += 1;
                    if let Some(value) = numbers.number(number_part(cell)) {
                        seen.values.push(value);
                        (seen.low, seen.high) = (seen.low.min(value), seen.high.max(value));
                    }
                    if seen.unit.is_none()
                        && let Some((_, unit)) = cell.trim().split_once(' ')
                    {
                        (seen.unit, seen.unit_from) = (units::read(unit), "the cells");
                    }
                }
                Kind::DateTime | Kind::Date | Kind::Clock => {
                    count[match kind {
                        Kind::DateTime => 1,
                        Kind::Date => 2,
                        _ => 3,
                    }] += 1;
                    seen.stamps.push(cell.clone());
                }
                Kind::Text => {
                    count[4] += 1;
                    if !seen.words.contains(cell) && seen.words.len() < 9 {
                        seen.words.push(cell.clone());
                    }
                }
            }
        }
        let kinds = [Kind::Number, Kind::DateTime, Kind::Date, Kind::Clock, Kind::Text];
        let most = (0..5).max_by_key(|at| (count[*at], 5 - at)).unwrap_or(0);
        if count[most] > 0 {
            seen.kind = kinds[most];
        }
        seen
    }

    /// All columns of a table.
    pub(super) fn all(layout: &Layout) -> Vec<Self> {
        let width = layout.rows.first().map_or(0, Vec::len);
        (0..width).map(|at| Self::of(layout, at)).collect()
    }

    /// What the unit says about the column.
    pub(super) fn meant(&self) -> Meant {
        match self.unit {
            Some(Written { unit: Some((quantity, _, _)), .. }) => Meant::Quantity(quantity),
            Some(Written { signal: Some(_), .. }) => Meant::Signal,
            _ => Meant::Nothing,
        }
    }

    /// The unit as a mapping writes it, with its factor, if it is one of this quantity.
    pub(super) fn stated(&self, quantity: Quantity) -> Option<(&'static str, f64)> {
        self.unit?.unit.filter(|unit| unit.0 == quantity).map(|(_, name, factor)| (name, factor))
    }

    /// The name for a comment.
    pub(super) fn called(&self) -> String {
        if self.name.is_empty() { format!("column {}", self.number) } else { format!("`{}`", self.name) }
    }

    /// The steps from row to row are positive, but for a few.
    pub(super) fn rises(&self) -> bool {
        let steps = self.values.len().saturating_sub(1);
        steps > 0 && self.values.windows(2).filter(|pair| pair[1] > pair[0]).count() * 50 >= steps * 49
    }

    /// The usual reading.
    pub(super) fn median(&self) -> f64 {
        middle(self.values.clone())
    }

    /// The usual step from row to row.
    pub(super) fn step(&self) -> f64 {
        middle(self.values.windows(2).map(|pair| pair[1] - pair[0]).collect())
    }

    /// Whether the stamps of a date with time, or of a time, repeat from row to row.
    pub(super) fn repeats(&self) -> bool {
        let same = self.stamps.windows(2).filter(|pair| pair[0] == pair[1]).count();
        10 * same > self.stamps.len()
    }

    /// The formats that fit all stamps whose date can be read in two ways: day first, month first.
    pub(super) fn formats(&self) -> Option<Vec<String>> {
        let mut ways: Option<[Option<String>; 2]> = None;
        for stamp in &self.stamps {
            let now = stamps::formats(stamp)?;
            ways = Some(match ways {
                None => now,
                Some([day, month]) => [day.filter(|_| now[0].is_some()), month.filter(|_| now[1].is_some())],
            });
        }
        ways.map(|ways| ways.into_iter().flatten().collect())
    }
}

/// The median; NaN of nothing.
fn middle(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
