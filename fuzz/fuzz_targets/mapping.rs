#![no_main]
//! Any mapping over any bytes: a log or an error. A draft for any bytes: a mapping, or one error.
use libfuzzer_sys::fuzz_target;
use plant_sim::import::{Mapping, suggest};

fuzz_target!(|input: (&str, &[u8])| {
    if let Ok(mapping) = Mapping::parse(input.0, "map.toml") {
        let _ = mapping.convert(input.1, "table.txt");
    }
    if let Ok(draft) = suggest::suggest_bytes(input.1, "table.txt", None) {
        let mapping = Mapping::parse(&draft.text, "draft.toml");
        assert_eq!(mapping.is_err(), !draft.open.is_empty(), "{}", draft.text);
    }
});
