#![no_main]
//! Any text as a rig file: a rig that writes and reads back the same, or an error.
use libfuzzer_sys::fuzz_target;
use rig_files::RigFile;

fuzz_target!(|text: &str| {
    if let Ok(rig) = RigFile::parse(text, "rig.toml") {
        assert_eq!(RigFile::parse(&rig.to_toml(), "rig.toml").as_ref(), Ok(&rig));
    }
});
