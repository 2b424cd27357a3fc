//! NUCLEO-G474RE (MB1367): STM32G474RET6, ST-LINK/V3E on board.
//!
//! | signal | pin | Arduino | peripheral |
//! | --- | --- | --- | --- |
//! | piston position | PA0 | A0 | ADC1_IN1 |
//! | pressure of chamber A | PA1 | A1 | ADC1_IN2 |
//! | pressure of chamber B | PC1 | A4 | ADC1_IN7 |
//! | supply pressure | PC0 | A5 | ADC1_IN6 |
//! | valve command | PA4 | A2 | DAC1_OUT1, read back by ADC2_IN17 |
//! | air allowed | PB0 | A3 | output, low after reset |
//! | alive light | PA5 | D13 | LD2 |
//! | commands | PA2, PA3 | D1, D0 | LPUART1, the ST-LINK's virtual COM port |
//!
//! PA2 and PA3 belong to the virtual COM port, which is why p_b and p_sup sit on A4 and A5.

use embassy_stm32::adc::AdcChannel;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::{bind_interrupts, interrupt, peripherals};

use super::stm32g474::{Board, Chip, SerialBuffers, serial_config, start_clocks};

/// Told to whoever asks.
pub(crate) const NAME: &str = "nucleo-g474re";

bind_interrupts!(struct Interrupts {
    LPUART1 => usart::BufferedInterruptHandler<peripherals::LPUART1>;
});

/// Sets up everything on the board.
pub(crate) fn start(buffers: &'static mut SerialBuffers) -> Board {
    let p = start_clocks(interrupt::LPUART1);
    let (transmit, receive) = (&mut buffers.transmit, &mut buffers.receive);
    let serial = BufferedUart::new(p.LPUART1, p.PA3, p.PA2, transmit, receive, Interrupts, serial_config())
        .expect("115200 baud divides the peripheral clock");
    Board::assemble(
        Chip { adc: p.ADC1, read_back: p.ADC2, valve_pin: p.PA4.degrade_adc(), flash: p.FLASH },
        [p.PA0.degrade_adc(), p.PA1.degrade_adc(), p.PC1.degrade_adc(), p.PC0.degrade_adc()],
        serial,
        Output::new(p.PA5, Level::Low, Speed::Low),
        Output::new(p.PB0, Level::Low, Speed::Low),
    )
}
