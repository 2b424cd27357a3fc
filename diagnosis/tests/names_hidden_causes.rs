//! Hides an effect in a log made by an independent simulator and asks the diagnosis to find it.

use diagnosis::{Diagnosis, diagnose};
use plant_model::Effect;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rig_files::{Column, Log, RigFile, Verdict};
use synthesis::blind::{Class, Nominal, Plan, plans};
use synthesis::{Case, Cause, Chain, Family, Law};

fn cases(class: Class, nominal: Nominal, count: usize) -> Vec<(Plan, RigFile, Log, Vec<String>)> {
    plans(class, nominal, count, 20_261_120)
        .into_iter()
        .map(|plan| {
            let case = plan.draw();
            let hidden = case.causes.iter().map(|cause| cause.id().to_string()).collect();
            let (log, _) = case.record();
            (plan, case.rig_file, log, hidden)
        })
        .collect()
}

fn found(rig: &RigFile, log: &Log) -> Diagnosis {
    diagnose(rig, log, &|_| {}).expect("a full log can be diagnosed")
}

/// Whether exactly the hidden effect is named, or one it is declared tied with.
fn is_right(hidden: &[String], named: &[(String, Vec<String>)]) -> bool {
    named.len() == 1 && hidden.iter().all(|id| named[0].0 == *id || named[0].1.contains(id))
}

/// The effect that stands next in the catalogue: what a diagnosis with shuffled hypotheses would answer.
fn shuffled(id: &str) -> String {
    let at = Effect::ALL.iter().position(|e| e.id() == id).expect("causes come from the catalogue");
    Effect::ALL[(at + 1) % Effect::ALL.len()].id().to_string()
}

#[test]
fn single_effects_are_named_first_and_alone_and_shuffled_names_would_not_pass() {
    for (nominal, count) in [(Nominal::Exact, 5), (Nominal::TwoPercent, 3)] {
        for (plan, rig, log, hidden) in cases(Class::Single, nominal, count) {
            let diagnosis = found(&rig, &log);
            let named: Vec<_> = diagnosis.causes.iter().map(|c| (c.id.clone(), c.ties.clone())).collect();
            assert!(
                is_right(&hidden, &named),
                "{plan:?}: hidden {hidden:?}, named {named:?} ({:?})",
                diagnosis.verdict
            );
            let mutated: Vec<_> = named.iter().map(|(id, _)| (shuffled(id), vec![])).collect();
            assert!(!is_right(&hidden, &mutated), "{plan:?}: the test would not notice shuffled hypotheses");
        }
    }
}

/// 15 s of everyday work of rig (a), recorded from `begins_s` on.
fn recorded_from(begins_s: f64, effect: Effect, values: [f64; 3]) -> (RigFile, Log) {
    let rig_file = RigFile::paper_a();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut chain = Chain::standard(rig_file.io.position_range_m);
    chain.columns.push(Column::PSup);
    chain.begins_s = begins_s;
    let case = Case {
        truth: rig_file.rig,
        causes: vec![Cause::Catalogue(effect, values)],
        experiment: Family::Everyday.draw(&rig_file.rig, 15.0 + begins_s, &mut rng),
        law: Law::for_rig(&rig_file.rig, 1.2),
        chain,
        seed: 7,
        rig_file,
    };
    let (log, _) = case.record();
    (case.rig_file, log)
}

/// Where a valve's play stood and how far the supply had drooped before the log began is not known.
#[test]
fn a_log_may_begin_in_the_middle_of_things() {
    for (effect, values) in [(Effect::ValveHysteresis, [0.15, 0.0, 0.0]), (Effect::SupplyDroop, [3.0e7, 0.3, 0.0])] {
        for begins_s in [1.2, 2.1, 3.3, 4.7] {
            let (rig, log) = recorded_from(begins_s, effect, values);
            let diagnosis = found(&rig, &log);
            let named: Vec<_> = diagnosis.causes.iter().map(|c| c.id.as_str()).collect();
            assert_eq!((named, diagnosis.verdict), (vec![effect.id()], Verdict::Explained), "{effect} {begins_s}");
        }
    }
}

#[test]
fn logs_without_a_gap_raise_no_alarm() {
    for (plan, rig, log, _) in cases(Class::Null, Nominal::TwoPercent, 3) {
        let diagnosis = found(&rig, &log);
        assert_eq!(diagnosis.verdict, Verdict::NoGap, "{plan:?}: {:?}", diagnosis.causes);
        assert!(diagnosis.causes.is_empty());
    }
}

#[test]
fn effects_from_outside_the_catalogue_get_no_name() {
    for (plan, rig, log, hidden) in cases(Class::Unknown, Nominal::Exact, 2) {
        let diagnosis = found(&rig, &log);
        assert!(diagnosis.causes.is_empty(), "{plan:?}: hidden {hidden:?}, named {:?}", diagnosis.causes);
    }
}
