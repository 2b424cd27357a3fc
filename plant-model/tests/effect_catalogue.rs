//! The catalogue is complete and consistent, and `docs/effects.md` says the same.

use plant_model::{Effect, Effects, Plant, Rig, Simulator};
use std::fmt::Write;

/// The page, generated.
fn page() -> String {
    let mut page = String::from(
        "# Effects: what real rigs add to the paper's model\n\n\
         Each effect is a table `[effects.ID]` in the rig file, lives in a file of its own in `plant-model/src/effects/`\n\
         and has a neutral setting that gives back the paper's model bit for bit. Effects compose. `n`: the rig's own\n\
         value. `cargo test -p plant-model --test effect_catalogue` fails if this page and the code differ;\n\
         `UPDATE_DOCS=1` before the command rewrites it.\n",
    );
    let rig = Rig::<f64>::paper_a();
    for effect in Effect::ALL {
        let info = effect.info();
        let _ = write!(page, "\n## `{}`: {}\n\n", info.id, info.title);
        let _ = write!(
            page,
            "- Equation: `{}`\n- Signature: {}\n- Source: {}\n\n",
            info.equation, info.signature, info.source
        );
        let _ = write!(
            page,
            "| parameter | meaning | from | to | neutral | typical |\n| --- | --- | --- | --- | --- | --- |\n"
        );
        for (parameter, neutral) in info.parameters.iter().zip(effect.neutral(&rig)) {
            let neutral = match (effect, parameter.name) {
                (Effect::ChokedFlow, "critical_ratio") => "effect absent".to_owned(),
                (Effect::ChokedFlow | Effect::SupplyDroop, _) | (Effect::FrictionPosition, "wavelength_m") => {
                    "any".to_owned()
                }
                (
                    Effect::ValveDeadZone
                    | Effect::HeatTransfer
                    | Effect::PayloadMass
                    | Effect::ViscousFriction
                    | Effect::StaticFriction,
                    _,
                ) => "n".to_owned(),
                _ => number(neutral),
            };
            let neutral = if effect == Effect::SupplyDroop && parameter.name == "droop_pa_s_per_kg" {
                "0".to_owned()
            } else {
                neutral
            };
            let _ = writeln!(
                page,
                "| `{}` | {} | {} | {} | {} | {} |",
                parameter.name,
                parameter.meaning,
                number(parameter.min),
                number(parameter.max),
                neutral,
                number(parameter.typical)
            );
        }
    }
    page
}

fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e4).contains(&value.abs()) { format!("{value}") } else { format!("{value:e}") }
}

#[test]
fn the_documentation_page_agrees_with_the_catalogue() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/effects.md");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, page()).unwrap();
    }
    let stored = std::fs::read_to_string(path).unwrap();
    assert!(stored == page(), "docs/effects.md is out of date: run this test with UPDATE_DOCS=1");
}

#[test]
fn every_entry_is_complete_and_its_typical_strength_is_within_bounds_and_not_neutral() {
    let rig = Rig::<f64>::paper_a();
    let mut ids = std::collections::HashSet::new();
    for effect in Effect::ALL {
        let info = effect.info();
        assert!(ids.insert(info.id), "{effect} appears twice");
        assert_eq!(Effect::from_id(info.id), Some(effect));
        for text in [info.title, info.equation, info.signature, info.source] {
            assert!(!text.is_empty(), "{effect} lacks a text");
        }
        let mut differs = false;
        for (parameter, neutral) in info.parameters.iter().zip(effect.neutral(&rig)) {
            assert!(parameter.min < parameter.max, "{}", parameter.key);
            assert!((parameter.min..=parameter.max).contains(&parameter.typical), "{}", parameter.key);
            assert_eq!(parameter.key, format!("effects.{}.{}", info.id, parameter.name));
            assert!(!parameter.meaning.is_empty());
            differs |= neutral != parameter.typical;
        }
        assert!(differs, "{effect}: the typical strength is the neutral one");
    }
}

#[test]
fn values_beyond_the_bounds_are_refused_by_name() {
    let rig = Rig::<f64>::paper_a();
    for effect in Effect::ALL {
        for (i, parameter) in effect.info().parameters.iter().enumerate() {
            for bad in [parameter.max * 1.5 + 1.0, parameter.min - 1.0, f64::NAN, f64::INFINITY] {
                let mut values: Vec<f64> = effect.info().parameters.iter().map(|p| p.typical).collect();
                values[i] = bad;
                let error = Plant::new(&rig, &Effects::none().with(effect, &values)).unwrap_err();
                assert_eq!(error.key, parameter.key);
            }
        }
    }
}

#[test]
fn a_neutral_effect_beside_an_active_one_changes_no_bit() {
    let mut rig = Rig::<f64>::paper_c();
    (rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v) = (0.3, -0.25);
    for active in Effect::ALL {
        let typical: Vec<f64> = active.info().parameters.iter().map(|p| p.typical).collect();
        let alone = Effects::none().with(active, &typical);
        let mut all = alone;
        for effect in Effect::ALL {
            if effect != active && effect != Effect::ChokedFlow {
                all.set(effect, &effect.neutral(&rig));
            }
        }
        if active == Effect::CoulombFriction {
            // Sets F_s absolutely, after the scale: neutral with respect to the rig, not to the scaled value.
            all.remove(Effect::StaticFriction);
        }
        let mut few = Simulator::<f64>::new(&rig, &alone).unwrap();
        let mut many = Simulator::<f64>::new(&rig, &all).unwrap();
        for k in 0..400 {
            let u = 1.5 * (0.02 * f64::from(k)).sin();
            few.advance(u, 1.0e-3);
            many.advance(u, 1.0e-3);
            assert_eq!(few.state(), many.state(), "{active} with neutral others, tick {k}");
            assert_eq!(few.measure(), many.measure(), "{active} with neutral others, tick {k}");
        }
    }
}
