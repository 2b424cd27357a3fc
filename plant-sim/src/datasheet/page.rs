//! The rig file with its comments.

use super::Origin;
use plant_model::{Effects, Simulator};
use rig_files::{RigFile, RigKey, rig_key};

/// The motion on which a tolerance is weighed: the valve at 40 % to either side in turn, a second long.
const MOTION_S: f64 = 1.0;
const MOTION_V: f64 = 2.0;
const TURN_S: f64 = 0.25;
/// Below this part of the stroke, one tolerance hardly matters.
const LITTLE: f64 = 1.0e-3;

/// The rig file as text, every number with its origin, its tolerance and what one tolerance of it does to a motion;
/// `header` are lines of comment for the top.
#[must_use]
pub fn commented(file: &RigFile, origins: &[Origin], header: &[String]) -> String {
    let mut text: String = header.iter().map(|line| format!("# {line}\n")).collect();
    if !header.is_empty() {
        text.push_str(
            "#\n# After each number: its origin; how well it is known (one standard error); by how much that moves the piston\n\
             # in a second of open-loop motion, the valve at 40 % to either side in turn.\n",
        );
    }
    let nominal = motion(file);
    let mut table = String::new();
    for line in file.to_toml().lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            table = name.to_string();
        }
        let key = line.split_once(" = ").map(|(key, _)| format!("{table}.{key}"));
        let remark = key.and_then(|path| remark(file, origins, &path, &nominal));
        match remark {
            Some(remark) if line.len() < 48 => text += &format!("{line:<48}  # {remark}\n"),
            Some(remark) => text += &format!("{line}  # {remark}\n"),
            None => {
                text.push_str(line);
                text.push('\n');
            }
        }
    }
    text
}

fn remark(file: &RigFile, origins: &[Origin], path: &str, nominal: &[f64]) -> Option<String> {
    let fixed = match path {
        "io.position_range_m" => "the sensor's ends, from mid-stroke, as given",
        "io.pressure_range_pa" => "the sensors' ends, absolute, as given",
        "io.adc_bits" => "what the controller receives",
        "io.valve_range_v" => "about mid position",
        "tolerance.default" => "for keys that are not named below",
        _ => "",
    };
    if !fixed.is_empty() {
        return Some(fixed.to_string());
    }
    let origin = origins.iter().find(|origin| origin.path == path)?;
    let Some(tolerance) = origin.tolerance else { return Some(origin.words.clone()) };
    let mut words = format!("{}; ±{} %", origin.words, percent(tolerance));
    if let Some(moved) = rig_key(path).and_then(|key| moved_m(file, key, tolerance, nominal)) {
        let stroke = file.rig.cylinder.stroke_m;
        words += &if moved < LITTLE * stroke {
            "; hardly matters".to_string()
        } else {
            format!("; moves the piston by {:.1} mm", moved * 1.0e3)
        };
    }
    Some(words)
}

fn percent(part: f64) -> f64 {
    (part * 1.0e4).round() / 100.0
}

/// Largest distance between two motions, if a key is one tolerance larger; `None` if the rig cannot have that.
fn moved_m(file: &RigFile, key: &RigKey, tolerance: f64, nominal: &[f64]) -> Option<f64> {
    let mut changed = file.clone();
    key.set(&mut changed.rig, key.get(&file.rig) * (1.0 + tolerance));
    changed.rig.validate().ok()?;
    let other = motion(&changed);
    nominal.iter().zip(&other).map(|(one, other)| (one - other).abs()).reduce(f64::max)
}

/// Positions by millisecond, m; empty if the plant refuses the rig.
fn motion(file: &RigFile) -> Vec<f64> {
    let Ok(mut simulator) = Simulator::<f64>::new(&file.rig, &Effects::none()) else { return Vec::new() };
    let ticks = (MOTION_S * 1.0e3) as u32;
    (0..ticks)
        .map(|tick| {
            let turns = (f64::from(tick) * 1.0e-3 / TURN_S) as u32;
            simulator.advance(if turns.is_multiple_of(2) { MOTION_V } else { -MOTION_V }, 1.0e-3);
            simulator.state().y_m
        })
        .collect()
}
