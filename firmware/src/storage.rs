//! The chip's flash as the home of the parameters.

use embassy_stm32::flash::{Async, Flash};
use embassy_stm32::pac;
use firmware_core::ParameterStore;

use crate::board;

/// The store in the last pages of bank 2.
pub(crate) type Store = ParameterStore<Flash<'static, Async>>;

/// Opens the store. `None` with a single bank: the option bytes forbid it.
pub(crate) fn open(flash: Flash<'static, Async>) -> Option<Store> {
    if two_banks() { ParameterStore::new(flash, board::PARAMETER_FLASH) } else { None }
}

/// Whether flash has two banks (option bit DBANK, set when the chip is delivered). With one bank, the numbers of pages mean
/// other pages: an erasure would hit the program. The driver asks in its blocking constructor alone.
pub(crate) fn two_banks() -> bool {
    pac::FLASH.optr().read().dbank()
}

/// A power cut in the midst of a write can leave a word whose check bits are wrong; reading it raises this exception
/// (RM0440, 3.3.4). The word reads as rubbish, which the store's own checksums reject, so there is nothing to do but to
/// acknowledge. Any other non-maskable interrupt is a fault.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    let status = pac::FLASH.eccr().read();
    if status.eccd() || status.eccd2() {
        pac::FLASH.eccr().write_value(status);
    } else {
        panic!("non-maskable interrupt without a flash error");
    }
}
