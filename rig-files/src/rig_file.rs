//! The rig file: nominal parameters, converters, tolerances and effects, read from TOML.

use crate::document::{Document, Entry};
use crate::error::InputError;
use crate::io::Io;
use crate::tolerance::Tolerance;
use crate::write::{read_text, write_file};
use plant_model::{
    BOTH_SIDES, Effect, Effects, OpeningTable, Place, Plant, RIG_KEYS, Rig, RigKey, Short, all_keys, rig_key,
};
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
        let mut given = Given::default();
        for key in RIG_KEYS.iter().filter(|key| key.limits.optional) {
            key.set(&mut parsed.rig, 0.0);
        }

        let top = document.entries();
        for entry in &top {
            match entry.name {
                "name" => parsed.name = entry.string()?.to_string(),
                table if is_table(table) => {
                    for key in entry.table()? {
                        given.take(&mut parsed.rig, entry.name, key)?;
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

        given.fit_together(file)?;
        let line_of = |path: &str| given.line_of(path);
        parsed.rig.validate().map_err(|error| {
            located(error.key, format!("= {} must {}", Short(error.value), error.must), line_of(error.key))
        })?;
        for entry in top.iter().filter(|entry| entry.name == "effects") {
            parsed.effects = effects(entry, &parsed.rig)?;
            let inner = entry.table()?;
            Plant::new(&parsed.rig, &parsed.effects).map_err(|error| {
                let line = inner.iter().find(|effect| error.key.starts_with(&effect.path)).map(|effect| effect.line);
                located(error.key, format!("= {} must {}", Short(error.value), error.must), line)
            })?;
        }
        if let Some(entry) = given.entry(Place::spool_inertia.key().path)
            && parsed.effects.get(Effect::ValveLag).is_none()
        {
            return Err(entry.error(
                "says how a spool lags that does not lag",
                format!("state its `time_constant_s` under [effects.{}], or remove it", Effect::ValveLag),
            ));
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

/// What a table of the valve's opening takes the place of.
pub(crate) const OPENING_REPLACES: [&str; 4] =
    ["valve.dead_zone_right_v", "valve.dead_zone_left_v", "valve.slope_right", "valve.slope_left"];
/// Keys of `[valve]` that are no numbers.
const FLOW_LAW: &str = "flow_law";
const OPENING: &str = "opening";
/// Keys of the paper's flow law, and the beginning of those of ISO 6358.
const OF_THE_PAPER: [&str; 2] = ["valve.fill_coefficient_kg_per_s_pa", "valve.exhaust_coefficient_kg_per_s_pa"];
const OF_ISO_6358: [&str; 4] =
    ["valve.fill_conductance", "valve.exhaust_conductance", "valve.fill_critical", "valve.exhaust_critical"];

fn is_table(name: &str) -> bool {
    RIG_KEYS.iter().any(|key| key.table == name)
}

/// The rig's keys that a file gives, with their lines.
#[derive(Default)]
struct Given<'d> {
    keys: Vec<(&'static RigKey, Entry<'d>)>,
    flow_law: Option<(bool, Entry<'d>)>,
    opening: Option<Entry<'d>>,
}

impl<'d> Given<'d> {
    /// Stores one key of a table of the rig.
    fn take(&mut self, rig: &mut Rig<f64>, table: &str, entry: Entry<'d>) -> Result<(), InputError> {
        match entry.name {
            FLOW_LAW if table == "valve" => {
                let iso = match entry.string()? {
                    "paper" => false,
                    "iso6358" => true,
                    other => {
                        let remedy = "write \"paper\" (linear in the pressure drop) or \"iso6358\"";
                        return Err(entry.error(format!("= \"{other}\" is not a flow law"), remedy));
                    }
                };
                self.flow_law = Some((iso, entry));
            }
            OPENING if table == "valve" => {
                rig.opening = OpeningTable::new(&mirrored(entry.points()?)).map_err(|must| {
                    let remedy = "write [[u_v, opening], …] about mid position, from -1 (fills B) to 1 (fills A); a table \
                                  that begins with [0, 0] counts for both directions";
                    entry.error(format!("must {must}"), remedy)
                })?;
                let ([left, right], valve) = (rig.opening.closed_v(), &mut rig.valve);
                (valve.dead_zone_left_v, valve.dead_zone_right_v) = (left, right);
                (valve.slope_left, valve.slope_right) = (1.0, 1.0);
                self.opening = Some(entry);
            }
            _ => {
                let key = rig_value(rig, table, &entry)?;
                self.keys.push((key, entry));
            }
        }
        Ok(())
    }

    fn entry(&self, path: &str) -> Option<&Entry<'d>> {
        self.keys.iter().find(|(key, _)| key.path == path).map(|(_, entry)| entry)
    }

    /// The line of a key, or of the one that stands for it and the other side.
    fn line_of(&self, path: &str) -> Option<u64> {
        if path == "valve.opening" {
            return self.opening.as_ref().map(|entry| entry.line);
        }
        let both = rig_key(path).and_then(RigKey::both_sides).map(|key| key.path);
        self.entry(path).or_else(|| self.entry(both?)).map(|entry| entry.line)
    }

    fn is_given(&self, key: &RigKey) -> bool {
        self.entry(key.path).is_some()
    }

    /// Refuses what is stated twice, what belongs to another law, and what is missing.
    fn fit_together(&self, file: &str) -> Result<(), InputError> {
        for both in BOTH_SIDES {
            let Some(entry) = self.entry(both.path) else { continue };
            if let Some(side) = both.sides.iter().map(|side| side.key()).find(|side| self.is_given(side)) {
                let remedy = format!("keep `{}` for both sides, or give each its own key", both.name);
                return Err(entry.error(format!("and `{}` state the same", side.path), remedy));
            }
        }
        let iso = matches!(self.flow_law, Some((true, _)));
        for (key, entry) in &self.keys {
            let of_iso = OF_ISO_6358.iter().any(|begin| key.path.starts_with(begin));
            if of_iso && !iso {
                return Err(entry.error(
                    "belongs to the flow law of ISO 6358",
                    "write `flow_law = \"iso6358\"` under [valve], without the two coefficients, or remove it",
                ));
            }
            if iso && OF_THE_PAPER.contains(&key.path) {
                return Err(entry.error(
                    "belongs to the paper's linear flow law",
                    "remove it beside `flow_law = \"iso6358\"`; the conductances take its place",
                ));
            }
            if self.opening.is_none() && key.path == Place::opening_smoothness.key().path {
                return Err(entry.error(
                    "says how a table of the opening runs between its points, and there is none",
                    "state `opening` under [valve], or remove it",
                ));
            }
            if self.opening.is_some() && OPENING_REPLACES.contains(&key.path) {
                return Err(entry.error(
                    "and `valve.opening` contradict each other",
                    "remove it: the table says where the valve opens and how far",
                ));
            }
        }
        for key in RIG_KEYS {
            let of_iso = OF_ISO_6358.iter().any(|begin| key.path.starts_with(begin));
            let required = if of_iso {
                iso
            } else if OF_THE_PAPER.contains(&key.path) {
                !iso
            } else if OPENING_REPLACES.contains(&key.path) {
                self.opening.is_none()
            } else {
                !key.limits.optional
            };
            let both = key.both_sides();
            if !required || self.is_given(key) || both.is_some_and(|both| self.is_given(both)) {
                continue;
            }
            // Unless the other side has a key of its own, that of both is what is missing.
            let other = |both: &&RigKey| !both.sides.iter().any(|side| self.is_given(side.key()));
            let missing = both.filter(other).unwrap_or(key);
            let of = |value: f64, whose: &str| {
                format!("add it under [{}], e.g. `{} = {value:?}` ({whose})", missing.table, missing.name)
            };
            let remedy = match missing.limits.unit {
                "m3/(s Pa)" => of(2.4e-8, "2.4 l/(s bar)"),
                _ if of_iso => of(0.3, "typical of spool valves"),
                _ => of(missing.get(&Rig::<f64>::paper_a()), "case (a) of the paper"),
            };
            return Err(InputError::new(file, format!("`{}` is missing", missing.path), remedy));
        }
        Ok(())
    }
}

/// A table that begins at mid position with no opening, as catalogues draw it, for both directions.
fn mirrored(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    match points.first() {
        Some([command, opening]) if *command >= 0.0 && *opening == 0.0 => {
            let other = points.iter().rev().filter(|[command, _]| *command > 0.0).map(|[u, opening]| [-u, -opening]);
            other.chain(points.iter().copied()).collect()
        }
        _ => points,
    }
}

/// Stores one numeric key and says which it was.
fn rig_value(rig: &mut Rig<f64>, table: &str, entry: &Entry<'_>) -> Result<&'static RigKey, InputError> {
    let Some(key) = all_keys().find(|key| key.table == table && key.name == entry.name) else {
        if let Some(key) = rig_key(entry.name) {
            return Err(entry.error("stands in the wrong table", format!("move it under [{}]", key.table)));
        }
        let more = if table == "valve" { &[FLOW_LAW, OPENING][..] } else { &[] };
        let known = all_keys().filter(|key| key.table == table).map(|key| key.name);
        return Err(entry.unknown(known.chain(more.iter().copied())));
    };
    let value = entry.number()?;
    let limits = key.limits;
    if !(limits.low..=limits.high).contains(&value) {
        let problem = format!("= {} is not plausible: expected {limits}", Short(value));
        let remedy = if limits.unit.is_empty() {
            "check the value".to_string()
        } else {
            format!("check sign and unit, the file wants {}", limits.unit)
        };
        return Err(entry.error(problem, remedy));
    }
    key.set(rig, value);
    Ok(key)
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
        let problem = format!("= [{}, {}] is no range", Short(low), Short(high));
        Err(entry.error(problem, "write the lower end first: [low, high]"))
    }
}

fn tolerance(table: &Entry<'_>) -> Result<Tolerance, InputError> {
    let mut tolerance = Tolerance::default();
    for entry in table.table()? {
        if entry.name == "default" {
            tolerance.default = relative(&entry)?;
        } else if entry.name == "effects" {
            tolerances_of_effects(&entry, &mut tolerance)?;
        } else if is_table(entry.name) {
            // `load.mass_kg = 0.005` is a table `load` to TOML.
            for inner in entry.table()? {
                let value = relative(&inner)?;
                if !tolerance.set(&format!("{}.{}", entry.name, inner.name), value) {
                    return Err(inner.unknown(all_keys().filter(|key| key.table == entry.name).map(|key| key.name)));
                }
            }
        } else {
            let value = relative(&entry)?;
            if !tolerance.set(entry.name, value) {
                if all_keys().any(|key| key.name == entry.name) {
                    return Err(entry.error("is the name of several keys", "name its table, too: `hose_a.length_m`"));
                }
                return Err(entry.unknown(all_keys().map(|key| key.name).chain(["default"])));
            }
        }
    }
    Ok(tolerance)
}

/// `effects.valve-lag.time_constant_s = 0.3` in `[tolerance]`.
fn tolerances_of_effects(table: &Entry<'_>, tolerance: &mut Tolerance) -> Result<(), InputError> {
    for entry in table.table()? {
        let Some(effect) = Effect::from_id(entry.name) else {
            return Err(entry.unknown(Effect::ALL.map(Effect::id)));
        };
        let parameters = effect.info().parameters;
        for parameter in entry.table()? {
            let Some(index) = parameters.iter().position(|info| info.name == parameter.name) else {
                return Err(parameter.unknown(parameters.iter().map(|info| info.name)));
            };
            tolerance.set_effect(effect, index, relative(&parameter)?);
        }
    }
    Ok(())
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
                let [value, min, max] = [value, info.min, info.max].map(Short);
                let problem = format!("= {value} must lie from {min} to {max}");
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
        let problem = format!("= {} must be a relative standard error from 0 to below 1", Short(value));
        Err(entry.error(problem, "write 2 % as 0.02, and 0 for exact"))
    }
}
