//! What a board must show of itself, asked over the serial line: one description of the checks for a board on the table and for
//! the emulated one, so that they are known to work before there is a board.
//!
//! The firmware under test is the one that ships, and nothing is linked into it: what the checks find is true of the very bytes
//! that control a rig. (A test harness on the chip, such as embedded-test, would run another program.)
//!
//! | idea | file |
//! | --- | --- |
//! | a board, however it is reached | `bench.rs` |
//! | the checks, one file each | `checks/` |
//! | the board on the table | `table.rs` |
//! | the emulated board | `emulated.rs` |
//! | the bootloader in ROM, for tests of updates | `rom_model.rs` |
//!
//! `POSITIONER_PORT=/dev/ttyACM0 cargo test -p board-tests -- --nocapture` runs them on a board.

pub mod bench;
pub mod checks;
pub mod emulated;
pub mod rom_model;
pub mod table;

pub use bench::{Bench, Failure, Outcome, Session};
pub use checks::{CHECKS, Check};
