//! What the firmware needs from a board.
//!
//! A board is one file: its name and `start`, which knows pins, light and serial port. What the chip gives stands in
//! `stm32g474.rs`. The cargo feature `b-g474e-dpow1` selects that kit instead of the Nucleo; a board with another chip
//! is one more chip file with the same items and that chip's feature of `embassy-stm32` (two chips cannot be built in
//! one call).
//!
//! | item | contract |
//! | --- | --- |
//! | `valve_to_mid_at_once()` | valve output to mid from any context, peripherals in any state, no stack to speak of |
//! | `start_watchdog()`, `feed_watchdog()` | counting from the first on, before clocks and peripherals; cannot be stopped |
//! | `air_off_at_once()` | air output low from any context, once it is an output |
//! | `start(buffers)` | clocks up, pins set, interrupt priorities set; the valve stays at mid |
//! | `Sampler` | one timer paces converter and valve output; `read` in the end-of-sequence interrupt |
//! | `Valve` | `set(code)` takes effect at the next tick, exactly; `seen` tells what the output shows in this one |
//! | `reset_cause()` | why the chip started |
//! | `reset_by_software()` | the same, only whether the firmware asked for it; may be asked any time before |
//! | `jump_to_bootloader()` | into the chip's ROM, from a chip that has just been reset |

#[cfg(feature = "b-g474e-dpow1")]
mod b_g474e_dpow1;
#[cfg(not(feature = "b-g474e-dpow1"))]
mod nucleo_g474re;
mod stm32g474;

#[cfg(feature = "b-g474e-dpow1")]
pub(crate) use b_g474e_dpow1::{NAME, start};
#[cfg(not(feature = "b-g474e-dpow1"))]
pub(crate) use nucleo_g474re::{NAME, start};
pub(crate) use stm32g474::{
    PARAMETER_FLASH, ResetCause, Sampler, SerialBuffers, Valve, air_off_at_once, feed_watchdog, jump_to_bootloader,
    reset, reset_by_software, reset_cause, start_watchdog, valve_to_mid_at_once,
};
