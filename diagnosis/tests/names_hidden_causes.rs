//! Hides an effect in a log made by an independent simulator and asks the diagnosis to find it.

use diagnosis::{Diagnosis, diagnose};
use plant_model::Effect;
use rig_files::{Log, RigFile, Verdict};
use synthesis::blind::{Class, Nominal, Plan, plans};

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
