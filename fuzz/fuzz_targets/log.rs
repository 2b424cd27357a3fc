#![no_main]
//! Any bytes as a log: a log that writes and reads back the same number of rows, or an error.
use libfuzzer_sys::fuzz_target;
use rig_files::Log;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(log) = Log::parse(bytes.to_vec(), "log.csv") {
        let _ = log.gaps();
        let again = Log::parse(log.to_csv().into_bytes(), "log.csv");
        assert_eq!(again.map(|again| again.len()), Ok(log.len()));
    }
});
