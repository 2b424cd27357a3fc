//! Mistakes of a mapping and flaws of a log: each is told with its remedy, and none is taken for a cause.

mod drawn;

use diagnosis::{DiagnosisError, Weight, check, diagnose};
use drawn::{SEED, null};
use plant_model::{Effect, Rig};
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rig_files::{Column, Log, RigFile, Verdict};
use std::cell::Cell;
use synthesis::blind::{Class, Nominal, plans};
use synthesis::{Case, Cause, Chain, Family, Law};
use test_stages::of;

/// A column, what a wrong mapping makes of its values, and a word of what must be said.
type Mistake = (Column, Box<dyn Fn(f64) -> f64>, &'static str);

/// What a mapping can get wrong.
fn mistakes(rig: &RigFile) -> Vec<Mistake> {
    let half = 0.5 * rig.rig.cylinder.stroke_m;
    let most = rig.rig.valve.max_voltage_v;
    vec![
        (Column::Y, Box::new(|y| -y), "reversed"),
        (Column::Y, Box::new(move |y| y + half), "end of the stroke"),
        (Column::Y, Box::new(|y| 1000.0 * y), "metres"),
        (Column::U, Box::new(|u| -u), "reversed"),
        (Column::U, Box::new(move |u| u + most), "mid position"),
        (Column::U, Box::new(|u| 1000.0 * u), "volts"),
        (Column::U, Box::new(move |u| 100.0 / most * u), "per cent"),
        (Column::PA, Box::new(|p| 1.0e-3 * p), "1 kPa"),
    ]
}

fn changed(log: &Log, column: Column, change: &dyn Fn(f64) -> f64) -> Log {
    let mut out = log.clone();
    out.set(column, log.column(column).map(|values| values.iter().map(|x| change(*x)).collect()));
    out
}

/// The mistake that a diagnosis names, without a search.
fn refused(rig: &RigFile, log: &Log, mistake: &str) -> String {
    let searched = Cell::new(false);
    let error = diagnose(rig, log, &|stage| searched.set(searched.get() || stage.contains("model")));
    assert!(!searched.get(), "{mistake} on {}: searched", rig.name);
    match error {
        Err(DiagnosisError::Contradiction { problem, remedy }) => format!("{problem}: {remedy}"),
        other => panic!("{:?}", other.map(|found| found.verdict)),
    }
}

#[test]
fn a_column_mapped_wrongly_is_named_with_its_remedy_and_nothing_is_searched() {
    let plan = plans(Class::Single, Nominal::TwoPercent, 1, SEED)[0];
    let hidden = plan.draw();
    let logs = [(null(0).1, null(0).2), (hidden.rig_file.clone(), hidden.record().0)];
    for (rig, log) in logs.into_iter().take(of(2, 1)) {
        for (column, change, word) in mistakes(&rig) {
            let said = refused(&rig, &changed(&log, column, &*change), &format!("{} {word}", column.name()));
            assert!(said.contains(word), "{} should say {word}: {said}", column.name());
        }
        let gauge = |p: f64| p - rig.rig.supply.atmosphere_pa;
        let one = changed(&log, Column::PA, &gauge);
        assert!(refused(&rig, &one, "gauge").contains("the values of p_a_pa seem to be gauge"));
        assert!(
            refused(&rig, &changed(&one, Column::PB, &gauge), "gauge")
                .contains("the chamber pressures seem to be gauge")
        );
        let mut dead = log.clone();
        for column in [Column::Y, Column::PA, Column::PB, Column::PSup] {
            dead.set(column, log.column(column).map(|values| vec![values[100]; values.len()]));
        }
        assert!(refused(&rig, &dead, "dead").contains("no sensor changes"));
    }
}

#[test]
fn a_column_that_another_clock_stamped_is_told_with_the_shift_and_is_no_effect() {
    let (mut told, logs) = (0, of(2, 1));
    for which in 0..logs {
        let (plan, rig, log) = null(which);
        for (column, later_s, word) in [(Column::Y, -2.0e-3, "early"), (Column::U, 3.0e-3, "late")] {
            let mut stamped = log.clone();
            stamped.set(column, log.shifted(column, later_s));
            match diagnose(&rig, &stamped, &|_| {}) {
                Err(DiagnosisError::Contradiction { problem, remedy }) => {
                    let name = format!("{} seems to be stamped", column.name());
                    assert!(problem.contains(&name) && problem.contains(word), "{plan}: {problem}");
                    let shift =
                        remedy.split("shift_s = ").nth(1).and_then(|rest| rest.split('`').next()?.parse::<f64>().ok());
                    assert!(shift.is_some_and(|shift| (shift + later_s).abs() < 0.25e-3), "{plan}: {remedy}");
                    told += 1;
                }
                // Where little moves, a shift changes little more than noise, and pressures that are late against the position
                // are the same.
                Ok(found) => assert!(found.causes.iter().all(|c| c.id == "pressure-lag"), "{plan}: {:?}", found.causes),
                Err(other) => panic!("{plan}: {other}"),
            }
        }
    }
    assert!(told >= logs, "{told} of {}", 2 * logs);
}

#[test]
fn hum_of_the_mains_is_told_and_hides_neither_cause_nor_its_absence() {
    let single = plans(Class::Single, Nominal::Exact, 2, SEED)[1].draw();
    let (_, rig, log) = null(0);
    let hidden: Vec<&str> = single.causes.iter().map(|cause| cause.id()).collect();
    let cases = [(rig, log, vec![]), (single.rig_file.clone(), single.record().0, hidden)];
    for (rig, log, hidden) in cases.into_iter().take(of(2, 1)) {
        let mut humming = log.clone();
        for (column, amplitude_pa) in [(Column::PA, 2.0e3), (Column::PB, 1.2e3)] {
            let hum = |(p, t): (&f64, &f64)| p + amplitude_pa * (core::f64::consts::TAU * 49.9 * t).sin();
            humming.set(column, log.column(column).map(|p| p.iter().zip(&log.t_s).map(hum).collect()));
        }
        let told = check(&rig, &humming).expect("a full log").findings;
        assert_eq!(told.iter().filter(|flaw| flaw.problem.contains("49.9 Hz")).count(), 2, "{told:?}");
        let found = diagnose(&rig, &humming, &|_| {}).expect("a full log");
        let named: Vec<&str> = found.causes.iter().map(|cause| cause.id.as_str()).collect();
        assert_eq!(named, hidden, "{:?}", found.leads);
    }
}

#[test]
fn a_single_wild_reading_is_left_out_and_told() {
    let (_, rig, log) = null(0);
    let mut wild = log.clone();
    wild.y_m[7_000] = log.y_m[7_000] + 0.1;
    wild.p_a_pa.as_mut().expect("measured")[3_000] = -3.0e5;
    let found = check(&rig, &wild).expect("a full log").findings;
    for name in ["y_m", "p_a_pa"] {
        assert!(found.iter().any(|flaw| flaw.problem.starts_with(&format!("{name} has one reading far"))), "{found:?}");
    }
    assert!(found.iter().all(|flaw| flaw.weight == Weight::Loss), "{found:?}");
    let diagnosed = diagnose(&rig, &wild, &|_| {}).expect("a full log");
    assert_eq!((diagnosed.verdict, diagnosed.log.quality.isolated_readings), (Verdict::NoGap, 2));
}

/// Everyday work of rig (a) with the supply measured; `truth` changes what the rig really is.
fn everyday(causes: &[(Effect, [f64; 3])], truth: impl Fn(&mut Rig<f64>)) -> (RigFile, Log) {
    let rig_file = RigFile::paper_a();
    let mut rig = rig_file.rig;
    truth(&mut rig);
    let mut chain = Chain::standard(rig_file.io.position_range_m);
    chain.columns.push(Column::PSup);
    let case = Case {
        experiment: Family::Everyday.draw(&rig_file.rig, 12.0, &mut Xoshiro256PlusPlus::seed_from_u64(SEED)),
        law: Law::for_rig(&rig_file.rig, 1.2),
        causes: causes.iter().map(|(effect, values)| Cause::Catalogue(*effect, *values)).collect(),
        truth: rig,
        chain,
        seed: SEED,
        rig_file,
    };
    let log = case.record().0;
    (case.rig_file, log)
}

#[test]
fn a_reversed_sign_or_exchanged_side_is_seen_beside_a_fault_of_flow_or_load() {
    for fault in [(Effect::ExhaustCoefficient, [0.65, 0.0, 0.0]), (Effect::PayloadMass, [25.0, 0.0, 0.0])] {
        let (rig, log) = everyday(&[fault], |_| {});
        let contradicts = |flaw: &&diagnosis::Flaw| flaw.weight == Weight::Contradiction;
        assert_eq!(check(&rig, &log).expect("a log").findings.iter().find(contradicts), None, "{}", fault.0);
        for column in [Column::Y, Column::U] {
            let said = refused(&rig, &changed(&log, column, &|x| -x), "reversed");
            assert!(said.contains(&format!("{} seems reversed", column.name())), "{}: {said}", fault.0);
        }
        let mut exchanged = log.clone();
        exchanged.set(Column::PA, log.column(Column::PB).map(<[f64]>::to_vec));
        exchanged.set(Column::PB, log.column(Column::PA).map(<[f64]>::to_vec));
        let said = refused(&rig, &exchanged, "exchanged");
        assert!(said.contains("p_a_pa and p_b_pa seem exchanged"), "{}: {said}", fault.0);
    }
}

#[test]
fn gauge_pressures_are_told_by_the_supply_and_a_regulator_set_lower_is_no_contradiction() {
    let (rig, log) = everyday(&[], |_| {});
    let atmosphere = rig.rig.supply.atmosphere_pa;
    let less = |log: &Log, columns: &[Column]| {
        columns.iter().fold(log.clone(), |log, column| changed(&log, *column, &|p| p - atmosphere))
    };
    for (columns, tables) in [
        (&[Column::PA, Column::PB, Column::PSup][..], "all pressures seem to be gauge"),
        (&[Column::PSup], "the values of p_sup_pa seem to be gauge"),
    ] {
        let said = refused(&rig, &less(&log, columns), "gauge");
        assert!(said.contains(tables) && said.contains("`gauge = true`"), "{said}");
    }
    // A rig file that is off within its tolerance hides it until its values are corrected.
    let off = |truth: &mut Rig<f64>| {
        truth.valve.fill_coefficient_kg_per_s_pa *= 1.05;
        truth.valve.exhaust_coefficient_kg_per_s_pa *= 0.95;
        truth.cylinder.volume_a0_m3 *= 1.05;
    };
    let (mut rough, mut read) = everyday(&[], off);
    rough.tolerance.default = 0.03;
    read.set(Column::PSup, None);
    let said = refused(&rough, &less(&read, &[Column::PA, Column::PB]), "gauge");
    assert!(said.contains("the chamber pressures seem to be gauge") && said.contains("nearly as well"), "{said}");
    assert_eq!(diagnose(&rough, &read, &|_| {}).expect("a full log").verdict, Verdict::NoGap);
    let (rig, log) = everyday(&[], |truth| truth.supply.pressure_pa -= atmosphere);
    let findings = check(&rig, &log).expect("a log").findings;
    let doubt = findings.iter().find(|flaw| flaw.problem.contains("the supply is in doubt")).expect("told");
    assert!(doubt.weight == Weight::Loss && doubt.remedy.contains("supply.pressure_pa"), "{doubt:?}");
    assert!(findings.iter().all(|flaw| flaw.weight == Weight::Loss), "{findings:?}");
}

#[test]
fn a_sound_log_is_not_accused_and_tells_what_it_can_tell() {
    for class in Class::ALL.into_iter().take(of(Class::ALL.len(), 2)) {
        for plan in plans(class, Nominal::TwoPercent, of(8, 1), SEED) {
            let case = plan.draw();
            let Ok(found) = check(&case.rig_file, &case.record().0) else { continue };
            let contradicts = |flaw: &&diagnosis::Flaw| flaw.weight == Weight::Contradiction;
            assert_eq!(found.findings.iter().find(contradicts), None, "{plan}");
            // What the others leave out, some of them cannot tell.
            if !matches!(class, Class::Null | Class::Single | Class::Pairs | Class::Unknown) {
                continue;
            }
            let told = |name: &str| found.knowledge.iter().find(|k| k.name == name).is_some_and(|k| k.told);
            assert!(told("valve-dead-zone") && told("leak-cross-piston"), "{plan}");
        }
    }
}

#[test]
fn a_frozen_pressure_and_a_resting_piston_are_told_by_the_check() {
    let (_, rig, log) = null(0);
    let mut frozen = log.clone();
    if let Some(p) = &mut frozen.p_a_pa {
        let stuck = p[5000];
        p[5000..10_000].fill(stuck);
    }
    let found = check(&rig, &frozen).expect("a full log");
    assert!(
        found.findings.iter().any(|flaw| flaw.problem.starts_with("p_a_pa does not change")),
        "{:?}",
        found.findings
    );
    let mut resting = log.clone();
    let mut state = 1_u64;
    for y in &mut resting.y_m {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        *y = 1.0e-4 * ((state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5);
    }
    let found = check(&rig, &resting).expect("a full log");
    let moves = |flaw: &diagnosis::Flaw| flaw.problem.contains("hardly moves") || flaw.weight == Weight::Contradiction;
    assert!(found.findings.iter().any(moves), "{:?}", found.findings);
}

#[test]
fn two_columns_of_one_sensor_and_a_supply_in_another_unit_are_told() {
    let (_, rig, log) = null(0);
    let mut twice = log.clone();
    twice.set(Column::PB, log.column(Column::PA).map(<[f64]>::to_vec));
    let mut other_unit = log.clone();
    // Readings in bar, gauge, that the mapping took for kPa.
    let taken = (rig.rig.supply.pressure_pa - rig.rig.supply.atmosphere_pa) * 1.0e-2 + rig.rig.supply.atmosphere_pa;
    other_unit.set(Column::PSup, Some(vec![taken; log.len()]));
    for (log, words) in
        [(&twice, "p_a_pa and p_b_pa are the same readings"), (&other_unit, "p_sup_pa never exceeds 1.060 bar")]
    {
        let refused = diagnose(&rig, log, &|_| {}).expect_err("nothing to search");
        assert!(refused.to_string().contains(words), "{refused}");
    }
}

/// Neither measures its moment: with such readings judged both logs showed a gap.
#[test]
fn readings_that_are_held_between_samples_or_frozen_are_not_judged() {
    let (_, rig, log) = null(0);
    let changed = |column: Column, from: &dyn Fn(usize) -> usize| {
        log.column(column).map(|values| (0..values.len()).map(|k| values[from(k)]).collect::<Vec<f64>>())
    };
    let mut held = log.clone();
    for column in [Column::PA, Column::PB] {
        held.set(column, changed(column, &|k| k - k % 5));
    }
    let mut frozen = log.clone();
    frozen.set(Column::PA, changed(Column::PA, &|k| if (5_000..10_000).contains(&k) { 5_000 } else { k }));
    for (log, rows) in [(&held, 2 * (log.len() / 5 * 4)), (&frozen, 4_999)] {
        let found = diagnose(&rig, log, &|_| {}).expect("a full log");
        assert_eq!(found.verdict, Verdict::NoGap, "{:?} {:?} {:?}", found.causes, found.leads, found.log.quality);
        assert!(found.log.quality.repeated_readings.abs_diff(rows) <= 8, "{:?}", found.log.quality);
    }
}

#[test]
fn a_log_too_short_to_hold_a_part_back_says_so() {
    let (_, rig, log) = null(0);
    let mut short = log.clone();
    short.t_s.truncate(4000);
    for column in Column::ALL {
        short.set(column, log.column(column).map(|values| values[..4000].to_vec()));
    }
    let found = check(&rig, &short).expect("long enough");
    assert!(
        found.findings.iter().any(|flaw| flaw.problem.contains("too short to hold a part back")),
        "{:?}",
        found.findings
    );
    assert_eq!(diagnose(&rig, &short, &|_| {}).expect("long enough").log.held_back_s, 0.0);
}
