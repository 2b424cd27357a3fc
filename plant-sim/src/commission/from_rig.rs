//! What a rig file says about the board's parameters: converters, dead zone and limits of the valve, and the rig's own numbers.
//! What it does not say (gain, monitor, times …) stays as it is on the board.

use super::{Change, out_of_range};
use board_link::{Parameter, Source};
use control::{Key, Parameters};
use firmware_core::Settings;
use monitor::MonitorParameters;
use parameter_table::End;
use plant_model::effects::Effect;
use plant_model::effects::identification::StandsFor;
use plant_model::{ParameterError, Plant, Rig};
use rig_files::{BOTH_SIDES, RigFile, rig_key};

/// Effects that are a sensor's own.
const OF_SENSORS: [Effect; 3] = [Effect::PositionScale, Effect::PressureAOffset, Effect::PressureBOffset];

/// Parameters that follow from a rig file.
#[derive(Clone, Debug, PartialEq)]
pub struct FromRig {
    /// The parameters with their values.
    pub changes: Vec<Change>,
    /// What the file says and the board has no parameter for, as sentences.
    pub notes: Vec<String>,
}

/// The number that a parameter has in the desktop's tables. `None`: it is the board's alone.
#[must_use]
pub fn number(parameter: Parameter, law: &Parameters, allowed: &MonitorParameters, rig: &Rig<f32>) -> Option<f32> {
    Some(match parameter.source() {
        // Absent means the range of the position; the board always has both ends.
        Source::Control(Key::setpoint_range_m, end) => {
            let (low, high) = law.setpoint_range_m.unwrap_or(position_range(law)).into();
            if end == End::First { low } else { high }
        }
        Source::Control(key, end) => law.get(key).number(end),
        Source::Monitor(key) => allowed.get(key).number(End::First),
        Source::Rig(place) => place.key().get(rig),
        Source::Board(_) => return None,
    })
}

/// Both ends of the position's range as calibrated, m.
fn position_range(law: &Parameters) -> [f32; 2] {
    let [position, ..] = law.calibrated_ranges();
    position.map(|end| end as f32)
}

/// What `rig` says, for a board that has `present`.
///
/// # Errors
/// A sentence: the rig is not possible, or a value is outside the board's range.
pub fn from_rig(rig: &RigFile, present: &Settings) -> Result<FromRig, String> {
    let (plain, mut notes) = without_effects(rig).map_err(|error| error.to_string())?;
    let mut law = rig_files::controller::parameters(&plain);
    // A setpoint range that is as wide as the sensor's stays so.
    let now = present.control_parameters();
    law.setpoint_range_m = now.setpoint_range_m.filter(|range| *range != position_range(&now));
    // The calibration is the board's, and decides where the range ends.
    (law.position_offset_m, law.position_gain) = (now.position_offset_m, now.position_gain);
    let model = plain.rig.convert();
    let mut changes = Vec::new();
    for parameter in Parameter::ALL {
        let said = match parameter.source() {
            Source::Control(key, _) => key == Key::setpoint_range_m || rig_files::controller::FROM_RIG.contains(&key),
            Source::Rig(_) => true,
            Source::Monitor(_) | Source::Board(_) => false,
        };
        let value = number(parameter, &law, &MonitorParameters::default(), &model);
        if let Some(value) = value.filter(|_| said) {
            parameter.check(value).map_err(|_| out_of_range(parameter, value))?;
            changes.push((parameter, value));
        }
    }
    notes.extend(simplified(&plain.rig));
    Ok(FromRig { changes, notes })
}

/// The rig with those effects in its numbers that stand for a number of it, as a diagnosis finds them; the others are told.
///
/// # Errors
/// The plant refuses the rig.
pub(crate) fn without_effects(rig: &RigFile) -> Result<(RigFile, Vec<String>), ParameterError> {
    let mut plain = rig.clone();
    let mut notes = Vec::new();
    let plant = Plant::new(&rig.rig, &rig.effects)?;
    let dead_zone = plant.dead_zone();
    (plain.rig.valve.dead_zone_right_v, plain.rig.valve.dead_zone_left_v) = (dead_zone.right_v, dead_zone.left_v);
    for (effect, values) in rig.effects.iter() {
        let first = values.first().copied().unwrap_or_default();
        let mut edit = |path: &str, new: &dyn Fn(f64) -> f64| {
            if let Some(key) = rig_key(path) {
                let old: f64 = key.get(&plain.rig);
                if !(key.limits.optional && old == 0.0) {
                    key.set(&mut plain.rig, new(old));
                }
            }
        };
        match effect.identification().stands_for {
            StandsFor::ValuesOf(keys) => keys.iter().zip(values).for_each(|(key, value)| edit(key, &|_| *value)),
            StandsFor::FactorOn(keys) => keys.iter().for_each(|key| edit(key, &|old| first * old)),
            StandsFor::AddedTo(keys) => keys.iter().for_each(|key| edit(key, &|old| old + first)),
            // The positioning law is told of it.
            StandsFor::Nothing if effect == Effect::ValveLag => {}
            // What a log shows of a sensor is left over from the calibration it was recorded with: applied twice it would be wrong.
            StandsFor::Nothing if OF_SENSORS.contains(&effect) => {
                notes.push(format!("`{}` is corrected on the board by `calibrate`, not by this file", effect.id()));
            }
            StandsFor::Nothing => {
                notes.push(format!("the board's model has no effect `{}`: it goes without", effect.id()))
            }
        }
    }
    // A static friction that was stated may now lie below the Coulomb friction found; the model takes the larger one.
    let friction = &mut plain.rig.friction;
    friction.static_n = friction.static_n.max(friction.coulomb_n);
    for effect in Effect::ALL.into_iter().filter(|effect| *effect != Effect::ValveLag) {
        plain.effects.remove(effect);
    }
    Ok((plain, notes))
}

/// What the board's model takes more simply than the rig file says it.
fn simplified(rig: &Rig<f64>) -> Vec<String> {
    let mut notes = Vec::new();
    for both in BOTH_SIDES {
        let sides: Vec<f64> = both.sides.iter().map(|side| side.key().get(rig)).collect();
        if sides.windows(2).any(|pair| pair[0] != pair[1]) {
            let mean: f64 = both.get(rig);
            notes.push(format!(
                "the sides differ in `{}`: the board takes their mean, {mean:.4e} {}",
                both.path, both.limits.unit
            ));
        }
    }
    if !rig.opening.points().is_empty() {
        notes.push("the board has no table `valve.opening`: it takes its dead zone, and a straight line beyond".into());
    }
    notes
}
