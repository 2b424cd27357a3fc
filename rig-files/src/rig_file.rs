//! The rig file: nominal parameters, converters, tolerances and effects, read from TOML.

use crate::document::{Document, Entry};
use crate::error::InputError;
use crate::io::Io;
use crate::tolerance::Tolerance;
use crate::write::{read_text, write_file};
use plant_model::{Effect, Effects, Plant, RIG_KEYS, Rig, rig_key};
use std::path::Path;

/// Everything a rig file says.
#[derive(Clone, Debug, PartialEq)]
pub struct RigFile {
    /// What the rig is called; by default the name of the file.
    pub name: String,
    /// Nominal parameters, validated.
    pub rig: Rig<f64>,
    /// The controller's converters and tick.
    pub io: Io,
    /// How well the nominal values are known.
    pub tolerance: Tolerance,
    /// What this rig adds to the paper's model.
    pub effects: Effects<f64>,
}

/// What may stand in the file besides the tables of the rig's values.
const TOP_LEVEL: [&str; 4] = ["name", "io", "tolerance", "effects"];
const IO_KEYS: [&str; 6] =
    ["position_range_m", "pressure_range_pa", "adc_bits", "valve_range_v", "dac_bits", "tick_hz"];

impl RigFile {
    /// A rig with default converters, default tolerance and no effects.
    #[must_use]
    pub fn new(name: impl Into<String>, rig: Rig<f64>) -> Self {
        Self { name: name.into(), rig, io: Io::default(), tolerance: Tolerance::default(), effects: Effects::none() }
    }

    /// The paper's case (a): bore 25 mm, stroke 1 m.
    #[must_use]
    pub fn paper_a() -> Self {
        Self::new("paper case (a)", Rig::paper_a())
    }

    /// The paper's case (b): bore 60 mm, stroke 1 m.
    #[must_use]
    pub fn paper_b() -> Self {
        Self::new("paper case (b)", Rig::paper_b())
    }

    /// The paper's case (c): bore 60 mm, stroke 174.6 mm.
    #[must_use]
    pub fn paper_c() -> Self {
        Self::new("paper case (c)", Rig::paper_c())
    }

    /// Reads a rig file.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, or does not describe a rig; see [`InputError`].
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&read_text(path)?, &path.display().to_string())
    }

    /// Parses the text of a rig file; `file` is what errors call it.
    ///
    /// # Errors
    /// As [`RigFile::read`].
    pub fn parse(text: &str, file: &str) -> Result<Self, InputError> {
        let document = Document::parse(text, file)?;
        let located = |key: &str, problem: String, line: Option<u64>| {
            let remedy = "correct the value";
            let error = InputError::new(file, format!("`{key}` {problem}"), remedy);
            line.map_or(error.clone(), |line| error.at_line(line))
        };
        let stem = Path::new(file).file_stem().map_or("rig".into(), |stem| stem.to_string_lossy().into_owned());
        let mut parsed = Self::new(stem, Rig::paper_a());
        let mut lines: Vec<Option<Entry<'_>>> = vec![None; RIG_KEYS.len()];

        let top = document.entries();
        for entry in &top {
            match entry.name {
                "name" => parsed.name = entry.string()?.to_string(),
                table if is_table(table) => {
                    for key in entry.table()? {
                        let at = rig_value(&mut parsed.rig, entry.name, &key)?;
                        lines[at] = Some(key);
                    }
                }
                "effects" => {
                    entry.table()?;
                }
                "io" => parsed.io = io(entry)?,
                "tolerance" => parsed.tolerance = tolerance(entry)?,
                _ => return Err(entry.unknown(TOP_LEVEL.into_iter().chain(RIG_KEYS.iter().map(|key| key.table)))),
            }
        }

        for (key, line) in RIG_KEYS.iter().zip(&lines) {
            if line.is_none() {
                let example = key.get(&Rig::<f64>::paper_a());
                let remedy =
                    format!("add it under [{}], e.g. `{} = {example:?}` (case (a) of the paper)", key.table, key.name);
                return Err(InputError::new(file, format!("`{}` is missing", key.path), remedy));
            }
        }
        let line_of = |path: &str| {
            let at = RIG_KEYS.iter().position(|key| key.path == path)?;
            lines[at].as_ref().map(|entry| entry.line)
        };
        parsed.rig.validate().map_err(|error| {
            located(error.key, format!("= {} must {}", error.value, error.must), line_of(error.key))
        })?;
        for entry in top.iter().filter(|entry| entry.name == "effects") {
            parsed.effects = effects(entry, &parsed.rig)?;
            let inner = entry.table()?;
            Plant::new(&parsed.rig, &parsed.effects).map_err(|error| {
                let line = inner.iter().find(|effect| error.key.starts_with(&effect.path)).map(|effect| effect.line);
                located(error.key, format!("= {} must {}", error.value, error.must), line)
            })?;
        }
        Ok(parsed)
    }

    /// Writes the rig file, whole or not at all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), InputError> {
        write_file(path, |out| out.write_all(self.to_toml().as_bytes()))
    }
}

fn is_table(name: &str) -> bool {
    RIG_KEYS.iter().any(|key| key.table == name)
}

/// Stores one numeric key and says which it was.
fn rig_value(rig: &mut Rig<f64>, table: &str, entry: &Entry<'_>) -> Result<usize, InputError> {
    let Some(at) = RIG_KEYS.iter().position(|key| key.table == table && key.name == entry.name) else {
        if let Some(key) = rig_key(entry.name) {
            return Err(entry.error("stands in the wrong table", format!("move it under [{}]", key.table)));
        }
        return Err(entry.unknown(RIG_KEYS.iter().filter(|key| key.table == table).map(|key| key.name)));
    };
    let key = &RIG_KEYS[at];
    let value = entry.number()?;
    let limits = key.limits;
    if !(limits.low..=limits.high).contains(&value) {
        let problem = format!("= {value} is not plausible: expected {limits}");
        let remedy = if limits.unit.is_empty() {
            "check the value".to_string()
        } else {
            format!("check sign and unit, the file wants {}", limits.unit)
        };
        return Err(entry.error(problem, remedy));
    }
    key.set(rig, value);
    Ok(at)
}

fn io(table: &Entry<'_>) -> Result<Io, InputError> {
    let mut io = Io::default();
    for entry in table.table()? {
        match entry.name {
            "position_range_m" => io.position_range_m = range(&entry)?,
            "pressure_range_pa" => io.pressure_range_pa = range(&entry)?,
            "valve_range_v" => io.valve_range_v = range(&entry)?,
            "adc_bits" => io.adc_bits = entry.whole(1, 16)?,
            "dac_bits" => io.dac_bits = entry.whole(1, 16)?,
            "tick_hz" => io.tick_hz = entry.whole(1, 100_000)?,
            _ => return Err(entry.unknown(IO_KEYS)),
        }
    }
    Ok(io)
}

fn range(entry: &Entry<'_>) -> Result<[f64; 2], InputError> {
    let [low, high] = entry.numbers()?;
    if low < high && (high - low).is_finite() {
        Ok([low, high])
    } else {
        Err(entry.error(format!("= [{low}, {high}] is no range"), "write the lower end first: [low, high]"))
    }
}

fn tolerance(table: &Entry<'_>) -> Result<Tolerance, InputError> {
    let mut tolerance = Tolerance::default();
    for entry in table.table()? {
        if entry.name == "default" {
            tolerance.default = relative(&entry)?;
        } else if is_table(entry.name) {
            // `load.mass_kg = 0.005` is a table `load` to TOML.
            for inner in entry.table()? {
                let value = relative(&inner)?;
                if !tolerance.set(&format!("{}.{}", entry.name, inner.name), value) {
                    return Err(
                        inner.unknown(RIG_KEYS.iter().filter(|key| key.table == entry.name).map(|key| key.name))
                    );
                }
            }
        } else {
            let value = relative(&entry)?;
            if !tolerance.set(entry.name, value) {
                return Err(entry.unknown(RIG_KEYS.iter().map(|key| key.name).chain(["default"])));
            }
        }
    }
    Ok(tolerance)
}

fn effects(table: &Entry<'_>, rig: &Rig<f64>) -> Result<Effects<f64>, InputError> {
    let mut effects = Effects::none();
    for entry in table.table()? {
        let Some(effect) = Effect::from_id(entry.name) else {
            return Err(entry.unknown(Effect::ALL.map(Effect::id)));
        };
        let parameters = effect.info().parameters;
        let mut values = effect.neutral(rig);
        let given = entry.table()?;
        if given.is_empty() {
            let (name, typical) = (parameters[0].name, parameters[0].typical);
            let remedy =
                format!("give it a value, e.g. `{name} = {typical:?}`, or remove the table for \"no such effect\"");
            return Err(entry.error("has no parameter", remedy));
        }
        for parameter in given {
            let Some(at) = parameters.iter().position(|info| info.name == parameter.name) else {
                return Err(parameter.unknown(parameters.iter().map(|info| info.name)));
            };
            let (info, value) = (&parameters[at], parameter.number()?);
            if !(info.min..=info.max).contains(&value) {
                let problem = format!("= {value} must lie from {} to {}", info.min, info.max);
                return Err(parameter.error(problem, format!("it means: {}", info.meaning)));
            }
            values[at] = value;
        }
        effects.set(effect, &values);
    }
    Ok(effects)
}

fn relative(entry: &Entry<'_>) -> Result<f64, InputError> {
    let value = entry.number()?;
    if (0.0..1.0).contains(&value) {
        Ok(value)
    } else {
        let problem = format!("= {value} must be a relative standard error from 0 to below 1");
        Err(entry.error(problem, "write 2 % as 0.02, and 0 for exact"))
    }
}
