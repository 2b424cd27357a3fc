//! Logs that say little get a plain answer: what is missing, or that nothing shows.

use diagnosis::{DiagnosisError, diagnose};
use rig_files::{Log, RigFile, Verdict};
use synthesis::blind::{Class, Nominal, plans};

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
    let poor = plans(Class::Poor, Nominal::Exact, 24, 20_261_121);
    let cases = poor.into_iter().map(|plan| (plan, plan.draw())).filter(|(_, case)| case.causes.is_empty()).take(4);
    let mut count = 0;
    for (plan, case) in cases {
        let diagnosis = diagnose(&case.rig_file, &case.record().0, &|_| {}).expect("a full log");
        assert!(diagnosis.causes.is_empty(), "{plan}: {:?}", diagnosis.causes);
        assert_eq!(diagnosis.verdict, Verdict::NoGap, "{plan}: {:?}", diagnosis.leads);
        count += 1;
    }
    assert_eq!(count, 4);
}
