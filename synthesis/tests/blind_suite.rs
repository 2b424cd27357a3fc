//! The suite itself must be able to tell a good diagnosis from a bad one.

use plant_model::Effect;
use rig_files::{Log, RigFile, Verdict};
use std::sync::atomic::{AtomicUsize, Ordering};
use synthesis::Cause;
use synthesis::blind::{
    Answer, Class, Estimate, Named, Nominal, Outcome, Plan, Score, case_lines, markdown, plans, run, score,
};

/// Every class and both nominals, without recording anything.
fn suite() -> Vec<Vec<Cause>> {
    let all = Class::ALL.into_iter().flat_map(|class| Nominal::ALL.map(|nominal| plans(class, nominal, 60, 11)));
    all.flatten().map(|plan| plan.draw().causes).collect()
}

fn name(cause: &Cause, id: &str) -> Named {
    let parameters = cause
        .parameters()
        .iter()
        .map(|(name, value)| Estimate {
            name: (*name).into(),
            value: value * 1.01,
            std_error: 0.02 * value.abs() + 1e-12,
        })
        .collect();
    Named { id: id.to_string(), parameters, ties: vec![] }
}

/// Knows the truth; calls every effect by `rename` of its name.
fn oracle(hidden: &[Cause], rename: impl Fn(Effect) -> Effect) -> Answer {
    if hidden.is_empty() {
        return Answer::silent(Verdict::NoGap);
    }
    if hidden.iter().any(|cause| cause.effect().is_none()) {
        return Answer::silent(Verdict::Unexplained);
    }
    let causes =
        hidden.iter().filter_map(|cause| Some(name(cause, rename(cause.effect()?).id()))).rev().collect::<Vec<_>>();
    Answer { causes, ..Answer::silent(Verdict::Explained) }
}

fn scores(answer: impl Fn(&[Cause]) -> Answer) -> Vec<Score> {
    suite().iter().map(|hidden| score(hidden, &answer(hidden))).collect()
}

fn share(scores: &[Score], accepted: impl Fn(&Score) -> bool) -> f64 {
    scores.iter().filter(|score| accepted(score)).count() as f64 / scores.len() as f64
}

fn is_right(score: &Score) -> bool {
    matches!(score.outcome, Outcome::Exact | Outcome::Quiet | Outcome::Rejected)
}

#[test]
fn an_oracle_scores_everything() {
    let scores = scores(|hidden| oracle(hidden, |effect| effect));
    assert!(scores.iter().all(is_right));
    assert!(scores.iter().flat_map(|score| &score.parameters).all(|p| p.is_good() && p.is_covered()));
}

#[test]
fn a_diagnosis_with_shuffled_names_is_caught() {
    let shifted = |effect: Effect| {
        let at = Effect::ALL.iter().position(|other| *other == effect).expect("in the catalogue");
        Effect::ALL[(at + 7) % Effect::ALL.len()]
    };
    let scores = scores(|hidden| oracle(hidden, shifted));
    assert!(share(&scores, |score| score.outcome == Outcome::Misnamed) > 0.5);
    assert!(share(&scores, |score| score.outcome == Outcome::Exact) == 0.0);
}

#[test]
fn a_diagnosis_that_always_says_the_same_is_caught() {
    for effect in Effect::ALL {
        let constant = || Answer {
            causes: vec![Named { id: effect.id().into(), parameters: vec![], ties: vec![] }],
            ..Answer::silent(Verdict::Explained)
        };
        let scores = scores(|_| constant());
        // The class of slight deviations has two effects: one of them is right in half of its logs.
        assert!(share(&scores, is_right) < 0.1, "{effect}");
        assert!(share(&scores, |score| score.outcome.is_wrong()) > 0.8, "{effect}");
    }
}

#[test]
fn a_diagnosis_that_never_says_anything_hits_nothing_but_null_logs() {
    let scores = scores(|_| Answer::silent(Verdict::NoGap));
    assert!(scores.iter().all(|score| !score.outcome.is_wrong()));
    assert!(share(&scores, |score| matches!(score.outcome, Outcome::Exact | Outcome::Tied)) == 0.0);
}

#[test]
fn a_case_is_the_same_whenever_it_is_drawn_from_its_name() {
    for class in Class::ALL {
        for plan in plans(class, Nominal::TwoPercent, 3, 4) {
            let again: Plan = plan.to_string().parse().expect("a case name reads back");
            assert_eq!(plan, again);
            assert_eq!(plan.draw(), again.draw());
        }
    }
    let wrong = ["", "single", "single/exact", "single/exact/xyz", "double/exact/0f", "single/exact/0f/1"];
    let too_many = format!("single/exact/0f@{}", Effect::ALL.len() + 1);
    for wrong in wrong.into_iter().chain(["single/exact/0f@", "single/exact/0f@0", "single/exact/0f@x", &too_many]) {
        assert!(wrong.parse::<Plan>().is_err(), "{wrong}");
    }
}

#[test]
fn a_case_draws_from_as_many_effects_as_its_name_says() {
    // That one of n effects is missing from 40 n draws has a probability of n exp(-40).
    for effects in [1, 5, Effect::ALL.len() - 1] {
        let case = |seed: u64| format!("single/exact/{seed:x}@{effects}").parse::<Plan>().expect("a case").draw();
        let mut drawn: Vec<&str> = (0..40 * effects as u64).map(|seed| case(seed).causes[0].id()).collect();
        drawn.sort_unstable();
        drawn.dedup();
        let mut known: Vec<&str> = Effect::ALL[..effects].iter().map(|effect| effect.id()).collect();
        known.sort_unstable();
        assert_eq!(drawn, known);
    }
}

#[test]
fn every_block_of_single_effects_holds_each_of_them_once() {
    let mut ids: Vec<&str> = plans(Class::Single, Nominal::Exact, Effect::ALL.len(), 99)
        .iter()
        .map(|plan| plan.draw().causes[0].id())
        .collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), Effect::ALL.len());
}

#[test]
fn other_suite_seeds_give_other_cases() {
    assert_ne!(plans(Class::Null, Nominal::Exact, 5, 1), plans(Class::Null, Nominal::Exact, 5, 2));
    assert_ne!(
        plans(Class::Null, Nominal::Exact, 5, 1).iter().map(|plan| plan.seed).collect::<Vec<_>>(),
        plans(Class::Null, Nominal::TwoPercent, 5, 1).iter().map(|plan| plan.seed).collect::<Vec<_>>()
    );
}

#[test]
fn exact_nominal_values_are_exact_and_uncertain_ones_stay_near() {
    for plan in plans(Class::Single, Nominal::Exact, 5, 3) {
        let case = plan.draw();
        assert_eq!(case.truth, case.rig_file.rig);
        assert_eq!(case.rig_file.tolerance.of("load.mass_kg"), 0.0);
    }
    for plan in plans(Class::Single, Nominal::TwoPercent, 20, 3) {
        let case = plan.draw();
        let ratio = case.truth.load.mass_kg / case.rig_file.rig.load.mass_kg;
        assert!(ratio != 1.0 && (ratio - 1.0).abs() <= 0.05 + 1e-12);
        assert_eq!(case.rig_file.tolerance.of("load.mass_kg"), 0.02);
        assert!(case.truth.validate().is_ok());
    }
}

#[test]
fn what_a_rig_file_states_is_in_the_rig_and_never_hidden() {
    let mut rig = RigFile::paper_a();
    rig.effects.set(Effect::ValveLag, &[0.01]);
    for plan in plans(Class::Single, Nominal::Exact, Effect::ALL.len(), 5) {
        let case = plan.draw_on(std::slice::from_ref(&rig));
        let lags: Vec<Cause> = case.present().into_iter().filter(|c| c.id() == Effect::ValveLag.id()).collect();
        let hidden = case.causes.iter().any(|cause| cause.id() == Effect::ValveLag.id());
        assert_eq!(lags.len(), 1, "{plan}");
        assert_eq!(case.rig_file.effects.get(Effect::ValveLag).is_none(), hidden, "{plan}");
        assert!(hidden || lags[0] == Cause::Catalogue(Effect::ValveLag, [0.01, 0.0, 0.0]), "{plan}: {lags:?}");
    }
}

#[test]
fn a_failing_diagnosis_fails_its_case_and_not_the_suite() {
    let count = AtomicUsize::new(0);
    let failing = |_: &RigFile, log: &Log| -> Result<Answer, String> {
        assert!(log.len() > 30_000);
        count.fetch_add(1, Ordering::Relaxed);
        Err("no idea".into())
    };
    let plans = plans(Class::Partial, Nominal::Exact, 2, 8);
    let entries = run(&plans, &[RigFile::paper_c()], 2, &failing, &|_| {}).expect("threads start");
    assert_eq!(count.load(Ordering::Relaxed), 2);
    assert!(entries.iter().all(|entry| entry.score.is_none()));
    let table = markdown(&entries, 3, "plant-sim blind");
    assert!(table.contains("2 of 3 cases have run"));
    assert!(table.contains("no idea") && table.contains(&plans[0].to_string()));
    assert_eq!(case_lines(&entries).lines().count(), 3);
}

#[test]
fn cases_on_varied_rigs_move_and_stay_within_their_stroke() {
    for plan in plans(Class::Single, Nominal::TwoPercent, 6, 17) {
        let case = plan.draw_on(&[]);
        let (log, ideal) = case.record();
        let half = 0.5 * case.truth.cylinder.stroke_m;
        let (low, high) = ideal.iter().fold((0.0_f64, 0.0_f64), |(low, high), r| (low.min(r.y_m), high.max(r.y_m)));
        // A wrong position scale may show a place beyond the stroke.
        assert!(low >= -1.1 * half && high <= 1.1 * half, "{plan}: {low} to {high} of {half}");
        assert!(high - low > 0.3 * half, "{plan}: {low} to {high} of {half}");
        assert!(ideal.iter().all(|r| r.p_a_pa > 0.5e5 && r.p_b_pa > 0.5e5 && r.p_a_pa < 2e6 && r.p_b_pa < 2e6));
        assert!(log.len() > 30_000);
    }
}
