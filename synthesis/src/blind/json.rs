//! Reads `diagnosis.json`, so that any program that writes one can be scored.

use super::score::{Answer, Estimate, Holdout, Named};
use rig_files::Verdict;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A `diagnosis.json` that is not one: where, and what was expected there.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("diagnosis.json: {0}")]
pub struct JsonError(String);

/// What is scored of the format in `docs/formats.md`; other keys do not matter here.
#[derive(Deserialize)]
struct Diagnosis {
    verdict: String,
    causes: Vec<Cause>,
    calibration: Vec<Calibration>,
    /// Absent or null where the log allowed no prediction.
    gain: Option<Gain>,
}

#[derive(Deserialize)]
struct Cause {
    id: String,
    parameters: Vec<Parameter>,
    ties: Vec<String>,
}

#[derive(Deserialize)]
struct Parameter {
    name: String,
    value: f64,
    std_error: Option<f64>,
}

#[derive(Deserialize)]
struct Calibration {
    name: String,
    nominal: f64,
    value: f64,
}

#[derive(Default, Deserialize)]
struct Gain {
    #[serde(default)]
    holdout: BTreeMap<String, BTreeMap<String, Option<f64>>>,
}

impl Answer {
    /// Reads a `diagnosis.json`.
    ///
    /// # Errors
    /// What is missing or of another kind than the format says.
    pub fn from_json(json: &str) -> Result<Self, JsonError> {
        let diagnosis: Diagnosis = serde_json::from_str(json).map_err(|error| JsonError(error.to_string()))?;
        let verdict = Verdict::from_word(&diagnosis.verdict).ok_or_else(|| {
            JsonError("`verdict` must be no-gap, explained, partly-explained or unexplained".to_string())
        })?;
        let calibration = diagnosis
            .calibration
            .into_iter()
            .map(|entry| (entry.name, if entry.nominal == 0.0 { 1.0 } else { entry.value / entry.nominal }))
            .collect();
        let gain = diagnosis.gain.unwrap_or_default();
        let errors = |kind: &str, channel: &str| *gain.holdout.get(kind)?.get(channel)?;
        let channels = ["y_m", "p_a_pa", "p_b_pa"].into_iter().filter_map(|channel| {
            // A channel that was not measured is null or absent.
            Some(Holdout {
                channel: channel.to_string(),
                baseline: errors("baseline_rmse", channel)?,
                extended: errors("extended_rmse", channel)?,
                noise_floor: errors("noise_floor", channel)?,
            })
        });
        let holdout = channels.collect();
        Ok(Self { verdict, causes: diagnosis.causes.into_iter().map(named).collect(), calibration, holdout })
    }
}

fn named(cause: Cause) -> Named {
    let parameters = cause.parameters.into_iter().map(|parameter| Estimate {
        name: parameter.name,
        value: parameter.value,
        // Without a standard error the value claims to be exact, and is scored so.
        std_error: parameter.std_error.unwrap_or(0.0),
    });
    Named { id: cause.id, parameters: parameters.collect(), ties: cause.ties }
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
    fn a_gain_that_was_not_measured_is_no_failure() {
        let (before, rest) = EXAMPLE.split_once("\"gain\"").expect("a gain");
        let (_, after) = rest.split_once("\"horizon_s\": 0.2}").expect("its end");
        let answer = Answer::from_json(&format!("{before}\"gain\": null{after}")).expect("a diagnosis");
        assert!(answer.holdout.is_empty() && answer.causes.len() == 1);
    }

    #[test]
    fn what_does_not_fit_is_named() {
        for (from, to, says) in [
            ("explained", "solved", "must be no-gap"),
            (
                "\"ties\": [\"leak-chamber-a\"]",
                "\"ties\": 3",
                "invalid type: integer `3`, expected a sequence at line 5",
            ),
            ("2.0e-10", "\"much\"", "invalid type: string \"much\", expected f64 at line 4"),
            ("\"calibration\"", "\"calibrated\"", "missing field `calibration`"),
            ("{", "", "expected struct Diagnosis at line 2"),
        ] {
            let error = Answer::from_json(&EXAMPLE.replacen(from, to, 1)).expect_err(says);
            assert!(error.to_string().contains(says), "{error}");
        }
    }
}
