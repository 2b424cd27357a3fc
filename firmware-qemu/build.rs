//! Hands the linker its scripts. Nothing is passed on the desktop, where this package is an empty program.

use std::{env, fs, path::PathBuf};

fn main() {
    println!("cargo:rerun-if-changed=qemu.x");
    if env::var("CARGO_CFG_TARGET_OS").as_deref() != Ok("none") {
        return;
    }
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    fs::copy("qemu.x", out.join("qemu.x")).expect("qemu.x stands beside build.rs");
    println!("cargo:rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tqemu.x", "-Tdefmt.x"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
