//! The check value of what stands in flash.

use crc::{CRC_32_ISCSI, Crc};

/// Of a set, of its seal, and of the parameters that learned values belong to.
pub(crate) const CHECK: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);
