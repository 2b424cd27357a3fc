#![no_main]
//! Any bytes as a conversation with the controller: one answer per line, every DAC code in range.
use control::Parameters;
use libfuzzer_sys::fuzz_target;
use plant_sim::monitoring::{self, MonitorAction};
use plant_sim::stdio::Coprocess;
use rig_files::RigFile;

fuzz_target!(|bytes: &[u8]| {
    let model = RigFile::paper_a().rig;
    let Ok(setup) = monitoring::setup(&Parameters::default(), &model, MonitorAction::Trip, 1) else { return };
    let mut answers = Vec::new();
    Coprocess::new(setup, &Parameters::default()).serve(bytes, &mut answers, |_| ()).expect("memory does not fail");
    for answer in String::from_utf8(answers).expect("answers are text").lines() {
        if let Some(code) = answer.split(' ').next().and_then(|word| word.parse::<u32>().ok()) {
            assert!(code <= 4095);
        }
    }
});
