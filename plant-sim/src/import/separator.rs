//! What stands between the cells of a row.

/// What stands between the cells of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Separator {
    Byte(u8),
    Blanks,
}

/// Lines that are looked at to find the separator, or the header.
pub(super) const LOOKED_AT: usize = 1000;
/// Their names in a mapping, and the characters themselves.
const NAMES: [(&str, &str, Separator); 4] = [
    ("comma", ",", Separator::Byte(b',')),
    ("semicolon", ";", Separator::Byte(b';')),
    ("tab", "\t", Separator::Byte(b'\t')),
    ("space", " ", Separator::Blanks),
];

impl Separator {
    /// All there are; the likelier first where a line has several of them: a comma may be a decimal sign.
    pub(super) const ALL: [Self; 4] = [Self::Byte(b'\t'), Self::Byte(b';'), Self::Byte(b','), Self::Blanks];

    /// The separator that a mapping calls so.
    pub(super) fn from_name(name: &str) -> Option<Self> {
        NAMES.iter().find(|(word, mark, _)| [*word, *mark].contains(&name)).map(|(_, _, separator)| *separator)
    }

    /// What a mapping calls it.
    pub(super) fn name(self) -> &'static str {
        NAMES.iter().find(|(_, _, separator)| *separator == self).map_or("", |(word, _, _)| word)
    }

    /// The cells of a line.
    pub(super) fn cells(self, line: &str) -> Vec<String> {
        let Self::Byte(byte) = self else {
            return line.split_whitespace().map(clean).collect();
        };
        if !line.contains('"') {
            return line.split(char::from(byte)).map(clean).collect();
        }
        first_row(byte, line).iter().map(clean).collect()
    }

    /// Whether a quote opens in a line and is not closed in it.
    pub(super) fn leaves_open(self, line: &str) -> bool {
        let Self::Byte(byte) = self else { return false };
        // A line below would belong to the same cell.
        line.contains('"') && first_row(byte, &format!("{line}\n-")).as_slice().contains('\n')
    }

    /// Another separator that does what is wanted.
    pub(super) fn other(self, wanted: impl Fn(Self) -> bool) -> Option<Self> {
        Self::ALL.into_iter().find(|other| *other != self && wanted(*other))
    }
}

fn first_row(byte: u8, text: &str) -> csv::StringRecord {
    let mut reader = csv::ReaderBuilder::new();
    let reader = reader.delimiter(byte).has_headers(false).flexible(true).from_reader(text.as_bytes());
    reader.into_records().next().and_then(Result::ok).unwrap_or_default()
}

/// A cell without blanks and quotes around it.
pub(super) fn clean(field: &str) -> String {
    field.trim().trim_matches('"').trim().to_string()
}
