//! Logs that say little get a plain answer: what is missing, or that nothing shows.

use diagnosis::{Cause, DiagnosisError, diagnose};
use plant_model::Effect;
use rig_files::{Log, RigFile, Verdict};
use synthesis::blind::{Class, Nominal, Plan, plans, plans_hiding};
use test_stages::{of, runs_long};

/// Five seconds at 1 kHz of a piston that rests, closed in at the slow-motion pressure.
fn resting() -> Log {
    let count = 5000;
    let wobble = |k: usize, period: usize| ((k % period) as f64 / period as f64 - 0.5) * 2.0;
    Log {
        t_s: (0..count).map(|k| k as f64 * 1.0e-3).collect(),
        u_v: Some(vec![0.0; count]),
        y_m: (0..count).map(|k| 5.0e-5 * wobble(k, 7)).collect(),
        p_a_pa: Some((0..count).map(|k| 3.618e5 + 600.0 * wobble(k, 11)).collect()),
        p_b_pa: Some((0..count).map(|k| 3.618e5 + 600.0 * wobble(k, 13)).collect()),
        ..Log::default()
    }
}

fn keep(log: &Log, kept: impl Fn(usize) -> bool) -> Log {
    let pick =
        |values: &[f64]| values.iter().enumerate().filter(|(k, _)| kept(*k)).map(|(_, v)| *v).collect::<Vec<_>>();
    Log {
        t_s: pick(&log.t_s),
        y_m: pick(&log.y_m),
        u_v: log.u_v.as_deref().map(pick),
        p_a_pa: log.p_a_pa.as_deref().map(pick),
        p_b_pa: log.p_b_pa.as_deref().map(pick),
        ..Log::default()
    }
}

#[test]
fn a_log_that_is_too_short_says_how_long_it_should_be() {
    let error = diagnose(&RigFile::paper_a(), &keep(&resting(), |k| k < 150), &|_| {}).expect_err("too short");
    assert_eq!(error, DiagnosisError::TooShort { found: 150 });
    assert!(error.to_string().contains("150") && error.to_string().contains("200"), "{error}");
}

#[test]
fn a_log_full_of_gaps_is_not_called_short() {
    let error = diagnose(&RigFile::paper_a(), &keep(&resting(), |k| k % 20 < 12), &|_| {}).expect_err("broken");
    assert_eq!(error, DiagnosisError::TooBroken);
}

#[test]
fn nothing_is_named_where_nothing_moves() {
    let diagnosis = diagnose(&RigFile::paper_a(), &resting(), &|_| {}).expect("long enough");
    assert!(diagnosis.causes.is_empty(), "{:?}", diagnosis.causes);
    assert!(diagnosis.not_identifiable.iter().any(|id| id == "payload-mass"), "{:?}", diagnosis.not_identifiable);
}

#[test]
fn without_a_command_a_resting_piston_is_no_log_to_judge() {
    let error = diagnose(&RigFile::paper_a(), &Log { u_v: None, ..resting() }, &|_| {}).expect_err("nothing moves");
    assert_eq!(error, DiagnosisError::Still);
    assert!(error.to_string().contains("add u_v"), "{error}");
}

/// Such logs tempt to name a large mass, volume or lag: it suppresses the noise that a model passes on.
#[test]
fn poor_experiments_without_a_gap_name_nothing() {
    let wanted = of(4, 1);
    let poor = plans(Class::Poor, Nominal::Exact, 24, 20_261_121);
    let cases =
        poor.into_iter().map(|plan| (plan, plan.draw())).filter(|(_, case)| case.causes.is_empty()).take(wanted);
    let mut count = 0;
    for (plan, case) in cases {
        let diagnosis = diagnose(&case.rig_file, &case.record().0, &|_| {}).expect("a full log");
        assert!(diagnosis.causes.is_empty(), "{plan}: {:?}", diagnosis.causes);
        assert_eq!(diagnosis.verdict, Verdict::NoGap, "{plan}: {:?}", diagnosis.leads);
        count += 1;
    }
    assert_eq!(count, wanted);
}

/// Nor beside a cause that is really there, however large that is.
#[test]
fn a_dead_zone_in_a_poor_experiment_gets_no_companion() {
    if !runs_long("a dead zone in poor experiments") {
        return;
    }
    let id = Effect::ValveDeadZone.id();
    let mut found = 0;
    for plan in plans_hiding(id, Class::Poor, Nominal::TwoPercent, 3, 20_261_124) {
        let case = plan.draw();
        // Where nothing moves at all there is nothing to judge.
        let Ok(diagnosis) = diagnose(&case.rig_file, &case.record().0, &|_| {}) else { continue };
        let hidden = |cause: &Cause| cause.id == id || cause.ties.iter().any(|tie| tie == id);
        assert!(diagnosis.causes.iter().all(hidden), "{plan}: {:?}", diagnosis.causes);
        found += diagnosis.causes.len();
    }
    assert!(found > 0, "none of 3 found");
}

/// "At most" on a data sheet is no value: the rig file states half of it, give or take half of that.
#[test]
fn a_valve_better_than_its_data_sheet_is_no_finding() {
    let nulls = plans(Class::Null, Nominal::Exact, of(3, 1), 20_261_123);
    for (plan, half_width_v) in nulls.into_iter().zip([0.003, 0.0, 0.018]) {
        let mut case = plan.draw();
        case.rig_file.effects.set(Effect::ValveHysteresis, &[0.01]);
        case.rig_file.tolerance.set_effect(Effect::ValveHysteresis, 0, 0.5);
        case.causes = vec![synthesis::Cause::Catalogue(Effect::ValveHysteresis, [half_width_v, 0.0, 0.0])];
        let diagnosis = diagnose(&case.rig_file, &case.record().0, &|_| {}).expect("a full log");
        assert_eq!(diagnosis.verdict, Verdict::NoGap, "{plan}, {half_width_v} V: {:?}", diagnosis.causes);
    }
}

/// A piston of rig (a) thrown up again and again by chamber A, which is vented while it flies: position and p_a of 40 s at
/// 1 kHz. `force_n` pulls it down all the time, `friction_n` against its motion.
fn thrown(force_n: f64, friction_n: f64) -> Log {
    let mass_kg = RigFile::paper_a().rig.load.mass_kg;
    let (up, down) = ((force_n + friction_n) / mass_kg, (force_n - friction_n) / mass_kg);
    let mut log = Log { p_a_pa: Some(vec![]), ..Log::default() };
    let mut state = 1_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64 - 0.5
    };
    let (mut y, mut v, mut rests) = (-0.3, 0.0, 0.0);
    for k in 0..40_000 {
        rests += 1.0e-3;
        if y <= -0.3 && v <= 0.0 {
            (y, v) = (-0.3, if rests > 0.5 { 2.0 + 0.5 * noise() } else { 0.0 });
        } else {
            v -= 1.0e-3 * if v > 0.0 { up } else { down };
            rests = 0.0;
        }
        y += 1.0e-3 * v;
        let pressure = if v == 0.0 { 5.0e5 } else { 1.0e5 };
        log.t_s.push(1.0e-3 * f64::from(k));
        log.y_m.push(y + 1.7e-4 * noise());
        log.p_a_pa.iter_mut().for_each(|p| p.push(pressure + 1.0e3 * noise()));
    }
    log
}

/// While the measured chamber is vented the other one may push: nobody measured it.
#[test]
fn one_pressure_alone_names_the_weight_and_no_force_that_the_other_chamber_may_make() {
    let rig = RigFile::paper_a();
    let weight_n = 9.81 * rig.rig.load.mass_kg;
    let named = |force_n: f64| diagnose(&rig, &thrown(force_n, 25.0), &|_| {}).expect("vented strokes").causes;
    let weight = named(weight_n);
    assert_eq!(weight.iter().map(|cause| &cause.id[..]).collect::<Vec<_>>(), ["constant-force"]);
    let found = &weight[0].parameters[0];
    assert!((found.value - weight_n).abs() < 2.0 * found.std_error, "{found:?}");
    assert!(named(2.0 * weight_n).is_empty());
}

/// With one pressure alone a position that reads too long and a smaller piston make the same flow and volume.
#[test]
fn with_one_pressure_a_piston_area_is_told_beside_a_position_scale() {
    let case = "partial/exact/d2a34eb846a81cb1@33".parse::<Plan>().expect("a case").draw();
    let log = case.record().0;
    assert!(log.p_a_pa.is_some() && log.p_b_pa.is_none(), "one pressure");
    let found = diagnose(&case.rig_file, &log, &|_| {}).expect("a mass balance");
    let told: Vec<_> = found.causes.iter().map(|cause| (cause.id.as_str(), &cause.ties[..])).collect();
    assert!(matches!(told[..], [("position-scale", [tie])] if tie == "piston-area"), "{told:?}");
}
