//! The positioner on a microcontroller: hardware timer → converter → control interrupt → valve.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod faults;
#[cfg(target_os = "none")]
mod sampling;
#[cfg(target_os = "none")]
mod start;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "This program runs on a NUCLEO-G474RE. Build it with `cargo fw`, flash it with `cargo flash-g4`;\n\
         `cargo run` without arguments shows the control loop in simulation."
    );
}
