#![no_main]
//! Any bytes as a conversation with the controller: one answer per line, every DAC code in range.
use control::{Config, Parameters};
use libfuzzer_sys::fuzz_target;
use plant_sim::stdio::Coprocess;

fuzz_target!(|bytes: &[u8]| {
    let Ok(config) = Config::from_parameters(&Parameters::default()) else { return };
    let mut answers = Vec::new();
    Coprocess::new(config, 16).serve(bytes, &mut answers).expect("memory does not fail");
    for answer in String::from_utf8(answers).expect("answers are text").lines() {
        if let Some(code) = answer.split(' ').next().and_then(|word| word.parse::<u32>().ok()) {
            assert!(code <= 4095);
        }
    }
});
