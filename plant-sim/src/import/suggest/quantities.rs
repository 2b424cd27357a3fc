//! Units, zeros and signs of the measured columns.

use super::super::units::Quantity;
use super::layout::Layout;
use super::seen::Seen;
use super::{Page, from, short};
use rig_files::{Column, RigFile};

/// The columns of the table that fit a column of the log.
pub(super) struct Choice {
    pub(super) column: Column,
    /// Numbers from 1: none, one, or several that fit alike.
    pub(super) found: Vec<usize>,
    pub(super) sure: bool,
}

/// The table of one column of the log.
pub(super) struct Lines {
    column: Column,
    found: Vec<usize>,
    sure: bool,
    /// Key, value, reason.
    keys: Vec<(&'static str, String, String)>,
    /// The pressures are, or may be, gauge.
    pub(super) gauge: bool,
}

/// Largest pressures that pneumatics knows, Pa, absolute or gauge.
const PRESSURES_PA: [f64; 2] = [0.5e5, 1.7e6];

/// The tables of the columns of the log that the table has, the position always.
pub(super) fn lines(columns: &[Seen], choices: &[Choice], rig: Option<&RigFile>) -> Vec<Lines> {
    let seen = |choice: &Choice| -> Vec<&Seen> { choice.found.iter().filter_map(|n| columns.get(n - 1)).collect() };
    let is_pressure = |choice: &&Choice| choice.column.name().starts_with("p_");
    let pressures: Vec<&Seen> = choices.iter().filter(is_pressure).flat_map(seen).collect();
    let highest = pressures.iter().map(|seen| seen.high).fold(0.0, f64::max);
    let supply = choices.iter().filter(|choice| choice.column == Column::PSup).flat_map(seen).next().map(Seen::median);
    let chambers = choices.iter().filter(|choice| matches!(choice.column, Column::PA | Column::PB));
    let lowest =
        chambers.flat_map(seen).map(|seen| (seen.low, seen.stated(Quantity::Pressure).map_or(1.0, |unit| unit.1)));
    let lowest = lowest.min_by(|a, b| (a.0 * a.1).total_cmp(&(b.0 * b.1)));
    choices
        .iter()
        .filter(|choice| !choice.found.is_empty() || choice.column == Column::Y)
        .map(|choice| {
            let mut lines = Lines {
                column: choice.column,
                found: choice.found.clone(),
                sure: choice.sure,
                keys: Vec::new(),
                gauge: false,
            };
            let seen = seen(choice);
            match (choice.column, seen.first()) {
                (Column::Y, None) => {
                    let half = 0.5e3 * stroke_m(rig);
                    lines.key("unit", "\"mm\"", "of what the points mean");
                    let why = format!(
                        "left to you: what does it read at the end stop of A, and at that of B? 0 to 10 V: [[0.0, {:?}], [10.0, {half:?}]]",
                        -half
                    );
                    lines.key("points", "\"?\"", why);
                }
                (_, None) => {}
                (Column::Y | Column::YRef, Some(seen)) => lines.length(seen, rig),
                (Column::U, Some(seen)) => lines.command(seen, rig),
                (Column::PA | Column::PB | Column::PSup, Some(seen)) => {
                    lines.pressure(seen, [highest, lowest.map_or(f64::NAN, |low| low.0)], supply, rig);
                }
                (Column::FExt, Some(seen)) => lines.force(seen),
                _ => {}
            }
            lines
        })
        .collect()
}

/// The stroke, or one for an example.
fn stroke_m(rig: Option<&RigFile>) -> f64 {
    rig.map_or(0.2, |rig| rig.rig.cylinder.stroke_m)
}

impl Lines {
    fn key(&mut self, key: &'static str, value: impl Into<String>, why: impl Into<String>) {
        self.keys.push((key, value.into(), why.into()));
    }

    /// The unit: the stated one if `fits` takes it, else the only fitting one of `candidates`, else left open. Returns its factor.
    fn unit(
        &mut self,
        seen: &Seen,
        quantity: Quantity,
        candidates: &[(&'static str, f64)],
        fits: impl Fn(f64) -> bool,
        range: &str,
    ) -> Option<f64> {
        let fitting: Vec<(&str, f64)> = candidates.iter().copied().filter(|(_, factor)| fits(*factor)).collect();
        let list = || fitting.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(" or ");
        match (seen.stated(quantity), &fitting[..]) {
            (Some((unit, factor)), _) if fits(factor) => {
                self.key("unit", format!("\"{unit}\""), format!("from {}", seen.unit_from));
                Some(factor)
            }
            (Some((unit, _)), _) => {
                let fitting = if fitting.is_empty() { String::new() } else { format!("; {} would fit", list()) };
                let why = format!(
                    "left to you: {} says {unit}, but {range} {unit} is not plausible{fitting}",
                    seen.unit_from
                );
                self.key("unit", "\"?\"", why);
                None
            }
            (None, [(unit, factor)]) => {
                let why = format!("uncertain: no unit is stated; of the usual ones only {unit} fits {range}");
                self.key("unit", format!("\"{unit}\""), why);
                Some(*factor)
            }
            (None, _) => {
                let list = if fitting.is_empty() { "no usual unit fits".into() } else { list() };
                self.key("unit", "\"?\"", format!("left to you: no unit is stated, and it reads {range}: {list}"));
                None
            }
        }
    }

    fn length(&mut self, seen: &Seen, rig: Option<&RigFile>) {
        let span = seen.high - seen.low;
        let stroke = rig.map(|rig| rig.rig.cylinder.stroke_m);
        let range = format!("{} to {}", short(seen.low), short(seen.high));
        // Without a rig: strokes up to 3 m. A stated unit is believed even if the piston hardly moves; otherwise a tenth of the
        // stroke, or 5 mm, tells the unit.
        let stated = seen.stated(Quantity::Length).is_some();
        let fits = |factor: f64| match stroke {
            Some(stroke) => (if stated { 5.0e-3 } else { 0.1 }..=1.15).contains(&(span * factor / stroke)),
            None => (if stated { 5.0e-4 } else { 5.0e-3 }..=3.0).contains(&(span * factor)),
        };
        let candidates: &[(&str, f64)] =
            if stroke.is_some() { &[("m", 1.0), ("cm", 0.01), ("mm", 1.0e-3)] } else { &[("m", 1.0), ("mm", 1.0e-3)] };
        if let Some(signal) = seen.unit.and_then(|unit| unit.signal) {
            let half = 0.5e3 * stroke_m(rig);
            let [from, to] = if signal == "mA" { [4.0, 20.0] } else { [0.0, 100.0] };
            self.key("unit", "\"mm\"", "of what the points mean");
            let why = format!(
                "left to you: it reads {range} {signal}; what does it read at the end stop of A, and at that of B? {from} to {to} \
                 {signal}: [[{from:?}, {:?}], [{to:?}, {half:?}]]",
                -half
            );
            self.key("points", "\"?\"", why);
            return;
        }
        let Some(factor) = self.unit(seen, Quantity::Length, candidates, fits, &range) else { return };
        if self.column == Column::Y {
            self.key(
                "sign",
                "1",
                "uncertain: 1 if it grows towards chamber B (the rod comes out), else -1; `check` tells",
            );
        } else {
            self.key("sign", "1", "as that of y_m");
        }
        let (low, high) = (seen.low * factor, seen.high * factor);
        let ends = |stroke: f64| {
            let [stroke, half] = [stroke, 0.5 * stroke].map(|m| (m / factor * 1.0e6).round() / 1.0e6);
            format!("[[0.0, {:?}], [{stroke:?}, {half:?}]]", -half)
        };
        let left = |range: &str, stroke: f64| {
            format!(
                "left to you: it reads {range}; y_m is 0 at mid-stroke: what does it read at the two end stops? For 0 at one of \
                 them, and a stroke of {} mm: {}",
                short(stroke * 1.0e3),
                ends(stroke)
            )
        };
        match stroke {
            Some(stroke) => {
                let half = 0.5 * stroke;
                let centred = low >= -1.1 * half && high <= 1.1 * half && low < -0.05 * stroke;
                let from_the_end = low >= -0.1 * stroke && high <= 1.1 * stroke && high > 1.1 * half;
                if centred {
                    self.key("offset", "0.0", "it counts from mid-stroke: it reads below zero");
                } else if from_the_end {
                    let why =
                        "it counts from an end stop; y_m is 0 at mid-stroke, and the stroke is that of the rig file";
                    self.key("points", ends(stroke), why);
                } else {
                    self.key("points", "\"?\"", left(&range, stroke));
                }
            }
            None if low < -0.2 * (high - low) => {
                self.key("offset", "0.0", "uncertain: it reads below zero, so it seems to count from mid-stroke");
            }
            None => self.key("points", "\"?\"", left(&range, stroke_m(None)) + " (--rig tells the stroke)"),
        }
    }

    fn command(&mut self, seen: &Seen, rig: Option<&RigFile>) {
        let volts = rig.map_or(5.0, |rig| rig.rig.valve.max_voltage_v);
        let origin = if rig.is_some() { "of the rig file" } else { "typical; uncertain" };
        let (low, high) = (seen.low, seen.high);
        let range = format!("{} to {}", short(low), short(high));
        let signal = seen.unit.and_then(|unit| unit.signal);
        let full = |low: f64, high: f64| format!("[[{low:?}, {:?}], [{high:?}, {volts:?}]]", -volts);
        let points = |lines: &mut Self, low: f64, high: f64, of: &str| {
            let why = format!("{of}: full stroke to either side at ±{volts} V ({origin}), u_v is 0 at mid");
            lines.key("points", full(low, high), why);
        };
        let stated = seen.stated(Quantity::Voltage);
        match (stated, signal) {
            (_, Some("mA")) if low >= 3.5 && high <= 20.5 => points(self, 4.0, 20.0, "4 to 20 mA"),
            (_, Some("mA")) if low >= -0.5 && high <= 20.5 => points(self, 0.0, 20.0, "uncertain, 0 to 20 mA"),
            (_, Some("%")) if low < -1.0 => points(self, -100.0, 100.0, "-100 to 100 %"),
            (_, Some("%")) if high <= 101.0 => points(self, 0.0, 100.0, "0 to 100 %, 50 % is mid"),
            (Some((unit, factor)), _) if low * factor < -0.1 => {
                self.key(
                    "unit",
                    format!("\"{unit}\""),
                    format!("from {}; it reads below zero, so 0 is mid", seen.unit_from),
                );
            }
            (Some((unit, factor)), _) if high * factor > volts && high * factor <= 2.2 * volts => {
                points(self, 0.0, 2.0 * volts / factor, &format!("it reads {range} {unit}, so 0 to {} V", 2.0 * volts));
            }
            (None, None) if low < -1.0 && high <= 1.1 * volts && low >= -1.1 * volts => {
                self.key("unit", "\"V\"", format!("uncertain: no unit is stated; it reads {range}"));
            }
            _ => {
                let why = format!(
                    "left to you: it reads {range}; say which two readings are full stroke, e.g. {} or {} or {}",
                    full(0.0, 2.0 * volts),
                    full(4.0, 20.0),
                    full(0.0, 100.0)
                );
                self.key("points", "\"?\"", why);
            }
        }
        self.key("sign", "1", "uncertain: 1 if a larger command fills chamber A, else -1; `check` tells");
    }

    fn pressure(&mut self, seen: &Seen, [highest, lowest]: [f64; 2], supply: Option<f64>, rig: Option<&RigFile>) {
        let range = format!("{} to {}", short(seen.low), short(seen.high));
        let most = match rig {
            Some(rig) => [0.4 * rig.rig.supply.pressure_pa, 1.3 * rig.rig.supply.pressure_pa],
            None => PRESSURES_PA,
        };
        let fits = |factor: f64| (most[0]..=most[1]).contains(&(highest * factor));
        let stated = |factor: f64| (0.1e5..=most[1]).contains(&(seen.high * factor));
        let candidates =
            [("Pa", 1.0), ("kPa", 1.0e3), ("mbar", 1.0e2), ("bar", 1.0e5), ("MPa", 1.0e6), ("psi", 6894.757)];
        let unit = match seen.stated(Quantity::Pressure) {
            Some(_) => self.unit(seen, Quantity::Pressure, &candidates, stated, &range),
            None => self.unit(seen, Quantity::Pressure, &candidates, fits, &format!("up to {}", short(highest))),
        };
        let lower = seen.name.to_lowercase();
        let word = |words: &[&str]| words.iter().any(|word| lower.contains(word));
        let by_name = if word(&["abs"]) {
            Some(false)
        } else if word(&["überdruck", "ueberdruck", "gauge", "rel"]) {
            Some(true)
        } else {
            None
        };
        let by_unit = seen.unit.and_then(|unit| unit.gauge);
        let (gauge, why) = match (by_unit.or(by_name), unit) {
            (Some(gauge), _) => {
                (Some(gauge), format!("the {} says so", if by_unit.is_some() { "unit" } else { "name" }))
            }
            (None, Some(factor)) => by_size(lowest * factor, supply.map(|p| p * factor), rig),
            (None, None) => (None, "left to you: does it read 0 (true) or about 1 bar (false) when vented?".into()),
        };
        self.gauge = gauge != Some(false);
        self.key("gauge", gauge.map_or("\"?\"".to_string(), |gauge| gauge.to_string()), why);
    }

    fn force(&mut self, seen: &Seen) {
        let range = format!("{} to {}", short(seen.low), short(seen.high));
        self.unit(seen, Quantity::Force, &[("N", 1.0), ("kN", 1.0e3)], |_| true, &range);
        self.key("sign", "1", "uncertain: 1 if the force pushes towards chamber B, else -1");
    }

    /// Writes the table.
    pub(super) fn write(self, page: &mut Page, layout: &Layout, columns: &[Seen]) {
        page.table(&format!("column.{}", self.column.name()));
        let list: Vec<String> = self.found.iter().filter_map(|n| columns.get(n - 1)).map(Seen::called).collect();
        match self.found[..] {
            [] => page.key("from", "\"?\"", "left to you: no name or unit says position; a column of the list above"),
            [one] => {
                let why =
                    if self.sure { "by its name" } else { "uncertain, by its name or unit only: look whether it is" };
                let from = columns.get(one - 1).map_or("\"?\"".into(), |seen| from(seen, columns, layout));
                page.key("from", from, format!("{why} {}", what(self.column)).replace("is it", "it is"));
            }
            _ => page.key("from", "\"?\"", format!("left to you: {} fit alike", list.join(", "))),
        }
        for (key, value, why) in self.keys {
            page.key(key, value, why);
        }
    }
}

fn what(column: Column) -> &'static str {
    match column {
        Column::Y => "the piston's position",
        Column::YRef => "the setpoint of the position",
        Column::U => "the command of the valve",
        Column::PA => "the pressure in chamber A, which grows with y",
        Column::PB => "the pressure in chamber B, on the side of the rod",
        Column::PSup => "the supply pressure",
        Column::FExt => "an external force",
        Column::V | Column::Z => "",
    }
}

/// Gauge or absolute, by the lowest reading of a chamber and the usual one of the supply in Pa. The highest of a chamber says
/// nothing: the piston compresses it beyond the supply.
fn by_size(lowest_pa: f64, supply_pa: Option<f64>, rig: Option<&RigFile>) -> (Option<bool>, String) {
    let bar = |pa: f64| short(pa * 1.0e-5);
    if lowest_pa < 0.6e5 {
        return (Some(true), format!("a chamber reads {} bar, which only gauge pressure can be", bar(lowest_pa)));
    }
    if let (Some(rig), Some(read)) = (rig, supply_pa) {
        let stated = &rig.rig.supply;
        let off = [0.0, stated.atmosphere_pa].map(|add| (read + add - stated.pressure_pa).abs());
        if (off[0] - off[1]).abs() > 0.4 * stated.atmosphere_pa {
            let gauge = off[1] < off[0];
            let word = if gauge { "gauge" } else { "absolute" };
            return (
                Some(gauge),
                format!("the supply reads {} bar, as {word} pressure that of the rig file", bar(read)),
            );
        }
    }
    if (0.9e5..=1.15e5).contains(&lowest_pa) {
        return (
            Some(false),
            format!("uncertain: the lowest reading, {} bar, is about the atmosphere", bar(lowest_pa)),
        );
    }
    (None, "left to you: does it read 0 (true) or about 1 bar (false) when vented?".into())
}
