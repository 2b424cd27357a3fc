//! Every scenario, every default run of `plant-sim` and the co-process answer with the codes on record: one hash over the
//! DAC codes and modes of all ticks.
//!
//! A change that is meant is written with `RECORD_DAC_CODES=1 cargo test -p scenarios --test recorded`, and explained in the
//! commit.

use control::Parameters;
use firmware_core::mode_number;
use plant_sim::stdio::Coprocess;
use plant_sim::{ClosedLoop, ConversionNoise, LoopSettings, MonitorAction, controller, monitoring};
use rig_files::RigFile;
use scenarios::{Scenario, host_target, run_observed};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// FNV-1a, 64 bits, over little-endian DAC codes and mode numbers.
struct Hash {
    value: u64,
    ticks: u64,
}

impl Hash {
    fn new() -> Self {
        Self { value: 0xcbf2_9ce4_8422_2325, ticks: 0 }
    }

    fn tick(&mut self, dac: u16, mode: u16) {
        for byte in dac.to_le_bytes().into_iter().chain(mode.to_le_bytes()) {
            self.value = (self.value ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
        self.ticks += 1;
    }
}

fn here(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// Steps to and fro, so that every part of the law is used.
fn square_wave_m(tick: u64) -> f64 {
    if (tick / 1500).is_multiple_of(2) { 0.045 } else { -0.03 }
}

fn rigs() -> [(&'static str, RigFile); 4] {
    let real = RigFile::read(&here("../rigs/real-mpye.toml")).unwrap_or_else(|error| panic!("{error}"));
    [
        ("paper-a", RigFile::paper_a()),
        ("paper-b", RigFile::paper_b()),
        ("paper-c", RigFile::paper_c()),
        ("real-mpye", real),
    ]
}

/// The loop of `plant-sim run` and of sweeps.
fn closed_loop(
    rig: &RigFile,
    parameters: &Parameters,
    settings: &LoopSettings,
    ticks: u64,
    reference_m: impl Fn(u64) -> f64,
) -> Hash {
    let mut positioner = ClosedLoop::new(rig, parameters, settings).expect("valid");
    let mut hash = Hash::new();
    for tick in 0..ticks {
        let seen = positioner.tick(reference_m(tick));
        hash.tick(seen.dac, mode_number(seen.mode));
    }
    hash
}

/// The co-process on the same plant, sensor for sensor, with a rail on the position near the end.
fn coprocess(rig: &RigFile, parameters: &Parameters) -> Hash {
    let setup = monitoring::setup(parameters, &rig.rig, MonitorAction::Warn, 1).expect("valid");
    let mut process = Coprocess::new(setup, parameters);
    let mut plant = ClosedLoop::new(rig, parameters, &LoopSettings::default()).expect("valid");
    let mut hash = Hash::new();
    for tick in 0..4000 {
        let reference_m = square_wave_m(tick);
        plant.tick_with(|codes| {
            let [position, a, b, supply] = codes;
            let position = if tick >= 3900 { 0 } else { position };
            let answer = process.answer(&format!("{reference_m} {position} {a} {b} {supply}"));
            let (dac, state) = answer.split_once(' ').unwrap_or_else(|| panic!("{answer}"));
            let dac: u16 = dac.parse().unwrap_or_else(|_| panic!("{answer}"));
            // The protocol tells the state as a word.
            let state = state.bytes().fold(0_u16, |sum, byte| sum.wrapping_mul(31).wrapping_add(u16::from(byte)));
            hash.tick(dac, state);
            dac
        });
    }
    hash
}

fn every_run() -> Vec<(String, Hash)> {
    let mut found = Vec::new();
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(here("scenarios")).expect("scenarios").map(|entry| entry.expect("entry").path()).collect();
    files.sort();
    for file in files {
        let name = file.file_stem().expect("name").to_string_lossy().into_owned();
        let scenario = Scenario::read(&file).unwrap_or_else(|error| panic!("{error}"));
        let mut target = host_target(&scenario).unwrap_or_else(|error| panic!("{name}: {error}"));
        let mut hash = Hash::new();
        run_observed(&scenario, &mut target, |sample| hash.tick(sample.dac, mode_number(sample.mode)))
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        found.push((format!("scenario/{name}"), hash));
    }
    let default = LoopSettings::default();
    let quiet = LoopSettings { noise: ConversionNoise::NONE, ..default };
    // The paper's law first, then the positioning law.
    for (law, parameters) in
        [("", controller::papers_parameters as fn(&RigFile) -> Parameters), ("servo/", controller::parameters)]
    {
        for (name, rig) in rigs() {
            let run = |settings, reference_m: fn(u64) -> f64| {
                closed_loop(&rig, &parameters(&rig), settings, 6001, reference_m)
            };
            // The default of `plant-sim run`: 6 s to 45 mm.
            found.push((format!("{law}run/{name}"), run(&default, |_| 0.045)));
            found.push((format!("{law}run/{name}/quiet"), run(&quiet, |_| 0.045)));
            found.push((format!("{law}run/{name}/square-wave"), run(&default, square_wave_m)));
            found.push((format!("{law}coprocess/{name}"), coprocess(&rig, &parameters(&rig))));
        }
    }
    found
}

#[test]
fn all_runs_answer_with_the_codes_on_record() {
    let file = here("tests/recorded/dac-codes.txt");
    let mut text = String::from("# run, ticks, FNV-1a of DAC codes and mode numbers\n");
    for (name, hash) in every_run() {
        let _ = writeln!(text, "{name} {} {:016x}", hash.ticks, hash.value);
    }
    if std::env::var_os("RECORD_DAC_CODES").is_some() {
        std::fs::write(&file, &text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    }
    let recorded = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let different: Vec<String> = recorded
        .lines()
        .zip(text.lines())
        .filter(|(recorded, found)| recorded != found)
        .map(|(recorded, found)| format!("recorded {recorded}\n   found {found}"))
        .collect();
    assert!(different.is_empty(), "{}", different.join("\n"));
    assert_eq!(recorded.lines().count(), text.lines().count(), "a run is missing on one side");
}
