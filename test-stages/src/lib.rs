//! What tests of several packages share. They run in two stages: `cargo test` is to end in a minute, so it takes a part of what is statistical or builds the firmware;
//! with `POSITIONER_TESTS=all` the same tests run in full, as `.ci/run` does.
#![forbid(unsafe_code)]

pub mod firmware;

use std::io::Write as _;

/// Whether everything is asked for.
pub fn all() -> bool {
    std::env::var_os("POSITIONER_TESTS").is_some_and(|which| which == "all")
}

/// How many cases of a test run: `full` where everything is asked for, else `part`.
pub fn of(full: usize, part: usize) -> usize {
    if all() { full } else { part }
}

/// Says that a test is skipped and why, past the test runner, which shows nothing of a test that passes.
pub fn skipped(test: &str, why: &str) {
    // Where standard error is closed nobody can be told.
    let _ = writeln!(std::io::stderr(), "skipped: {test}: {why}");
}

/// Whether a test that is too long for `cargo test` runs. Says so where it does not.
pub fn runs_long(test: &str) -> bool {
    if !all() {
        skipped(test, "it takes minutes: .ci/run does it, and POSITIONER_TESTS=all");
    }
    all()
}
