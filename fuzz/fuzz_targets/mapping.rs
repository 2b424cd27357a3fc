#![no_main]
//! Any mapping over any table: a log or an error.
use libfuzzer_sys::fuzz_target;
use plant_sim::import::Mapping;

fuzz_target!(|input: (&str, &str)| {
    if let Ok(mapping) = Mapping::parse(input.0, "map.toml") {
        let _ = mapping.convert(input.1, "table.txt");
    }
});
