//! Reads `diagnosis.json`, so that any program that writes one can be scored.

use super::score::{Answer, Estimate, Holdout, Named};
use rig_files::Verdict;
use serde_json::Value;

/// A `diagnosis.json` that is not one: where, and what was expected there.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("diagnosis.json: {place} {expected}")]
pub struct JsonError {
    place: String,
    expected: String,
}

fn wrong(place: impl Into<String>, expected: impl Into<String>) -> JsonError {
    JsonError { place: place.into(), expected: expected.into() }
}

fn list<'a>(value: &'a Value, key: &str) -> Result<&'a [Value], JsonError> {
    value[key].as_array().map(Vec::as_slice).ok_or_else(|| wrong(format!("`{key}`"), "must be a list"))
}

fn text<'a>(value: &'a Value, place: &str, key: &str) -> Result<&'a str, JsonError> {
    value[key].as_str().ok_or_else(|| wrong(format!("{place} `{key}`"), "must be a text"))
}

fn number(value: &Value, place: &str, key: &str) -> Result<f64, JsonError> {
    value[key].as_f64().ok_or_else(|| wrong(format!("{place} `{key}`"), "must be a number"))
}

impl Answer {
    /// Reads a `diagnosis.json`.
    ///
    /// # Errors
    /// What is missing or of another kind than the format says.
    pub fn from_json(json: &str) -> Result<Self, JsonError> {
        let root: Value =
            serde_json::from_str(json).map_err(|error| wrong("the text", format!("is no JSON: {error}")))?;
        let word = text(&root, "the top-level", "verdict")?;
        let verdict = Verdict::from_word(word)
            .ok_or_else(|| wrong("`verdict`", "must be no-gap, explained, partly-explained or unexplained"))?;
        let causes = list(&root, "causes")?.iter().map(named).collect::<Result<_, _>>()?;
        let calibration = list(&root, "calibration")?
            .iter()
            .map(|entry| {
                let name = text(entry, "a calibration's", "name")?.to_string();
                let nominal = number(entry, &name, "nominal")?;
                let value = number(entry, &name, "value")?;
                Ok((name, if nominal == 0.0 { 1.0 } else { value / nominal }))
            })
            .collect::<Result<_, _>>()?;
        let holdout = &root["gain"]["holdout"];
        let channels = ["y_m", "p_a_pa", "p_b_pa"].into_iter().filter_map(|channel| {
            // A channel that was not measured is null or absent.
            Some(Holdout {
                channel: channel.to_string(),
                baseline: holdout["baseline_rmse"][channel].as_f64()?,
                extended: holdout["extended_rmse"][channel].as_f64()?,
                noise_floor: holdout["noise_floor"][channel].as_f64()?,
            })
        });
        Ok(Self { verdict, causes, calibration, holdout: channels.collect() })
    }
}

fn named(cause: &Value) -> Result<Named, JsonError> {
    let id = text(cause, "a cause's", "id")?.to_string();
    let parameters = list(cause, "parameters")?
        .iter()
        .map(|parameter| {
            Ok(Estimate {
                name: text(parameter, "a parameter's", "name")?.to_string(),
                value: number(parameter, &id, "value")?,
                // Without a standard error the value claims to be exact, and is scored so.
                std_error: parameter["std_error"].as_f64().unwrap_or(0.0),
            })
        })
        .collect::<Result<_, _>>()?;
    let ties = list(cause, "ties")?
        .iter()
        .map(|tie| tie.as_str().map(str::to_string).ok_or_else(|| wrong("`ties`", "must hold texts")))
        .collect::<Result<_, _>>()?;
    Ok(Named { id, parameters, ties })
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXAMPLE: &str = r#"{
        "verdict": "explained",
        "causes": [{"id": "leak-cross-piston",
            "parameters": [{"name": "conductance_kg_per_s_pa", "value": 2.0e-10, "std_error": 1e-12}],
            "ties": ["leak-chamber-a"], "evidence": "the pressures keep drifting together"}],
        "calibration": [{"name": "valve.fill_coefficient_kg_per_s_pa", "nominal": 6.95e-9, "value": 7.02e-9, "std_error": 1e-11}],
        "gain": {"holdout": {"baseline_rmse": {"y_m": 0.2, "p_a_pa": 900.0, "p_b_pa": null},
                             "extended_rmse": {"y_m": 0.1, "p_a_pa": 610.0, "p_b_pa": null},
                             "noise_floor": {"y_m": 0.1, "p_a_pa": 600.0, "p_b_pa": null}}, "horizon_s": 0.2},
        "not_identifiable": [], "next_experiment": null }"#;

    #[test]
    fn the_documented_format_is_read() {
        let answer = Answer::from_json(EXAMPLE).expect("the example of the documentation");
        assert_eq!(answer.verdict, Verdict::Explained);
        assert_eq!(answer.causes[0].ties, ["leak-chamber-a"]);
        assert_eq!(answer.causes[0].parameters[0].std_error, 1e-12);
        assert_eq!(answer.holdout.len(), 2);
        assert!((answer.calibration[0].1 - 7.02 / 6.95).abs() < 1e-12);
    }

    #[test]
    fn what_does_not_fit_is_named() {
        for (from, to, says) in [
            ("explained", "solved", "must be no-gap"),
            ("\"ties\": [\"leak-chamber-a\"]", "\"ties\": 3", "`ties` must be a list"),
            ("2.0e-10", "\"much\"", "`value` must be a number"),
            ("{", "", "is no JSON"),
        ] {
            let error = Answer::from_json(&EXAMPLE.replacen(from, to, 1)).expect_err(says);
            assert!(error.to_string().contains(says), "{error}");
        }
    }
}
