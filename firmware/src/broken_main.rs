//! The same firmware as `main.rs` with a fault on purpose, see `broken.rs`.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod broken;
#[cfg(target_os = "none")]
mod commands;
#[cfg(target_os = "none")]
mod faults;
#[cfg(target_os = "none")]
mod guard;
#[cfg(target_os = "none")]
mod ring;
#[cfg(target_os = "none")]
mod sampling;
#[cfg(target_os = "none")]
mod start;
#[cfg(target_os = "none")]
mod storage;
#[cfg(target_os = "none")]
mod supervisor;
#[cfg(target_os = "none")]
mod telemetry;

#[cfg(not(target_os = "none"))]
fn main() {}
