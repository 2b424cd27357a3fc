//! A Cortex-M4F with the peripherals of the STM32G474 that the firmware uses: it runs the very bytes that a probe would flash,
//! inside a test, without a board.
//!
//! Time is counted in cycles and never taken from the host: a run repeats exactly. What is not modelled ends the run with
//! address, instruction and peripheral. What is modelled, and what is assumed, stands in `docs/emulator.md`.
//!
//! | module | contents |
//! | --- | --- |
//! | [`core`] | registers, instructions, exceptions, interrupt controller |
//! | [`memory`] | memory map, clocks, triggers, interrupt lines |
//! | [`peripherals`] | one file each |
//! | [`analog`] | what a test puts at the analog pins |
//! | [`machine`] | power, resets, the run |
//! | [`rtt`] | the log block in RAM |
#![forbid(unsafe_code)]

pub mod analog;
pub mod core;
pub mod machine;
pub mod memory;
pub mod peripherals;
pub mod rtt;
pub mod time;
