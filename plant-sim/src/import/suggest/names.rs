//! Column names → what they probably measure, in English and German.

use super::super::units::Quantity;
use rig_files::Column;

/// What the unit of a column says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meant {
    Quantity(Quantity),
    /// Percent or mA.
    Signal,
    Nothing,
}

/// A name in lower-case words.
struct Words(Vec<String>);

impl Words {
    fn of(name: &str) -> Self {
        let mut text = String::new();
        let mut before = ' ';
        for c in name.chars() {
            if before.is_lowercase() && c.is_uppercase() {
                text.push(' ');
            }
            before = c;
            match c {
                'ä' | 'Ä' => text += "ae",
                'ö' | 'Ö' => text += "oe",
                'ü' | 'Ü' => text += "ue",
                'ß' => text += "ss",
                c => text.extend(c.to_lowercase()),
            }
        }
        Self(text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(str::to_string).collect())
    }

    /// One of the words contains one of these parts.
    fn contain(&self, parts: &[&str]) -> bool {
        self.0.iter().any(|word| parts.iter().any(|part| word.contains(part)))
    }

    /// One of the words begins or ends with one of these.
    fn edge(&self, parts: &[&str]) -> bool {
        self.0.iter().any(|word| parts.iter().any(|part| word.starts_with(part) || word.ends_with(part)))
    }

    /// One of the words is one of these.
    fn are(&self, words: &[&str]) -> bool {
        self.0.iter().any(|word| words.contains(&&word[..]))
    }

    fn setpoint(&self) -> bool {
        self.contain(&["soll", "setpoint", "target", "referen", "demand", "fuehrung", "vorgabe", "desired"])
            || self.are(&["ref", "sp", "set", "w"])
    }

    fn command(&self) -> bool {
        self.contain(&["ventil", "valve", "stell", "command", "kommando", "ansteuer", "spool", "steuer", "control"])
            || self.are(&["u", "uv", "cmd", "co", "ao", "out", "output"])
    }

    fn position(&self) -> bool {
        self.contain(&["position", "stroke", "displacement", "travel", "lage", "abstand"])
            || self.edge(&["weg", "hub"])
            || self.are(&["pos", "y", "s", "x", "xist", "lvdt"])
    }

    fn pressure(&self) -> bool {
        self.contain(&["druck", "pressure", "press", "kammer", "chamber"])
            || self.are(&["p", "pa", "pb", "ps", "psup", "p0", "p1", "p2", "p3", "p4", "p5", "p6"])
    }

    fn supply(&self) -> bool {
        self.contain(&["versorg", "supply", "netz", "speis", "vordruck", "zuluft", "source", "kessel"])
            || self.are(&["ps", "psup", "sup", "p0", "line", "tank"])
            // `pS`, `p_s`.
            || self.0.windows(2).any(|pair| pair[0] == "p" && pair[1] == "s")
    }

    fn feedback(&self) -> bool {
        self.contain(&["actual", "feedback", "rueck", "monitor"]) || self.edge(&["ist"])
    }
}

/// Whether a name counts rows.
pub(super) fn is_index(name: &str) -> bool {
    name.trim() == "#"
        || Words::of(name).are(&["nr", "no", "index", "sample", "samples", "zeile", "lfd", "n", "scan", "row", "count"])
}

/// Whether the names are those of a table with one value in each row, and its name beside it.
pub(super) fn is_long<'a>(names: impl Iterator<Item = &'a str> + Clone) -> bool {
    let one = |words: &[&str]| names.clone().any(|name| words.contains(&name.to_lowercase().as_str()));
    one(&["varname", "variable", "tag", "tagname", "signal", "channel", "kanal"])
        && one(&["varvalue", "value", "wert", "messwert"])
}

/// Whether a name is that of a time.
pub(super) fn is_time(name: &str) -> bool {
    let words = Words::of(name);
    words.contain(&["zeit", "time", "datum", "stamp", "elapsed", "sekunde", "second"])
        || words.are(&["t", "ts", "date", "clock"])
}

/// How well a name and a unit fit a column of the log: 0 not at all, 2 perhaps, 3 and more well.
pub(super) fn fit(column: Column, name: &str, unit: Meant) -> u32 {
    if name == column.name() {
        return 10;
    }
    let words = Words::of(name);
    let of = |quantity: Quantity| unit == Meant::Quantity(quantity);
    let none = unit == Meant::Nothing;
    match column {
        Column::Y => {
            let fits = of(Quantity::Length) || none || unit == Meant::Signal;
            let other = words.setpoint() || words.command() || words.pressure();
            match (fits && !other, words.position(), of(Quantity::Length)) {
                (true, true, sure) => 3 + 2 * u32::from(sure),
                (true, false, true) => 2,
                _ => 0,
            }
        }
        Column::YRef => {
            let fits = (of(Quantity::Length) || none) && words.setpoint() && !words.command() && !words.pressure();
            if fits { 3 + u32::from(words.position()) + u32::from(of(Quantity::Length)) } else { 0 }
        }
        Column::U => {
            let electric = of(Quantity::Voltage) || unit == Meant::Signal;
            let feedback = 2 * u32::from(words.feedback());
            match (electric || none, words.command() && !words.pressure(), electric) {
                (true, true, sure) => 4 + 2 * u32::from(sure) - feedback,
                (true, false, true) if words.contain(&["spannung", "voltage"]) && !words.supply() => 2,
                _ => 0,
            }
        }
        Column::PSup => {
            let fits = of(Quantity::Pressure) || (none && words.pressure());
            if fits && words.supply() { 4 } else { 0 }
        }
        Column::PA | Column::PB => {
            let fits = of(Quantity::Pressure) || (none && words.pressure());
            if !fits || words.supply() || words.setpoint() {
                return 0;
            }
            match (side(name), column) {
                (Some((found, sure)), column) if found == column => 3 + u32::from(sure),
                (None, _) => 2,
                _ => 0,
            }
        }
        Column::FExt => {
            let fits = of(Quantity::Force) || none;
            let named = words.contain(&["kraft", "force"]) || words.are(&["f", "fext", "load", "last"]);
            match (fits && named, of(Quantity::Force)) {
                (true, _) => 3,
                (false, true) => 2,
                _ => 0,
            }
        }
        Column::V | Column::Z => 0,
    }
}

/// The chamber a pressure's name belongs to, and whether that is sure: letters are, numbers and sides are not.
pub(super) fn side(name: &str) -> Option<(Column, bool)> {
    let words = Words::of(name);
    let letter = |letter: char| {
        words.0.iter().any(|word| {
            let stem = word.strip_suffix(letter);
            stem.is_some_and(|stem| {
                ["", "p", "druck", "pressure", "press", "kammer", "chamber", "port", "side", "seite"].contains(&stem)
            })
        })
    };
    match (letter('a'), letter('b')) {
        (true, false) => return Some((Column::PA, true)),
        (false, true) => return Some((Column::PB, true)),
        _ => {}
    }
    if words.contain(&["kolbenseit", "boden"]) || words.are(&["cap", "head", "blind"]) {
        return Some((Column::PA, false));
    }
    if words.contain(&["stange", "ringseit"]) || words.are(&["rod"]) {
        return Some((Column::PB, false));
    }
    let last = words.0.iter().filter_map(|word| word.chars().next_back()).rfind(char::is_ascii_digit)?;
    match last {
        // The working ports of a valve are 4 and 2 (ISO 11727).
        '1' | '4' => Some((Column::PA, false)),
        '2' => Some((Column::PB, false)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_english_and_german_find_their_column() {
        let length = Meant::Quantity(Quantity::Length);
        let pressure = Meant::Quantity(Quantity::Pressure);
        let volt = Meant::Quantity(Quantity::Voltage);
        for (name, unit, column) in [
            ("Weg", length, Column::Y),
            ("Kolbenweg", Meant::Nothing, Column::Y),
            ("Istposition", length, Column::Y),
            ("Position", Meant::Nothing, Column::Y),
            ("ActualPosition", length, Column::Y),
            ("Sollposition", length, Column::YRef),
            ("Setpoint", Meant::Nothing, Column::YRef),
            ("Ventil Sollwert", volt, Column::U),
            ("Ventilspannung", volt, Column::U),
            ("Stellgröße", Meant::Signal, Column::U),
            ("Valve command", Meant::Nothing, Column::U),
            ("u_v", volt, Column::U),
            ("Druck A", pressure, Column::PA),
            ("p_B", Meant::Nothing, Column::PB),
            ("Kammer A", pressure, Column::PA),
            ("Druck Stangenseite", pressure, Column::PB),
            ("P4", Meant::Nothing, Column::PA),
            ("P2", pressure, Column::PB),
            ("Versorgungsdruck", Meant::Nothing, Column::PSup),
            ("Supply", pressure, Column::PSup),
            ("Kraft", Meant::Nothing, Column::FExt),
        ] {
            let best = Column::ALL.into_iter().max_by_key(|column| fit(*column, name, unit)).expect("columns");
            assert!(fit(column, name, unit) >= 3, "{name}");
            assert_eq!(best, column, "{name}");
            let rivals =
                Column::ALL.into_iter().filter(|other| fit(*other, name, unit) == fit(column, name, unit)).count();
            assert_eq!(rivals, 1, "{name}");
        }
        for (name, unit) in [("Versorgungsspannung", volt), ("Temperatur", Meant::Nothing), ("CH1", Meant::Nothing)] {
            assert!(Column::ALL.into_iter().all(|column| fit(column, name, unit) == 0), "{name}");
        }
        assert!(is_time("Zeitstempel") && is_time("t [s]") && is_index("Nr.") && !is_time("Druck"));
    }
}
