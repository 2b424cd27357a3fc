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

/// Two wrong bits in a double word of flash, or a wrong parity bit in RAM, raise this exception (RM0440, 3.3.4 and 2.4.2).
///
/// Among the parameters, a power cut in the midst of a write can leave such a word: it reads as rubbish, which the store's
/// check values reject, so there is nothing to do but to acknowledge. Anywhere else it is an instruction or a constant, and
/// nothing can be trusted any more: the panic's way, valve to mid and reset.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    let status = pac::FLASH.eccr().read();
    if status.eccd() && in_parameters(status) {
        pac::FLASH.eccr().write_value(status);
    } else if status.eccd() || status.eccd2() {
        panic!("two wrong bits in flash: ECCR {:#010x}", status.0);
    } else if pac::SYSCFG.cfgr2().read().spf() {
        panic!("wrong parity in RAM");
    } else {
        panic!("non-maskable interrupt without a flash error");
    }
}

/// Whether the wrong word stands in the parameters' pages. Bank 2 holds nothing else that is read. Within the bank, the
/// manual leaves open whether the address counts bytes or double words: both are accepted, and neither is program.
fn in_parameters(status: pac::flash::regs::Eccr) -> bool {
    const BANK_BYTES: u32 = 256 << 10;
    let pages = board::PARAMETER_FLASH.start - BANK_BYTES..board::PARAMETER_FLASH.end - BANK_BYTES;
    let address = status.addr_ecc();
    let there = pages.contains(&address) || pages.contains(&(address * 8));
    status.bk_ecc() && !status.sysf_ecc() && there
}
