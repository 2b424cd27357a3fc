//! Diagnoses of a fixed set of logs, recorded to the last digit: what a change of the diagnosis changes shows here first.
//!
//! The logs come from the independent simulator, from seeds written down here, so that they stay the same whatever the
//! catalogue grows to. With `RECORDED=write` the file is written anew; every line that changes then needs a reason. With
//! `POSITIONER_TESTS=all` all logs are diagnosed, else a few.

use diagnosis::{Diagnosis, diagnose};
use plant_model::Effect;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rayon::prelude::*;
use rig_files::{Column, Log, RigFile};
use std::fmt::Write as _;
use std::path::PathBuf;
use synthesis::{Case, Cause, Chain, Family, Foreign, Law, Stated, true_rig};

/// Of this many logs one is diagnosed where not all are.
const EVERY: usize = 23;

/// One log: what is hidden in it, on which rig, how well the values are known.
struct Recorded {
    name: String,
    causes: Vec<Cause>,
    rig: RigFile,
    tolerance: f64,
    duration_s: f64,
    columns: Option<Vec<Column>>,
    seed: u64,
}

impl Recorded {
    fn record(&self) -> (RigFile, Log) {
        let mut rig_file = self.rig.clone();
        rig_file.tolerance = Stated::UncertainKeys(self.tolerance).tolerance(&rig_file.rig);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let truth = true_rig(&rig_file.rig, self.tolerance, &mut rng);
        let mut chain = Chain::standard(rig_file.io.position_range_m);
        if let Some(columns) = &self.columns {
            chain.columns.clone_from(columns);
        }
        let case = Case {
            truth,
            causes: self.causes.clone(),
            experiment: Family::Everyday.draw(&rig_file.rig, self.duration_s, &mut rng),
            law: Law::for_rig(&rig_file.rig, 1.2),
            chain,
            seed: self.seed,
            rig_file,
        };
        (case.rig_file.clone(), case.record().0)
    }
}

/// The effects of the paper's catalogue, at the strength that the catalogue calls typical.
fn typical(effect: Effect) -> Cause {
    let mut values = [0.0; 3];
    for (value, parameter) in values.iter_mut().zip(effect.info().parameters) {
        *value = parameter.typical;
    }
    Cause::Catalogue(effect, values)
}

/// An effect from outside the catalogue, in the middle of its everyday range.
fn middle(foreign: Foreign) -> [f64; 2] {
    let mut values = [0.0; 2];
    for (value, parameter) in values.iter_mut().zip(foreign.parameters()) {
        *value = 0.5 * (parameter.range[0] + parameter.range[1]);
    }
    values
}

fn logs() -> Vec<Recorded> {
    let rigs = [RigFile::paper_a(), RigFile::paper_b(), RigFile::paper_c()];
    let mut out: Vec<Recorded> = Vec::new();
    let mut add = |name: String, causes: Vec<Cause>, columns: Option<Vec<Column>>| {
        // FNV-1a of the name: a log stays the same whatever is added beside it.
        let seed =
            name.bytes().fold(0xCBF2_9CE4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01B3));
        let (rig, tolerance) = (rigs[(seed % 3) as usize].clone(), if seed & 64 == 0 { 0.0 } else { 0.02 });
        out.push(Recorded { name, causes, rig, tolerance, duration_s: 16.0, columns, seed });
    };
    for effect in Effect::ALL {
        add(effect.id().into(), vec![typical(effect)], None);
    }
    for k in 0..4 {
        add(format!("nothing {k}"), Vec::new(), None);
    }
    use Effect as E;
    for set in [
        &[E::LeakChamberA, E::PayloadMass][..],
        &[E::ChokedFlow, E::ExhaustCoefficient],
        &[E::PressureBOffset, E::ValveLag],
        &[E::CoulombFriction, E::DeadVolume],
        &[E::SupplyDroop, E::ConstantForce, E::ValveDeadZone],
        &[E::FrictionPressure, E::LineDelay, E::LeakCrossPiston],
    ] {
        let name: Vec<&str> = set.iter().map(|e| e.id()).collect();
        add(name.join(" + "), set.iter().map(|e| typical(*e)).collect(), None);
    }
    for foreign in [Foreign::QuadraticDrag, Foreign::Backlash] {
        add(format!("unknown {foreign:?}"), vec![Cause::Foreign(foreign, middle(foreign))], None);
    }
    let sets: [&[Column]; 3] =
        [&[Column::U, Column::PA], &[Column::PA, Column::PB], &[Column::U, Column::PA, Column::PB, Column::PSup]];
    for (k, columns) in sets.into_iter().enumerate() {
        add(format!("columns {k}"), vec![typical(E::ViscousFriction)], Some(columns.to_vec()));
    }
    out
}

/// Everything that a diagnosis says in figures. The floor of the sensors' noise is left out: it is drawn.
fn line(name: &str, result: &Diagnosis) -> String {
    let mut out = format!("{name}: {:?}", result.verdict);
    // Writing to a String cannot fail.
    for (what, causes) in [("cause", &result.causes), ("lead", &result.leads)] {
        for cause in causes {
            let _ = write!(out, "; {what} {} share {:.6}", cause.id, cause.share);
            for p in &cause.parameters {
                let _ = write!(out, " {} {:.9e} +- {:.6e}", p.name, p.value, p.std_error);
            }
            if !cause.ties.is_empty() {
                let _ = write!(out, " tied {}", cause.ties.join(" "));
            }
        }
    }
    for c in &result.calibration {
        let _ = write!(out, "; {} {:.9e} +- {:.6e}", c.name, c.value, c.std_error);
    }
    for b in &result.balances {
        let _ = write!(out, "; {} {:.6} {:.6}", b.channel.column(), b.nominal_misfit, b.extended_misfit);
    }
    if let Some(gain) = &result.gain {
        let of = |v: Option<f64>| v.map_or_else(|| "-".into(), |v| format!("{v:.6e}"));
        let e = &gain.holdout.extended_rmse;
        let _ = write!(out, "; hold-out {} {} {}", of(e.y_m), of(e.p_a_pa), of(e.p_b_pa));
    }
    // Effects that the log could not show are left out: the catalogue grows.
    let keys: Vec<&str> = result.not_identifiable.iter().map(String::as_str).filter(|id| id.contains('.')).collect();
    let _ = write!(out, "; silent on {}", keys.join(" "));
    out
}

#[test]
fn diagnoses_are_those_recorded() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/recorded/diagnoses.txt");
    let write = std::env::var("RECORDED").is_ok_and(|value| value == "write");
    let all = write || test_stages::all();
    let logs: Vec<Recorded> = logs().into_iter().step_by(if all { 1 } else { EVERY }).collect();
    let lines: Vec<String> = logs
        .par_iter()
        .map(|recorded| {
            let (rig, log) = recorded.record();
            match diagnose(&rig, &log, &|_| {}) {
                Ok(result) => line(&recorded.name, &result),
                Err(error) => format!("{}: {error}", recorded.name),
            }
        })
        .collect();
    if write {
        std::fs::write(&path, lines.join("\n") + "\n").expect("the record can be written");
        return;
    }
    let known = std::fs::read_to_string(&path).expect("the record, made with RECORDED=write");
    // A log added since has no record to be compared with.
    let name = |line: &str| line.split(": ").next().unwrap_or_default().to_string();
    let recorded = |line: &str| known.lines().any(|k| name(k) == name(line));
    let changed: Vec<&String> =
        lines.iter().filter(|line| recorded(line) && !known.lines().any(|k| k == line.as_str())).collect();
    assert!(lines.iter().filter(|line| recorded(line)).count() > 1, "nothing was compared");
    assert!(changed.is_empty(), "{} of {} diagnoses changed:\n{changed:#?}", changed.len(), lines.len());
}
