use super::score::{Answer, Estimate, Holdout, Named, Outcome, score};
use crate::{Cause, Foreign};
use plant_model::Effect;
use rig_files::Verdict;

fn hidden(effects: &[Effect]) -> Vec<Cause> {
    effects.iter().map(|effect| Cause::Catalogue(*effect, [0.3, 0.1, 0.2])).collect()
}

fn named(id: &str, ties: &[&str]) -> Named {
    let parameters = vec![Estimate { name: "half_width_v".into(), value: 0.31, std_error: 0.01 }];
    Named { id: id.into(), parameters, ties: ties.iter().map(|tie| (*tie).to_string()).collect() }
}

fn answer(verdict: Verdict, causes: Vec<Named>) -> Answer {
    Answer { causes, ..Answer::silent(verdict) }
}

fn outcome(effects: &[Effect], causes: Vec<Named>) -> Outcome {
    score(&hidden(effects), &answer(Verdict::Explained, causes)).outcome
}

#[test]
fn the_hidden_cause_alone_is_exact_with_or_without_declared_ties() {
    assert_eq!(outcome(&[Effect::ValveLag], vec![named("valve-lag", &[])]), Outcome::Exact);
    assert_eq!(outcome(&[Effect::ValveLag], vec![named("valve-lag", &["line-delay"])]), Outcome::Exact);
}

#[test]
fn another_cause_counts_only_if_the_tie_is_declared() {
    assert_eq!(outcome(&[Effect::ValveLag], vec![named("line-delay", &["valve-lag"])]), Outcome::Tied);
    assert_eq!(outcome(&[Effect::ValveLag], vec![named("line-delay", &[])]), Outcome::Misnamed);
}

#[test]
fn a_tie_with_half_the_catalogue_names_nothing() {
    let everyone: Vec<&str> = Effect::ALL.iter().map(|effect| effect.id()).collect();
    assert_eq!(outcome(&[Effect::ValveLag], vec![named("payload-mass", &everyone)]), Outcome::Abstained);
    assert_eq!(outcome(&[Effect::ValveLag], vec![named("payload-mass", &everyone[3..])]), Outcome::Misnamed);
}

#[test]
fn a_right_cause_with_a_wrong_one_beside_it_is_a_misnaming() {
    let both = vec![named("valve-lag", &[]), named("dead-volume", &[])];
    assert_eq!(outcome(&[Effect::ValveLag], both), Outcome::Misnamed);
}

#[test]
fn one_of_two_is_partial_and_both_in_any_order_are_exact() {
    let pair = [Effect::ValveLag, Effect::DeadVolume];
    assert_eq!(outcome(&pair, vec![named("dead-volume", &[])]), Outcome::Partial);
    assert_eq!(outcome(&pair, vec![named("dead-volume", &[]), named("valve-lag", &[])]), Outcome::Exact);
}

#[test]
fn one_cause_cannot_stand_for_two_hidden_ones() {
    let pair = [Effect::ValveLag, Effect::LineDelay];
    let twice = vec![named("valve-lag", &["line-delay"]), named("payload-mass", &["valve-lag", "line-delay"])];
    assert_eq!(outcome(&pair, twice), Outcome::Tied);
    assert_eq!(outcome(&pair, vec![named("valve-lag", &["line-delay"])]), Outcome::Partial);
    let stretched = vec![named("valve-lag", &["line-delay"]), named("line-delay", &[]), named("line-delay", &[])];
    assert_eq!(outcome(&pair, stretched), Outcome::Misnamed);
}

#[test]
fn a_null_log_wants_silence_and_any_claim_is_an_alarm() {
    let quiet = score(&[], &Answer::silent(Verdict::NoGap));
    assert_eq!(quiet.outcome, Outcome::Quiet);
    assert_eq!(score(&[], &Answer::silent(Verdict::Unexplained)).outcome, Outcome::FalseAlarm);
    let alarm = answer(Verdict::Explained, vec![named("valve-lag", &[])]);
    assert_eq!(score(&[], &alarm).outcome, Outcome::FalseAlarm);
}

#[test]
fn what_is_outside_the_catalogue_must_not_be_explained() {
    let outside = [Cause::Foreign(Foreign::Backlash, [1e-3, 0.5])];
    assert_eq!(score(&outside, &Answer::silent(Verdict::Unexplained)).outcome, Outcome::Rejected);
    assert_eq!(score(&outside, &Answer::silent(Verdict::NoGap)).outcome, Outcome::Overlooked);
    let explained = answer(Verdict::Explained, vec![named("payload-mass", &[])]);
    assert_eq!(score(&outside, &explained).outcome, Outcome::Seduced);
}

#[test]
fn silence_about_a_hidden_cause_is_an_abstention_and_no_misnaming() {
    let silent = score(&hidden(&[Effect::ValveLag]), &Answer::silent(Verdict::NoGap));
    assert_eq!(silent.outcome, Outcome::Abstained);
    assert!(!silent.outcome.is_wrong());
}

#[test]
fn the_structural_tie_of_constant_force_and_asymmetry_must_be_declared() {
    let truth = hidden(&[Effect::ConstantForce]);
    let with = answer(Verdict::Explained, vec![named("constant-force", &["friction-asymmetry"])]);
    let without = answer(Verdict::Explained, vec![named("constant-force", &[])]);
    assert_eq!(score(&truth, &with).structural_tie_declared, Some(true));
    assert_eq!(score(&truth, &without).structural_tie_declared, Some(false));
    let other = answer(Verdict::Explained, vec![named("valve-lag", &[])]);
    assert_eq!(score(&hidden(&[Effect::ValveLag]), &other).structural_tie_declared, None);
}

#[test]
fn parameters_are_compared_in_percent_and_in_standard_errors() {
    let truth = [Cause::Catalogue(Effect::ValveHysteresis, [0.3, 0.0, 0.0])];
    let close = score(&truth, &answer(Verdict::Explained, vec![named("valve-hysteresis", &[])]));
    assert_eq!(close.parameters.len(), 1);
    assert!((close.parameters[0].in_std_errors - 1.0).abs() < 1e-9);
    assert!(close.parameters[0].is_good() && close.parameters[0].is_covered());
    let mut far = named("valve-hysteresis", &[]);
    far.parameters[0].value = 0.4;
    let far = score(&truth, &answer(Verdict::Explained, vec![far]));
    assert!(!far.parameters[0].is_good() && !far.parameters[0].is_covered());
    let mut unsure = named("valve-hysteresis", &[]);
    unsure.parameters[0].std_error = 0.0;
    let unsure = score(&truth, &answer(Verdict::Explained, vec![unsure]));
    assert!(unsure.parameters[0].is_good() && !unsure.parameters[0].is_covered());
}

#[test]
fn a_factor_is_scored_together_with_the_calibration_of_what_it_multiplies() {
    let truth = [Cause::Catalogue(Effect::FillCoefficient, [0.8, 0.0, 0.0])];
    let mut cause = named("fill-coefficient", &[]);
    cause.parameters = vec![Estimate { name: "scale".into(), value: 0.784, std_error: 0.016 }];
    let mut with = answer(Verdict::Explained, vec![cause]);
    with.calibration.push(("valve.fill_coefficient_kg_per_s_pa".into(), 1.02));
    assert!(score(&truth, &with).parameters[0].relative_error < 1e-3);
}

#[test]
fn the_worst_channel_counts_against_the_noise_floor() {
    let mut with = Answer::silent(Verdict::Explained);
    for (extended, noise_floor) in [(1.1, 1.0), (2.6, 2.0), (5.0, 0.0)] {
        with.holdout.push(Holdout { channel: "y_m".into(), baseline: 9.0, extended, noise_floor });
    }
    assert_eq!(score(&[], &with).worst_floor_ratio, Some(1.3));
}
