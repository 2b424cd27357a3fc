//! The scenario files, and tests by their names.

use crate::{Outcome, Scenario};
use std::path::{Path, PathBuf};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios")
}

/// All scenario files, by name.
///
/// # Panics
/// Where the folder cannot be read.
#[must_use]
pub fn files() -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(folder()).expect("scenarios").map(|entry| entry.expect("an entry").path()).collect();
    files.sort();
    files
}

/// The name of a scenario file: without folder and ending.
///
/// # Panics
/// For a path that ends in no file.
#[must_use]
pub fn name(file: &Path) -> String {
    file.file_stem().expect("a name").to_string_lossy().into_owned()
}

/// The scenario of this name.
///
/// # Panics
/// Where its file cannot be read, with what is wrong.
#[must_use]
pub fn named(name: &str) -> Scenario {
    Scenario::read(&folder().join(format!("{name}.toml"))).unwrap_or_else(|error| panic!("{error}"))
}

/// # Panics
/// Where an expectation of the scenario is not fulfilled, with all that are not.
pub fn assert_fulfilled(scenario: &Scenario, outcome: &Outcome) {
    let complaints = scenario.complaints(outcome);
    assert!(complaints.is_empty(), "{}: {}\n{outcome:?}", scenario.name, complaints.join("; "));
}

/// # Panics
/// Unless there is one name for each scenario file.
pub fn assert_complete<'n>(names: impl IntoIterator<Item = &'n str>) {
    let mut names: Vec<&str> = names.into_iter().collect();
    names.sort_unstable();
    let files: Vec<String> = files().iter().map(|file| name(file)).collect();
    assert_eq!(files, names);
}

/// A test for each name, which calls a function with it; `NAMES` is the list.
#[macro_export]
macro_rules! tests_by_name {
    ($function:ident: $($name:ident),+ $(,)?) => {
        $(#[test] fn $name() { $function(stringify!($name)); })+
        const NAMES: &[&str] = &[$(stringify!($name)),+];
    };
}
