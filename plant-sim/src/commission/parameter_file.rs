//! The board's parameters as a TOML file: `name = value` lines, names and units as in `plant-sim board parameters`.

use super::{Change, out_of_range};
use board_link::Parameter;
use firmware_core::Settings;
use rig_files::{Document, InputError, Short};
use std::fmt::Write;

/// What a file for `board apply` is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A rig file: it has tables.
    Rig,
    /// Parameters of a board.
    Parameters,
}

/// Tells the two kinds apart; `file` is what errors call it.
///
/// # Errors
/// The text is not TOML, or empty.
pub fn kind(text: &str, file: &str) -> Result<Kind, InputError> {
    let document = Document::parse(text, file)?;
    let entries = document.entries();
    if entries.is_empty() {
        return Err(InputError::new(file, "is empty", "give a rig file, or what `board parameters --out` wrote"));
    }
    Ok(if entries.iter().any(|entry| entry.is_table()) { Kind::Rig } else { Kind::Parameters })
}

/// Reads the parameters of a file; it need not name all.
///
/// # Errors
/// A key that is no parameter, a value that is no number or outside its range: with line, key and remedy.
pub fn parse(text: &str, file: &str) -> Result<Vec<Change>, InputError> {
    let document = Document::parse(text, file)?;
    let entries = document.entries();
    let change = |entry: &rig_files::Entry<'_>| {
        let parameter =
            Parameter::from_name(entry.name).ok_or_else(|| entry.unknown(Parameter::ALL.map(Parameter::name)))?;
        let value = entry.number()? as f32;
        let refused = |_| entry.error(format!("= {} is refused", Short(value)), out_of_range(parameter, value));
        parameter.check(value).map_err(refused)?;
        Ok((parameter, value))
    };
    entries.iter().map(change).collect()
}

/// The text of a file with all parameters; `of` says in a few words whose they are.
#[must_use]
pub fn text(settings: &Settings, of: &str) -> String {
    let mut text = format!("# Parameters of {of}. `plant-sim board --port … apply FILE` puts them in force.\n");
    for parameter in Parameter::ALL {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} = {:?}", parameter.name(), settings.get(parameter));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_to_the_last_bit() {
        let mut settings = Settings::default();
        settings.set(Parameter::Gain, 4.1).expect("in range");
        settings.set(Parameter::FillCoefficient, 7.123_456e-9).expect("in range");
        let text = text(&settings, "a test");
        assert_eq!(kind(&text, "p.toml"), Ok(Kind::Parameters));
        let found = parse(&text, "p.toml").expect("readable");
        assert_eq!(found.len(), Parameter::ALL.len());
        for (parameter, value) in found {
            assert_eq!(value.to_bits(), settings.get(parameter).to_bits(), "{}", parameter.name());
        }
    }

    #[test]
    fn what_is_no_parameter_is_refused_with_line_key_and_remedy() {
        for (text, words) in [
            ("gian_v_per_m = 4", &["line 1", "gian_v_per_m", "did you mean `gain_v_per_m`"][..]),
            ("gain_v_per_m = 4\nmonitor = 3", &["line 2", "monitor", "0 to 2"]),
            ("gain_v_per_m = \"4\"", &["line 1", "gain_v_per_m", "number"]),
            ("gain_v_per_m = nan", &["line 1", "gain_v_per_m"]),
        ] {
            let error = parse(text, "p.toml").expect_err(text).to_string();
            for word in words {
                assert!(error.contains(word), "{text}: expected {word:?} in {error}");
            }
        }
        assert!(kind("", "p.toml").is_err());
    }
}
