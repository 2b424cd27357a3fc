//! What the firmware needs from a board, and the one board there is.
//!
//! A board is one module with the same public items as [`nucleo_g474re`]: a second board is a second file, a cargo
//! feature that selects it here, and that chip's feature of `embassy-stm32` (two chips cannot be built in one call).
//!
//! | item | contract |
//! | --- | --- |
//! | `valve_to_mid_at_once()` | valve output to mid from any context, peripherals in any state, no stack to speak of |
//! | `Board::start(p)` | clocks up, pins set, interrupt priorities set; the valve stays at mid |
//! | `Sampler` | one timer paces converter and valve output; `read` in the end-of-sequence interrupt |
//! | `Valve` | `set(code)` takes effect at the next tick, exactly; `hold_mid` at once |
//! | `reset_cause()` | why the chip started |

mod nucleo_g474re;
pub(crate) use nucleo_g474re::*;
