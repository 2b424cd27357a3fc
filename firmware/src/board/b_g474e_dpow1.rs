//! Discovery kit B-G474E-DPOW1 (MB1428): STM32G474RET6, ST-LINK/V3E on board. **Compiles; has never run on the board.**
//!
//! | signal | pin | peripheral |
//! | --- | --- | --- |
//! | piston position | PA0 | ADC1_IN1 |
//! | pressure of chamber A | PA1 | ADC1_IN2 |
//! | pressure of chamber B | PC1 | ADC1_IN7 |
//! | supply pressure | PC0 | ADC1_IN6 |
//! | valve command | PA4 | DAC1_OUT1 |
//! | air allowed | PB0 | output, low after reset |
//! | alive light | PB7 | LD4, green |
//! | commands | PC10, PC11 | USART3, the ST-LINK's virtual COM port |
//!
//! Light and virtual COM port are as NuttX has them (boards/arm/stm32/b-g474e-dpow1). The analogue pins are the Nucleo's;
//! which of them this kit's power converter already uses stands in its schematic: check before wiring.

use embassy_stm32::adc::AdcChannel;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::{bind_interrupts, interrupt, peripherals};

use super::stm32g474::{Board, Chip, SerialBuffers, serial_config, start_clocks};

/// Told to whoever asks.
pub(crate) const NAME: &str = "b-g474e-dpow1";

bind_interrupts!(struct Interrupts {
    USART3 => usart::BufferedInterruptHandler<peripherals::USART3>;
});

/// Sets up everything on the board.
pub(crate) fn start(buffers: &'static mut SerialBuffers) -> Board {
    let p = start_clocks(interrupt::USART3);
    let (transmit, receive) = (&mut buffers.transmit, &mut buffers.receive);
    let serial = BufferedUart::new(p.USART3, p.PC11, p.PC10, transmit, receive, Interrupts, serial_config())
        .expect("115200 baud divides the peripheral clock");
    Board::assemble(
        Chip { adc: p.ADC1, read_back: p.ADC2, valve_pin: p.PA4.degrade_adc(), flash: p.FLASH },
        [p.PA0.degrade_adc(), p.PA1.degrade_adc(), p.PC1.degrade_adc(), p.PC0.degrade_adc()],
        serial,
        Output::new(p.PB7, Level::Low, Speed::Low),
        Output::new(p.PB0, Level::Low, Speed::Low),
    )
}
