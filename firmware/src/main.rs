//! The positioner on a microcontroller: hardware timer → converter → control interrupt → valve.
//!
//! ```text
//!        TIM6 update ──┬──► DAC latches the code of the previous tick ──► valve
//!                      └──► ADC: position, p_a, p_b, p_sup ──► interrupt (sampling.rs)
//!                                                                │ ▲
//!                             records (lock-free queue) ◄────────┘ └──── orders (lock-free queue)
//!                                   │                                      ▲
//!   thread executor:   telemetry.rs ▼ defmt over RTT        commands.rs ───┘ LPUART1, storage.rs
//!                      supervisor.rs: watchdog, light
//! ```
//!
//! What is computed lives in the crate `firmware-core` and runs on the desktop too; this package holds what only the
//! chip has.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
mod board;
#[cfg(target_os = "none")]
mod bootloader;
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
fn main() {
    eprintln!(
        "This program runs on a NUCLEO-G474RE. Build it with `cargo fw`, flash it with `cargo flash-g4`;\n\
         `cargo run` without arguments shows the control loop in simulation."
    );
}
