//! A foreign table → the draft of its mapping. Every line says why; what the table does not tell is left open as `"?"`,
//! which [`Mapping::parse`] refuses with the line.

mod layout;
mod names;
mod quantities;
mod seen;
mod time;

use super::{Mapping, text};
use layout::{Kind, Layout};
use quantities::Choice;
use rig_files::{Column, InputError, RigFile};
use seen::Seen;
use std::fmt::Write as _;
use std::path::Path;

/// The order in which a draft has the columns of a log.
const ORDER: [Column; 7] = [Column::Y, Column::U, Column::PA, Column::PB, Column::PSup, Column::FExt, Column::YRef];

/// The draft of a mapping.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// The mapping file.
    pub text: String,
    /// Lines with a choice that is left open.
    pub open: Vec<usize>,
    /// Why `import` refuses it although nothing is open.
    pub refused: Option<InputError>,
}

/// Drafts the mapping of a table; what the rig is helps with units and zeros.
///
/// # Errors
/// The file cannot be read, or no table of numbers is in it.
pub fn suggest(path: &Path, rig: Option<&RigFile>) -> Result<Draft, InputError> {
    let (text, note) = text::read(path)?;
    suggest_text(&text, &path.display().to_string(), note.as_deref(), rig)
}

/// As [`suggest`], of the bytes of a file.
///
/// # Errors
/// As [`suggest`].
pub fn suggest_bytes(bytes: &[u8], file: &str, rig: Option<&RigFile>) -> Result<Draft, InputError> {
    let (text, note) = text::decode(bytes, file)?;
    suggest_text(&text, file, note.as_deref(), rig)
}

fn suggest_text(text: &str, file: &str, note: Option<&str>, rig: Option<&RigFile>) -> Result<Draft, InputError> {
    let Some(layout) = layout::find(text) else {
        let remedy = "export the recording as a text table: one row for each sample, two or more columns of numbers";
        return Err(InputError::new(file, "has no table of numbers", remedy));
    };
    let columns = Seen::all(&layout);
    if names::is_long(columns.iter().map(|seen| seen.name.as_str())) {
        let remedy = "export it with a column for each signal, so that a row holds all values of one time";
        return Err(InputError::new(file, "has one value in each row, and its name beside it", remedy));
    }
    let mut page = Page::default();
    head(&mut page, file, note, &layout, &columns);
    let time = time::choose(&layout, &columns);
    let mut chosen = ORDER.map(|column| pick(column, &columns, time.columns()));
    one_side(&mut chosen);
    let lines = quantities::lines(&columns, &chosen, rig);
    let used: Vec<usize> = chosen.iter().flat_map(|choice| &choice.found).chain(time.columns()).copied().collect();
    let left = unused(&columns, &used, &chosen);
    // What is left out may be a gauge pressure, too.
    let may_be_gauge = left.as_ref().is_some_and(|[_, wanted]| wanted.contains("p_"));
    source(&mut page, &layout, &columns, &time, may_be_gauge || lines.iter().any(|line| line.gauge));
    time.write(&mut page, &layout);
    for line in lines {
        line.write(&mut page, &layout, &columns);
    }
    if let Some(left) = &left {
        tell_unused(&mut page, left);
    }
    let mut draft = Draft { open: page.open(), text: page.text(), refused: None };
    if draft.open.is_empty() {
        let tried = Mapping::parse(&draft.text, "the draft").and_then(|mapping| mapping.convert_text(text, file));
        draft.refused = tried.err();
    }
    Ok(draft)
}

/// The columns that fit a column of the log best: none, one, or several that fit alike.
fn pick(column: Column, columns: &[Seen], taken: &[usize]) -> Choice {
    let fit = |seen: &Seen| {
        let numbers = seen.kind == Kind::Number && !taken.contains(&seen.number);
        if numbers {
            names::fit(column, if seen.name == column.name() { &seen.name } else { &seen.bare }, seen.meant())
        } else {
            0
        }
    };
    let best = columns.iter().map(fit).max().unwrap_or(0);
    let found = columns.iter().filter(|seen| best >= 2 && fit(seen) == best).map(|seen| seen.number).collect();
    Choice { column, found, sure: best >= 4 }
}

/// A single pressure that names no chamber is not that of both: chamber A's, until somebody looks.
fn one_side(chosen: &mut [Choice]) {
    let of = |column: Column| chosen.iter().position(|choice| choice.column == column);
    if let (Some(a), Some(b)) = (of(Column::PA), of(Column::PB))
        && chosen[a].found.len() == 1
        && chosen[a].found == chosen[b].found
    {
        chosen[b].found.clear();
    }
}

/// Columns of numbers that no name or unit gave a place, and the columns of the log that they may be.
fn unused(columns: &[Seen], used: &[usize], chosen: &[Choice]) -> Option<[String; 2]> {
    let left = columns.iter().filter(|seen| seen.kind == Kind::Number && !used.contains(&seen.number));
    let left: Vec<String> = left.map(Seen::called).collect();
    let wanted = chosen.iter().filter(|choice| choice.found.is_empty() && choice.column != Column::Y);
    let wanted: Vec<&str> = wanted.map(|choice| choice.column.name()).collect();
    (!left.is_empty() && !wanted.is_empty()).then(|| [left.join(", "), wanted.join(", ")])
}

/// How to give a place to the columns that have none.
fn tell_unused(page: &mut Page, [left, wanted]: &[String; 2]) {
    page.0.push((String::new(), String::new()));
    page.comment(format!("Not used: {left}."));
    page.comment(format!("If one of them is {wanted}, add its table, for instance:"));
    page.comment("[column.p_a_pa]");
    page.comment("from = \"NAME\"");
    page.comment("unit = \"bar\"");
    page.comment("points = [[0.0, 0.0], [10.0, 16.0]]   two readings and what they mean, if it reads volts: 0 V is 0 bar, 10 V 16 bar");
    page.comment("gauge = true");
}

/// Lines of a mapping with their comments.
#[derive(Default)]
struct Page(Vec<(String, String)>);

impl Page {
    fn comment(&mut self, text: impl AsRef<str>) {
        self.0.push((format!("# {}", text.as_ref()).trim_end().to_string(), String::new()));
    }

    fn table(&mut self, name: &str) {
        self.0.push((String::new(), String::new()));
        self.0.push((format!("[{name}]"), String::new()));
    }

    fn key(&mut self, key: &str, value: impl std::fmt::Display, why: impl Into<String>) {
        self.0.push((format!("{key} = {value}"), why.into()));
    }

    fn open(&self) -> Vec<usize> {
        let open = |line: &str| !line.starts_with('#') && line.ends_with("= \"?\"");
        (1..=self.0.len()).filter(|number| open(&self.0[number - 1].0)).collect()
    }

    fn text(&self) -> String {
        let mut text = String::new();
        for (line, why) in &self.0 {
            let _ = match why.as_str() {
                "" => writeln!(text, "{line}"),
                why => writeln!(text, "{line:<35} # {why}"),
            };
        }
        text
    }
}

/// Text in quotes, as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_string()).to_string()
}

/// How `from` names a column: by its name where the mapping can find it, else by its number.
fn from(seen: &Seen, columns: &[Seen], layout: &Layout) -> String {
    let once = columns.iter().filter(|other| other.name == seen.name).count() == 1;
    if layout.header && once && !seen.name.is_empty() { quoted(&seen.name) } else { seen.number.to_string() }
}

fn head(page: &mut Page, file: &str, note: Option<&str>, layout: &Layout, columns: &[Seen]) {
    page.comment(format!("Draft of a mapping for {file}, by `plant-sim import --suggest`."));
    page.comment("Behind each line stands why it is so. A \"?\" is left to you: as long as it stands, the mapping is refused there.");
    page.comment("");
    let note = note.map_or(String::new(), |note| format!("; {note}"));
    page.comment(format!("The table begins in line {}: {} rows{note}.", layout.first_line, layout.rows.len()));
    if !layout.header
        && let Some((number, line)) = layout.above.last()
    {
        page.comment(format!(
            "Line {number} above it: {}",
            line.trim().chars().take(90).collect::<String>().escape_debug()
        ));
    }
    let cells = |seen: &Seen| {
        let what = match seen.kind {
            Kind::Number | Kind::Grouped => format!("{} to {}", short(seen.low), short(seen.high)),
            Kind::DateTime => format!("date with time, {} to {}", ends(seen).0, ends(seen).1),
            Kind::Date => format!("date, {}", ends(seen).0),
            Kind::Clock => format!("time of day, {} to {}", ends(seen).0, ends(seen).1),
            Kind::Missing => "nothing".to_string(),
            Kind::Text => "text".to_string(),
        };
        let missing = if seen.missing > 0 { format!("; {} missing", seen.missing) } else { String::new() };
        what + &missing
    };
    for seen in columns {
        let name = if seen.name.is_empty() { "(no name)".to_string() } else { seen.name.clone() };
        let unit = match (seen.unit, seen.unit_from) {
            (Some(_), "the line of units") => {
                format!(" [{}]", layout.units.get(seen.number - 1).map_or("", |unit| unit.trim_matches(['[', ']'])))
            }
            _ => String::new(),
        };
        page.comment(format!("  {:>2}  {:<28} {}", seen.number, name + &unit, cells(seen)));
    }
}

fn ends(seen: &Seen) -> (&str, &str) {
    (seen.stamps.first().map_or("", String::as_str), seen.stamps.last().map_or("", String::as_str))
}

/// A number for a comment.
fn short(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 || (1.0e-3..1.0e7).contains(&size) {
        let digits = if size >= 1000.0 {
            0
        } else if size >= 1.0 {
            3
        } else {
            5
        };
        let text = format!("{value:.digits$}");
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
    } else {
        format!("{value:.3e}")
    }
}

fn source(page: &mut Page, layout: &Layout, columns: &[Seen], time: &time::Found, gauge: bool) {
    page.table("source");
    page.key("separator", quoted(layout.separator.name()), format!("it gives {} columns in every row", columns.len()));
    if layout.skip_lines > 0 {
        let what = if layout.header { "the header" } else { "the rows" };
        page.key("skip_lines", layout.skip_lines, format!("lines above {what}"));
    }
    match (layout.header, layout.names.is_empty()) {
        (true, _) => page.key("header", true, format!("line {} names the columns", layout.skip_lines + 1)),
        (false, true) => page.key("header", false, "no line names the columns: they are counted from 1"),
        (false, false) => {
            page.key("header", false, "the names stand behind a comment sign: columns are counted from 1")
        }
    }
    if layout.units_line {
        page.key("units_line", true, "the line below the header holds units");
    }
    if let Some(mark) = layout.comment {
        page.key("comment", quoted(&mark.to_string()), "such lines stand between the rows");
    }
    if layout.decimal_comma {
        page.key("decimal_comma", true, "numbers like 1,5");
    }
    if let Some(mark) = layout.thousands {
        page.key("thousands", quoted(&mark.to_string()), "between groups of three digits");
    }
    let mut words: Vec<&String> = Vec::new();
    for word in columns.iter().filter(|seen| seen.kind == Kind::Number).flat_map(|seen| &seen.words) {
        // A number that is written in another way is no word.
        if !words.contains(&word) && !word.contains(|c: char| c.is_ascii_digit()) {
            words.push(word);
        }
    }
    if !words.is_empty() {
        let list: Vec<String> = words.into_iter().map(|word| quoted(word)).collect();
        let why = "words among the numbers, taken for missing samples; uncertain: look what they mean";
        page.key("missing", format!("[{}]", list.join(", ")), why);
    }
    if gauge {
        page.key(
            "atmosphere_pa",
            "1.013e5",
            "added to gauge pressures; at sea level, 1.2 kPa less for every 100 m of height",
        );
    }
    time.write_source(page);
}
