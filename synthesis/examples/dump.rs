//! Writes test logs with rig files and truths into a folder: every effect of the catalogue, pairs, nulls and effects
//! from outside, on the paper's three rigs.
//!
//! `cargo run --release -p synthesis --example dump -- --out DIR [--seeds 2] [--duration 40] [--scale 1] [--nominal 0.02]`

use plant_model::Effect;
use rand::rngs::Xoshiro256PlusPlus;
use rand::{RngExt, SeedableRng};
use rig_files::{Column, RigFile};
use std::path::{Path, PathBuf};
use synthesis::{Case, Cause, Chain, Family, Foreign, Law, Stated, Which, strength, true_rig};

fn main() {
    let mut out = PathBuf::from("target/synthetic-logs");
    let (mut seeds, mut duration, mut scale, mut nominal) = (1_u64, 40.0, 1.0, 0.0);
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().unwrap_or_default();
        let number = || value.parse::<f64>().unwrap_or_else(|_| panic!("{name} wants a number, not `{value}`"));
        match name.as_str() {
            "--out" => out = PathBuf::from(&value),
            "--seeds" => seeds = number() as u64,
            "--duration" => duration = number(),
            "--scale" => scale = number(),
            "--nominal" => nominal = number(),
            _ => panic!("known: --out DIR --seeds N --duration S --scale X --nominal X"),
        }
    }
    std::fs::create_dir_all(&out).expect("the folder can be made");
    let rigs = [("a", RigFile::paper_a()), ("b", RigFile::paper_b()), ("c", RigFile::paper_c())];
    for (letter, rig_file) in &rigs {
        for seed in 1..=seeds {
            let mut sets: Vec<(String, Vec<Which>)> = vec![("null".into(), vec![])];
            sets.extend(Effect::ALL.map(|effect| (effect.id().into(), vec![Which::Catalogue(effect)])));
            sets.extend(Foreign::ALL.map(|foreign| (foreign.id().into(), vec![Which::Foreign(foreign)])));
            for (index, (name, set)) in sets.iter().enumerate() {
                let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed * 1000 + index as u64);
                let case = draw(rig_file, set, seed, duration, scale, nominal, &mut rng);
                write(&out, &format!("{letter}-{name}-{seed}"), &case);
            }
        }
    }
    println!("logs, rig files and truths are in {}", out.display());
}

fn draw(
    rig_file: &RigFile,
    set: &[Which],
    seed: u64,
    duration: f64,
    scale: f64,
    nominal: f64,
    rng: &mut Xoshiro256PlusPlus,
) -> Case {
    let mut rig_file = rig_file.clone();
    rig_file.tolerance = Stated::Everywhere(nominal).tolerance(&rig_file.rig);
    let truth = true_rig(&rig_file.rig, nominal, rng);
    let causes: Vec<Cause> = set.iter().map(|which| strength::draw(*which, &truth, scale, rng)).collect();
    let mut chain = Chain::standard(rig_file.io.position_range_m);
    if rng.random_bool(0.5) && !set.contains(&Which::Foreign(Foreign::SupplyPulsation)) {
        chain.columns.push(Column::PSup);
    }
    let family = Family::GOOD[rng.random_range(0..3)];
    let experiment = family.draw(&rig_file.rig, duration, rng);
    let law = Law::for_rig(&rig_file.rig, rng.random_range(0.8..1.6));
    Case { rig_file, truth, causes, experiment, law, chain, seed }
}

fn write(out: &Path, name: &str, case: &Case) {
    let (log, _) = case.record();
    log.write(&out.join(format!("{name}.csv"))).expect("the log can be written");
    case.rig_file.write(&out.join(format!("{name}.rig.toml"))).expect("the rig file can be written");
    std::fs::write(out.join(format!("{name}.truth.toml")), case.truth_toml()).expect("the truth can be written");
    let causes: Vec<String> = case.causes.iter().map(Cause::describe).collect();
    println!("{name:<40} {:<15} {}", case.experiment.name, causes.join(" "));
}
