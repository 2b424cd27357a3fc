//! What every effect was drawn as and what its synthetic log was when it was recorded, it still is, to the last bit.
//!
//! A line of the recording names rig and effects, then a hash of the values drawn and of the log. `UPDATE_RECORDINGS=1`
//! before the test rewrites it, with a line for each effect of the catalogue: after a change that is meant, never to make
//! the test pass.

use plant_model::Effect;
use rand::SeedableRng;
use rand::rngs::Xoshiro256PlusPlus;
use rig_files::RigFile;
use synthesis::{Case, Cause, Chain, Family, Law, Which, strength};

const RECORDING: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/recorded/logs.txt");

/// Combinations beside no effect and each effect alone.
const COMBINATIONS: [&str; 3] = [
    "coulomb-friction+static-friction+friction-asymmetry+friction-position+friction-pressure",
    "choked-flow+supply-droop+leak-cross-piston+leak-chamber-a+leak-chamber-b+valve-lag+valve-hysteresis",
    "position-scale+pressure-a-offset+pressure-lag+position-delay+line-delay+dead-volume+heat-transfer",
];

struct Hash(u64);

impl Hash {
    fn add(&mut self, value: f64) {
        for byte in value.to_bits().to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

fn line(rig: &str, ids: &str) -> String {
    let rig_file = match rig {
        "a" => RigFile::paper_a(),
        "b" => RigFile::paper_b(),
        "c" => RigFile::paper_c(),
        _ => panic!("no such rig: {rig}"),
    };
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let ids_of = ids.split('+').filter(|id| *id != "none");
    let causes: Vec<Cause> = ids_of
        .map(|id| strength::draw(Which::from_id(id).expect("a known effect"), &rig_file.rig, 1.0, &mut rng))
        .collect();
    let mut hash = Hash(0xcbf2_9ce4_8422_2325);
    causes.iter().flat_map(Cause::parameters).for_each(|(_, value)| hash.add(value));
    let case = Case {
        truth: rig_file.rig,
        law: Law::for_rig(&rig_file.rig, 1.0),
        chain: Chain::standard(rig_file.io.position_range_m),
        experiment: Family::Everyday.draw(&rig_file.rig, 2.0, &mut rng),
        causes,
        rig_file,
        seed: 3,
    };
    let (log, ideal) = case.record();
    for reading in &ideal {
        [reading.y_m, reading.p_a_pa, reading.p_b_pa, reading.p_sup_pa].into_iter().for_each(|value| hash.add(value));
    }
    log.u_v.iter().flatten().for_each(|value| hash.add(*value));
    log.p_a_pa.iter().flatten().for_each(|value| hash.add(*value));
    format!("{rig} {ids} {:016x}\n", hash.0)
}

#[test]
fn every_recorded_log_is_the_same_to_the_last_bit() {
    if std::env::var_os("UPDATE_RECORDINGS").is_some() {
        let mut recording = String::new();
        for rig in ["a", "b", "c"] {
            for ids in ["none"].into_iter().chain(Effect::ALL.map(Effect::id)).chain(COMBINATIONS) {
                recording += &line(rig, ids);
            }
        }
        std::fs::write(RECORDING, recording).unwrap();
    }
    let recording = std::fs::read_to_string(RECORDING).unwrap();
    assert!(recording.lines().count() > 50, "the recording is there");
    let changed: Vec<&str> = recording
        .lines()
        .filter(|stored| {
            let words: Vec<&str> = stored.split(' ').collect();
            let [rig, ids, _] = words[..] else { panic!("not a line of the recording: {stored}") };
            line(rig, ids).trim_end() != *stored
        })
        .collect();
    assert!(changed.is_empty(), "other than recorded: {changed:#?}");
}
