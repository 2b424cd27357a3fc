//! `diagnosis.json`.

use diagnosis::{Diagnosis, Gain};
use serde_json::Value;

/// The diagnosis in the documented shape. Numbers that are not finite become `null`, and a gain that could not be
/// measured is an object full of `null`, so that a reader finds every documented key in every file.
///
/// # Errors
/// None in practice; serialisation of plain numbers and texts cannot fail.
pub fn to_json(diagnosis: &Diagnosis) -> Result<String, serde_json::Error> {
    // Not through `Value` alone: it would sort the keys, and verdict and causes are to be read first.
    let mut text = serde_json::to_string_pretty(diagnosis)?;
    if diagnosis.gain.is_none() {
        let empty = serde_json::to_value(Gain::default())?;
        let gain = serde_json::to_string_pretty(&without_horizon(empty))?.replace('\n', "\n  ");
        text = text.replacen("\n  \"gain\": null", &format!("\n  \"gain\": {gain}"), 1);
    }
    text.push('\n');
    Ok(text)
}

/// No prediction was made, so there is no horizon either.
fn without_horizon(mut gain: Value) -> Value {
    if let Some(horizon) = gain.get_mut("horizon_s") {
        *horizon = Value::Null;
    }
    gain
}
