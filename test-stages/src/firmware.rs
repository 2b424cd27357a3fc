//! The firmware as a file: built on demand, for tests of several packages.

use std::path::{Path, PathBuf};
use std::process::Command;

const TARGET: &str = "thumbv7em-none-eabihf";
const PROFILE: &str = "firmware";

/// Builds a package for the microcontroller, as `cargo fw` does, and returns its ELF file.
///
/// # Errors
/// Nobody asked for tests that take minutes, or the target is not installed: then tests are skipped with this sentence.
///
/// # Panics
/// The package does not build.
pub fn build_for_target(package: &str) -> Result<PathBuf, String> {
    build(package, &[])
}

/// Builds the firmware that has a fault to be chosen.
///
/// # Errors
/// As [`build_for_target`].
///
/// # Panics
/// It does not build.
pub fn build_broken() -> Result<PathBuf, String> {
    build("firmware", &["--bin", "firmware-broken", "--features", "broken"])
}

fn build(package: &str, more: &[&str]) -> Result<PathBuf, String> {
    if !crate::all() {
        return Err("it builds the firmware, which takes minutes: .ci/run does, and POSITIONER_TESTS=all".into());
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let sysroot = Command::new("rustc").args(["--print", "sysroot"]).current_dir(&root).output();
    let sysroot = sysroot.map_err(|error| format!("rustc cannot be run: {error}"))?;
    let library = PathBuf::from(String::from_utf8_lossy(&sysroot.stdout).trim()).join("lib/rustlib").join(TARGET);
    if !library.is_dir() {
        return Err(format!("the target {TARGET} is not installed (rustup target add {TARGET})"));
    }
    let built = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .args(["build", "--quiet", "--profile", PROFILE, "-p", package, "--target", TARGET])
        .args(more)
        // It would override the profile, and other code be tested than a board is flashed with.
        .env_remove("CARGO_INCREMENTAL")
        .current_dir(&root)
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_ENCODED_RUSTFLAGS")
        .status()
        .map_err(|error| format!("cargo cannot be run: {error}"))?;
    // Not a reason to skip: a guest that does not build is a failure.
    assert!(
        built.success(),
        "{package} does not build: cargo build --profile {PROFILE} -p {package} --target {TARGET}"
    );
    let target_dir = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from);
    let file = if let [_, binary, ..] = more { binary } else { package };
    Ok(target_dir.join(TARGET).join(PROFILE).join(file))
}
