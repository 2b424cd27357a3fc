//! The check value of what has to outlast a reset.

use crc::{CRC_32_ISCSI, Crc};

/// Of a set in flash, of its seal, of the parameters that learned values belong to, and of a note about a fault.
pub const CHECK: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);
