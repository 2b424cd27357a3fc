//! The catalogue is complete and consistent, and `docs/effects.md` says the same.

use plant_model::effects::MAX_PARAMETERS;
use plant_model::effects::identification::{Bounds, Image, ImageContext, Likeness, LogQuality, StartContext};
use plant_model::{Effect, Effects, Plant, Rig, Simulator};
use std::fmt::Write;

/// The page, generated.
fn page() -> String {
    let mut page = String::from(
        "# Effects: what real rigs add to the paper's model\n\n\
         Each effect is a table `[effects.ID]` in the rig file, lives in a file of its own in `plant-model/src/effects/`\n\
         and has a neutral setting that gives back the paper's model bit for bit. Effects compose. `n`: the rig's own\n\
         value. [How to add one](adding-an-effect.md). `cargo test -p plant-model --test equations effect_catalogue` fails if this page and the code differ;\n\
         `UPDATE_DOCS=1` before the command rewrites it.\n",
    );
    for effect in Effect::ALL {
        let info = effect.info();
        let _ = write!(page, "\n## `{}`: {}\n\n", info.id, info.title);
        let _ = write!(
            page,
            "- Equation: `{}`\n- Signature: {}\n- Source: {}\n",
            info.equation, info.signature, info.source
        );
        for (other, confusion) in effect.confused_with() {
            let how = match confusion.kind {
                Likeness::Structural => "the same under another name, no log tells them apart",
                Likeness::Image(Image { beside: None, .. }) => "does nearly the same at another value",
                Likeness::Image(Image { beside: Some(_), .. }) => "does nearly the same beside choked flow",
                Likeness::Near => "hard to tell apart",
            };
            let _ = writeln!(page, "- Like `{other}`: {how}. {}", effect.experiment_against(other));
        }
        let _ = write!(
            page,
            "\n| parameter | meaning | from | to | neutral | typical |\n| --- | --- | --- | --- | --- | --- |\n"
        );
        for (place, parameter) in info.parameters.iter().enumerate() {
            let neutral = neutral_in_words(effect, place);
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

/// A rig that shares no value with the paper's case (a) on which a neutral setting depends.
fn another_rig() -> Rig<f64> {
    let mut rig = Rig::<f64>::paper_a();
    (rig.valve.dead_zone_right_v, rig.valve.dead_zone_left_v) = (0.3, -0.25);
    rig.gas.heat_capacity_ratio *= 1.1;
    rig.load.mass_kg *= 1.1;
    rig.friction.static_n *= 1.1;
    rig.friction.viscous_n_s_per_m *= 1.1;
    rig
}

/// Whether the neutral setting lies outside the bounds: then the effect is there or not, nothing between.
fn is_all_or_nothing(effect: Effect) -> bool {
    let neutral = effect.neutral(&Rig::<f64>::paper_a());
    effect.info().parameters.iter().zip(neutral).any(|(p, value)| !(p.min..=p.max).contains(&value))
}

fn neutral_in_words(effect: Effect, place: usize) -> String {
    let (parameter, neutral) = (&effect.info().parameters[place], effect.neutral(&Rig::<f64>::paper_a())[place]);
    if neutral != effect.neutral(&another_rig())[place] {
        "n".to_owned()
    } else if !(parameter.min..=parameter.max).contains(&neutral) {
        "effect absent".to_owned()
    } else if is_all_or_nothing(effect) || effect.identification().shape_only.contains(&place) {
        "any".to_owned()
    } else {
        number(neutral)
    }
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
        for ((parameter, neutral), most) in info.parameters.iter().zip(effect.neutral(&rig)).zip(effect.most(&rig)) {
            assert!(parameter.min < parameter.max, "{}", parameter.key);
            assert!((parameter.min..=parameter.max).contains(&parameter.typical), "{}", parameter.key);
            assert!((parameter.typical..=parameter.max).contains(&most), "{}: {most}", parameter.key);
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
    rig.valve = another_rig().valve;
    for active in Effect::ALL {
        let typical: Vec<f64> = active.info().parameters.iter().map(|p| p.typical).collect();
        let alone = Effects::none().with(active, &typical);
        let mut all = alone;
        for effect in Effect::ALL {
            if effect != active && !is_all_or_nothing(effect) {
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

const WAVELENGTHS_M: [f64; 2] = [0.05, 0.11];

/// What starts are computed from on the paper's case (a).
fn start_context(effect: Effect) -> StartContext<'static> {
    let rig = Rig::<f64>::paper_a();
    let neutral = effect.neutral(&rig);
    let mut bounds = [Bounds { min: f64::NEG_INFINITY, max: f64::INFINITY }; MAX_PARAMETERS];
    for (bound, parameter) in bounds.iter_mut().zip(effect.info().parameters) {
        *bound = Bounds { min: parameter.min, max: parameter.max };
    }
    StartContext { neutral, scales: effect.scales(&rig, &neutral), bounds, wavelengths_m: &WAVELENGTHS_M }
}

#[test]
fn scales_are_positive_and_the_least_deviation_lies_below_them() {
    let rig = Rig::<f64>::paper_a();
    let log = LogQuality { interval_s: 1.0e-3, force_noise_n: 0.3 };
    for effect in Effect::ALL {
        let StartContext { neutral, scales, .. } = start_context(effect);
        let negligible = effect.negligible(&rig, &neutral, &scales, &log);
        for place in 0..effect.parameter_count() {
            let (scale, least) = (scales[place], negligible[place]);
            assert!(scale.is_finite() && scale > 0.0, "{effect}, parameter {place}: scale {scale}");
            assert!((0.0..scale).contains(&least), "{effect}, parameter {place}: {least} of {scale}");
        }
    }
}

#[test]
fn fits_begin_within_bounds_at_several_values_or_at_a_ripple_that_was_found() {
    for effect in Effect::ALL {
        let context = start_context(effect);
        let mut count = 0;
        effect.starts(&context, &mut |values| {
            count += 1;
            assert!((1..=effect.parameter_count()).contains(&values.len()), "{effect}: {values:?}");
            for (value, parameter) in values.iter().zip(effect.info().parameters) {
                assert!((parameter.min..=parameter.max).contains(value), "{}: {value}", parameter.key);
            }
        });
        assert!(count >= 2 && count >= effect.identification().starts_fitted, "{effect}: {count} starts");
    }
    let without_ripple = StartContext { wavelengths_m: &[], ..start_context(Effect::FrictionPosition) };
    let mut count = 0;
    Effect::FrictionPosition.starts(&without_ripple, &mut |_| count += 1);
    assert_eq!(count, 1);
}

#[test]
fn what_must_be_visible_lies_within_bounds_and_is_not_neutral() {
    let rig = Rig::<f64>::paper_a();
    for effect in Effect::ALL {
        let StartContext { neutral, scales, .. } = start_context(effect);
        let visible = effect.visible(&neutral, &scales);
        assert_ne!(visible[0], neutral[0], "{effect}");
        let effects = Effects::none().with(effect, &visible[..effect.parameter_count()]);
        assert!(Plant::new(&rig, &effects).is_ok(), "{effect}: {visible:?}");
    }
}

#[test]
fn a_confusion_is_stated_in_one_file_and_found_from_both() {
    for one in Effect::ALL {
        for confusion in one.identification().confused_with {
            let other = confusion.with;
            assert_ne!(one, other);
            assert!(
                other.identification().confused_with.iter().all(|back| back.with != one),
                "{one} and {other} state it twice"
            );
            assert!(other.confused_with().any(|(found, _)| found == one));
            assert_eq!(one.experiment_against(other), other.experiment_against(one));
            let alike = one.identification().balances.bits() & other.identification().balances.bits();
            assert_ne!(alike, 0, "{one} and {other} act on no common balance");
        }
    }
    let tied: Vec<Effect> = Effect::FrictionAsymmetry.structural_ties().collect();
    assert_eq!(tied, [Effect::ConstantForce]);
}

#[test]
fn an_image_of_an_image_is_the_effect_itself() {
    let rig = Rig::<f64>::paper_a();
    let everything = Effect::ALL;
    let pairs = Effect::ALL.into_iter().flat_map(|one| one.images_among(&everything).map(move |other| (one, other)));
    for (one, other) in pairs {
        let (neutral, image_neutral) = (one.neutral(&rig)[0], other.neutral(&rig)[0]);
        let away = 0.4 * start_context(one).scales[0];
        let there = ImageContext { rig: &rig, away, neutral, image_neutral, gauge_sum_pa: Some(4.0e5) };
        let image = one.as_image(other, &there).unwrap();
        let back =
            ImageContext { away: image.value - image_neutral, neutral: image_neutral, image_neutral: neutral, ..there };
        let again = other.as_image(one, &back).unwrap();
        assert!((again.value - (neutral + away)).abs() < 1e-9 * (1.0 + away.abs()), "{one} as {other}: {again:?}");
        if let Some((companion, place, _)) = image.companion {
            assert!(place < companion.parameter_count());
            assert!(!one.images_among(&[]).any(|image| image == other), "{one} as {other} needs {companion}");
        }
    }
    let blind = ImageContext { rig: &rig, away: 0.3, neutral: 1.0, image_neutral: 0.0, gauge_sum_pa: None };
    assert_eq!(Effect::CoulombFriction.as_image(Effect::FrictionPressure, &blind), None, "without both pressures");
}

#[test]
fn what_an_effect_stands_for_is_taken_over_and_given_back() {
    for effect in Effect::ALL {
        let stands_for = effect.identification().stands_for;
        let neutral = effect.neutral(&Rig::<f64>::paper_a())[0];
        let nominal = if !stands_for.inherits_tolerance_of().is_empty() { 8.0 } else { neutral };
        for key in stands_for.keys() {
            assert!(key.contains('.'), "{effect}: {key} is no path in the rig file");
            assert_eq!(stands_for.take_over(neutral, nominal, nominal), neutral, "{effect}: nothing to take over");
            assert_eq!(stands_for.give_back(neutral, nominal), nominal, "{effect}: nothing to give back");
        }
    }
}

#[test]
fn evidence_is_a_clause_and_pictures_show_balances_the_effect_acts_on() {
    for effect in Effect::ALL {
        let typical: Vec<f64> = effect.info().parameters.iter().map(|p| p.typical).collect();
        let evidence = effect.evidence(&typical).to_string();
        assert!(evidence.starts_with(char::is_uppercase) && !evidence.ends_with('.'), "{effect}: {evidence}");
        let identification = effect.identification();
        assert!(!identification.pictures.is_empty(), "{effect} has no picture");
        let shown = |picture: &_| {
            let &plant_model::effects::identification::Picture { of, note, .. } = picture;
            assert!(note.ends_with('.'), "{effect}: {note}");
            identification.balances.contains(of)
        };
        assert!(identification.pictures.iter().any(shown), "{effect}");
        for place in identification.parts.iter().copied().flatten().chain(identification.shape_only) {
            assert!(*place < effect.parameter_count(), "{effect}");
        }
    }
}

#[test]
fn every_file_of_the_folder_is_an_effect_of_the_catalogue() {
    let listed: Vec<String> = Effect::ALL.iter().map(|effect| effect.id().replace('-', "_")).collect();
    let shared = ["mod", "definition", "effect", "first_order", "identification", "list", "terms"];
    for entry in std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/src/effects")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        assert!(
            shared.contains(&&name[..]) || listed.contains(&name),
            "{} is in no line of `for_each_effect!`, or its identifier is not its file's name",
            path.display()
        );
    }
}
