//! The units a foreign table may use, and how its header writes them.

/// What a column of a log measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Time,
    Length,
    Pressure,
    Voltage,
    Force,
}

impl Quantity {
    /// Of a column of the log.
    pub(super) fn of(column: &str) -> Self {
        match column {
            "t_s" => Self::Time,
            "u_v" => Self::Voltage,
            "f_ext_n" => Self::Force,
            pressure if pressure.starts_with("p_") => Self::Pressure,
            _ => Self::Length,
        }
    }
}

/// A unit of a mapping: its quantity, name and factor to SI.
type Unit = (Quantity, &'static str, f64);

const UNITS: &[Unit] = &[
    (Quantity::Time, "s", 1.0),
    (Quantity::Time, "ms", 1.0e-3),
    (Quantity::Time, "us", 1.0e-6),
    (Quantity::Time, "ns", 1.0e-9),
    (Quantity::Time, "min", 60.0),
    (Quantity::Time, "h", 3600.0),
    (Quantity::Time, "d", 86_400.0),
    (Quantity::Length, "m", 1.0),
    (Quantity::Length, "cm", 1.0e-2),
    (Quantity::Length, "mm", 1.0e-3),
    (Quantity::Length, "um", 1.0e-6),
    (Quantity::Length, "in", 0.0254),
    (Quantity::Pressure, "Pa", 1.0),
    (Quantity::Pressure, "hPa", 1.0e2),
    (Quantity::Pressure, "mbar", 1.0e2),
    (Quantity::Pressure, "kPa", 1.0e3),
    (Quantity::Pressure, "bar", 1.0e5),
    (Quantity::Pressure, "MPa", 1.0e6),
    (Quantity::Pressure, "psi", 6_894.757_293_168),
    (Quantity::Voltage, "V", 1.0),
    (Quantity::Voltage, "mV", 1.0e-3),
    (Quantity::Force, "N", 1.0),
    (Quantity::Force, "kN", 1.0e3),
    (Quantity::Force, "lbf", 4.448_221_615_260_5),
    (Quantity::Force, "kgf", 9.806_65),
];

/// Other ways to write a unit, in lower case.
const SPELLINGS: &[(&str, &str)] = &[
    ("sec", "s"),
    ("sek", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("sekunden", "s"),
    ("msec", "ms"),
    ("milliseconds", "ms"),
    ("µs", "us"),
    ("μs", "us"),
    ("usec", "us"),
    ("std", "h"),
    ("µm", "um"),
    ("μm", "um"),
    ("inch", "in"),
    ("inches", "in"),
    ("volt", "V"),
    ("volts", "V"),
    ("pascal", "Pa"),
    ("newton", "N"),
    ("n/mm²", "MPa"),
    ("n/mm2", "MPa"),
    ("kp", "kgf"),
];

/// The factor of a unit as a mapping writes it, for a quantity.
pub(super) fn factor(quantity: Quantity, unit: &str) -> Option<f64> {
    UNITS.iter().find(|(of, name, _)| *of == quantity && *name == unit).map(|(_, _, factor)| *factor)
}

/// What a mapping states of a signal that stands for a quantity, for a message.
pub(super) fn two_readings(signal: &str, quantity: Quantity) -> String {
    let [low, high] = if signal == "%" { ["0", "100"] } else { ["4", "20"] };
    let ([from, to], unit) = match quantity {
        Quantity::Voltage => (["-5.0", "5.0"], "V"),
        Quantity::Length => (["-0.1", "0.1"], "m"),
        Quantity::Pressure => (["1.0e5", "1.1e6"], "Pa"),
        Quantity::Force => (["0.0", "500.0"], "N"),
        Quantity::Time => (["0.0", "1.0"], "s"),
    };
    format!(
        "say what two readings mean, in {unit} if no `unit` is given, e.g. `points = [[{low}, {from}], [{high}, {to}]]`"
    )
}

/// The units of a quantity, for a message.
pub(super) fn names(quantity: Quantity) -> String {
    let fitting: Vec<&str> = UNITS.iter().filter(|(of, _, _)| *of == quantity).map(|(_, name, _)| *name).collect();
    fitting.join(", ")
}

/// What stands behind readings that measure no quantity of a log.
pub(super) const SIGNALS: [&str; 2] = ["%", "mA"];

/// A unit as a header or a cell writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Written {
    /// What it measures, its name in a mapping and its factor; `None` for percent and mA, which are no unit of a log.
    pub(super) unit: Option<Unit>,
    /// `bar(g)`: true, `bara`: false.
    pub(super) gauge: Option<bool>,
    /// One of [`SIGNALS`].
    pub(super) signal: Option<&'static str>,
}

/// Reads a unit from the text of a header, e.g. `mm`, `[bar]`, `bar(g)`, `psia`, `µs`, `mA`.
pub(super) fn read(text: &str) -> Option<Written> {
    let bare = text.trim().trim_start_matches(['[', '(', '{', '<']).trim_end_matches([']', '}', '>']).trim();
    // `bar(g)` keeps its bracket, `(bar)` has lost its first one.
    let bare = if bare.contains('(') { bare } else { bare.trim_end_matches(')').trim() };
    let percent = ["pct", "percent", "prozent"].iter().any(|word| word.eq_ignore_ascii_case(bare));
    let signal = SIGNALS.into_iter().find(|signal| signal.eq_ignore_ascii_case(bare) || (percent && *signal == "%"));
    if let Some(signal) = signal {
        return Some(Written { unit: None, gauge: None, signal: Some(signal) });
    }
    if let Some(unit) = one(bare) {
        return Some(Written { unit: Some(unit), gauge: None, signal: None });
    }
    let lower = bare.to_lowercase();
    for (ending, gauge) in [
        ("(g)", true),
        ("(a)", false),
        ("(rel)", true),
        ("(abs)", false),
        ("_g", true),
        ("_a", false),
        ("_rel", true),
        ("_abs", false),
        ("abs.", false),
        ("abs", false),
        ("rel.", true),
        ("rel", true),
        ("gauge", true),
        ("ü", true),
        ("g", true),
        ("a", false),
    ] {
        // Endings are ASCII or one letter that lower case leaves as long as it was.
        let Some(stem) = lower.strip_suffix(ending).and_then(|stem| bare.get(..stem.len())) else { continue };
        if let Some(unit @ (Quantity::Pressure, _, _)) = one(stem.trim()) {
            return Some(Written { unit: Some(unit), gauge: Some(gauge), signal: None });
        }
    }
    None
}

/// A unit by its own name, or by another spelling; capital letters count only where they tell `m` from `M`.
fn one(text: &str) -> Option<Unit> {
    let exact = |name: &str| UNITS.iter().find(|(_, known, _)| *known == name).copied();
    let lower = text.to_lowercase();
    let spelt = || SPELLINGS.iter().find(|(other, _)| *other == lower).and_then(|(_, name)| exact(name));
    let loose = || {
        let alike: Vec<Unit> = UNITS.iter().filter(|(_, known, _)| known.to_lowercase() == lower).copied().collect();
        <[Unit; 1]>::try_from(alike).ok().map(|[unit]| unit)
    };
    exact(text).or_else(spelt).or_else(loose)
}

/// A header cell without its unit, and the unit: `p_A [bar]`, `Weg (mm)`, `Weg / mm`, `Druck in bar`, `Druck, bar`.
pub(super) fn split(header: &str) -> (&str, Option<Written>) {
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}'), ('<', '>')] {
        if let Some(start) = header.find(open)
            && let Some(end) = header.rfind(close)
            && start < end
            && let Some(unit) = read(&header[start..=end])
        {
            return (header[..start].trim(), Some(unit));
        }
    }
    for mark in ["/", " in ", ","] {
        if let Some((name, unit)) = header.rsplit_once(mark)
            && let Some(unit) = read(unit)
        {
            return (name.trim(), Some(unit));
        }
    }
    (header.trim(), None)
}

/// The unit at the end of a name of words: `displacement_mm`, `Druck A bar`. Single letters are taken after `_` only.
pub(super) fn ending(header: &str) -> Option<Written> {
    let (name, unit) = header.trim().rsplit_once(['_', ' '])?;
    let single = unit.chars().count() == 1;
    let underscore = header.trim().as_bytes().get(name.len()) == Some(&b'_');
    if single && !underscore { None } else { read(unit) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_as_headers_write_them() {
        for (text, name, gauge) in [
            ("[bar]", "bar", None),
            ("(mm)", "mm", None),
            ("bar(g)", "bar", Some(true)),
            ("[bar(a)]", "bar", Some(false)),
            ("barg", "bar", Some(true)),
            ("psia", "psi", Some(false)),
            ("bar abs", "bar", Some(false)),
            ("µs", "us", None),
            ("Sek", "s", None),
            ("MPA", "MPa", None),
            ("BAR", "bar", None),
            ("N/mm²", "MPa", None),
        ] {
            let written = read(text).unwrap_or_else(|| panic!("{text}"));
            assert_eq!((written.unit.map(|unit| unit.1), written.gauge), (Some(name), gauge), "{text}");
        }
        assert_eq!(read("%").and_then(|written| written.signal), Some("%"));
        for text in ["", "Druck", "a", "g", "ü", "(", "°C", "rpm"] {
            assert_eq!(read(text), None, "{text}");
        }
    }

    #[test]
    fn a_header_is_cut_into_name_and_unit() {
        for (header, name, unit) in [
            ("p_A [bar]", "p_A", "bar"),
            ("Position (mm)", "Position", "mm"),
            ("Weg / mm", "Weg", "mm"),
            ("Druck in bar", "Druck", "bar"),
            ("Druck A, bar", "Druck A", "bar"),
            ("p [bar(g)]", "p", "bar"),
        ] {
            let (bare, written) = split(header);
            assert_eq!((bare, written.and_then(|w| w.unit).map(|u| u.1)), (name, Some(unit)), "{header}");
        }
        assert_eq!(split("Druck (links)"), ("Druck (links)", None));
        assert_eq!(ending("displacement_mm").and_then(|w| w.unit).map(|u| u.1), Some("mm"));
        assert_eq!(ending("p_a").and_then(|w| w.unit), None);
        assert_eq!(ending("Druck s"), None);
    }
}
