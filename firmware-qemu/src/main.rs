//! The firmware's control loop under QEMU, in lock-step with a plant on the desktop.
//!
//! Codes come in and go out through two pipes by semihosting; telemetry is defmt on standard output. With
//! `-icount shift=6` every instruction takes 64 ns of guest time, so that SysTick counts instructions: a cost per tick that
//! does not depend on the machine that runs QEMU.
#![cfg_attr(target_os = "none", no_std)]
#![cfg_attr(target_os = "none", no_main)]

#[cfg(target_os = "none")]
mod guest;

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!(
        "This program runs under QEMU: `POSITIONER_TESTS=all cargo test -p scenarios --test qemu` builds and runs it."
    );
}
