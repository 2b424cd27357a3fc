//! Writing a rig file so that it reads back to the same values, bit for bit.

use crate::rig_file::{OPENING_REPLACES, RigFile};
use plant_model::rig_key;
use std::fmt::Write as _;

impl RigFile {
    /// The rig as TOML; [`RigFile::parse`] gives the same rig back.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        // Writing to a String cannot fail.
        let _ = self.write_toml(&mut text);
        text
    }

    fn write_toml(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "name = {}", toml::Value::from(self.name.as_str()))?;
        let mut table = "";
        let tabulated = !self.rig.opening.is_empty();
        for key in self.rig.stated_keys() {
            if tabulated && OPENING_REPLACES.contains(&key.path) {
                continue;
            }
            if key.table != table {
                table = key.table;
                writeln!(text, "\n[{table}]")?;
                if table == "valve" {
                    self.write_law_and_opening(text)?;
                }
            }
            writeln!(text, "{} = {}", key.name, number(key.get(&self.rig)))?;
        }
        let io = &self.io;
        let range = |[low, high]: [f64; 2]| format!("[{}, {}]", number(low), number(high));
        writeln!(text, "\n[io]")?;
        writeln!(text, "position_range_m = {}", range(io.position_range_m))?;
        writeln!(text, "pressure_range_pa = {}", range(io.pressure_range_pa))?;
        writeln!(text, "adc_bits = {}", io.adc_bits)?;
        writeln!(text, "valve_range_v = {}", range(io.valve_range_v))?;
        writeln!(text, "dac_bits = {}", io.dac_bits)?;
        writeln!(text, "tick_hz = {}", io.tick_hz)?;
        writeln!(text, "\n[tolerance]")?;
        writeln!(text, "default = {}", number(self.tolerance.default))?;
        for (key, value) in self.tolerance.entries() {
            // A plain name that several tables have says too little.
            let name = if rig_key(key.name).is_some() { key.name } else { key.path };
            writeln!(text, "{name} = {}", number(value))?;
        }
        for (effect, parameter, value) in self.tolerance.effect_entries(&self.effects) {
            writeln!(text, "{} = {}", effect.info().parameters[parameter].key, number(value))?;
        }
        for (effect, values) in self.effects.iter() {
            writeln!(text, "\n[effects.{}]", effect.id())?;
            for (info, value) in effect.info().parameters.iter().zip(values) {
                writeln!(text, "{} = {}", info.name, number(*value))?;
            }
        }
        Ok(())
    }

    fn write_law_and_opening(&self, text: &mut String) -> std::fmt::Result {
        if self.rig.follows_iso6358() {
            writeln!(text, "flow_law = \"iso6358\"")?;
        }
        if self.rig.opening.is_empty() {
            return Ok(());
        }
        let valve = &self.rig.valve;
        let table = self.rig.opening.moved_to(valve.dead_zone_left_v, valve.dead_zone_right_v);
        writeln!(text, "opening = [")?;
        for [command, opening] in table.points() {
            writeln!(text, "    [{}, {}],", number(*command), number(*opening))?;
        }
        writeln!(text, "]")
    }
}

/// The shortest decimal that reads back to the same bits, as a TOML float.
pub(crate) fn number(value: f64) -> String {
    format!("{value:?}")
}
