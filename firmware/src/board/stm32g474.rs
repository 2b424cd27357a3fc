//! The STM32G474 as this firmware uses it: one timer for converter and valve, DAC, clocks, watchdog, flash.
//!
//! # Timing contract
//! TIM6 paces everything. Its update event (TRGO) does two things in hardware, in the same clock cycle: it latches
//! the valve code written during the *previous* tick into the DAC, and it starts the conversion of the four channels.
//! The end-of-sequence interrupt computes the next code. So the valve answers a sample exactly one tick later,
//! whatever the interrupt's own jitter is, as long as it finishes before the next update; if it does not, the update
//! flag is found set ([`Sampler::overran`]) and the supervisor hears of it.
//!
//! Conversion time: 4 channels × 16-fold oversampling × (12.5 + 12.5) cycles at 42.5 MHz = 37.6 µs, of a tick of
//! 1000 µs (100 µs at 10 kHz). Position is sampled first, and the channels are 9.4 µs apart.

use embassy_stm32::adc::{Adc, AdcConfig, AnyAdcChannel, Exten, SampleTime};
use embassy_stm32::flash::{Async, Flash};
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::{Peri, Peripherals, bind_interrupts, flash, pac, peripherals, triggers};
use firmware_core::{OutputSeen, code_of_sum};

use crate::broken::{self, Fault};

/// Core clock. 170 MHz is the most the G474 runs at, in range 1 boost mode (DS12288, table 17).
pub(crate) const CORE_HZ: u32 = 170_000_000;

/// The tick timer counts at a quarter of the core clock: 1 kHz (42 500 counts) fits its 16 bits, and every
/// divisor of 42.5 MHz up to 10 kHz is exact.
const TICK_TIMER_HZ: u32 = CORE_HZ / 4;

/// Slowest tick the 16-bit timer can pace at 42.5 MHz, rounded up.
pub(crate) const SLOWEST_TICK_HZ: u32 = 650;
/// Fastest tick: conversion (37.6 µs) and control must fit into it.
pub(crate) const FASTEST_TICK_HZ: u32 = 10_000;

/// DAC code at mid: 4095/2 rounded up, 1.65 V, 0.2 mV from the exact middle.
const MID_CODE: u16 = 2048;
/// DAC1 channel 1 (PA4) has index 0 in the register arrays.
const VALVE_CHANNEL: usize = 0;
/// TIM6_TRGO as trigger of DAC1 (RM0440, table "DAC1 interconnection": dac_ch1_trg7).
const DAC_TRIGGER_TIM6: u8 = 7;

/// Watchdog period in counts of 32 kHz / 4: 20 ms. The LSI runs at 32 kHz ± 5 %, so the true period is 19 to 21 ms, a little
/// more when hot: a dead core releases the valve to its hardware mid position within about 22 ms.
const WATCHDOG_COUNTS: u16 = 160;

/// First byte of the parameter storage, as an offset into flash, and its end: the last 8 KiB of bank 2.
pub(crate) const PARAMETER_FLASH: core::ops::Range<u32> = 0x0007_E000..0x0008_0000;

/// Shortest conversion of the sequence in counts of the tick timer, which runs at the converter's own clock:
/// 4 × 16 × 25 cycles. (The trigger adds a few; they make the bound safe.)
const CONVERSION_COUNTS: u16 = 4 * 16 * 25;

/// Oversampling ratio 16 without shift makes sums 0..=65 520 of the converter's 0..=4095.
const OVERSAMPLING_16: u8 = 3;

/// Puts the valve at mid at once, whatever state the chip is in: usable as the first statement of `main` and as the
/// last act of a fault handler.
///
/// The order matters: the code is written *before* the channel is enabled, so that the pin goes from
/// high impedance (held at mid by the output stage's bias resistors) to mid without passing 0 V, which is full stroke.
pub(crate) fn valve_to_mid_at_once() {
    pac::RCC.ahb2enr().modify(|w| w.set_dac1en(true));
    // The peripheral needs two clock cycles after its clock is enabled (RM0440, 7.2.17); a read back waits them out.
    let _ = pac::RCC.ahb2enr().read();
    let dac = pac::DAC1;
    // Without the trigger the code passes to the output within one bus cycle.
    dac.cr().modify(|w| w.set_ten(VALVE_CHANNEL, false));
    dac.dhr12r(VALVE_CHANNEL).write(|w| w.set_dhr(MID_CODE));
    if !dac.cr().read().en(VALVE_CHANNEL) {
        dac.mcr().modify(|w| {
            // Buffer off: the buffered output cannot come within 0.2 V of the rails (DS12288, DAC characteristics),
            // which would cost a tenth of the valve's range. The output stage's input is high impedance instead.
            w.set_mode(VALVE_CHANNEL, pac::dac::vals::Mode::NORMAL_EXT_BUFDIS);
            // The bus will run above 160 MHz (RM0440, HFSEL = 10).
            w.set_hfsel(2);
        });
        dac.cr().modify(|w| w.set_en(VALVE_CHANNEL, true));
    }
}

/// Starts the watchdog, before anything is waited for: a clock or a converter that never becomes ready ends in a reset, too. By
/// registers, because the driver needs what `embassy_stm32::init` returns.
pub(crate) fn start_watchdog() {
    use pac::iwdg::vals::{Key, Pr};
    let watchdog = pac::IWDG;
    watchdog.kr().write(|w| w.set_key(Key::START));
    watchdog.kr().write(|w| w.set_key(Key::ENABLE));
    watchdog.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    watchdog.rlr().write(|w| w.set_rl(WATCHDOG_COUNTS - 1));
    // The registers take effect after some cycles of the LSI (RM0440, 42.4.5), 0.2 ms; the core runs at 16 MHz still, and a turn
    // takes more than 4 cycles. An LSI that stands still must not stop the start; the supervisor's feeding loads the period, too.
    for _ in 0..800 {
        if watchdog.sr().read().0 == 0 {
            break;
        }
    }
    feed_watchdog();
}

/// Another 20 ms.
pub(crate) fn feed_watchdog() {
    pac::IWDG.kr().write(|w| w.set_key(pac::iwdg::vals::Key::RESET));
}

/// No air any more, whoever owns the output: PB0 on every board so far.
pub(crate) fn air_off_at_once() {
    pac::GPIOB.bsrr().write(|w| w.set_br(0, true));
}

/// Why the chip started, read from RCC_CSR. Reading clears the flags, so this is called once.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub(crate) enum ResetCause {
    /// Power came up, or the reset button, or the debugger.
    PowerOrPin,
    /// The independent watchdog was not fed.
    Watchdog,
    /// The firmware asked for it: after a panic or fault, or by command.
    Software,
    /// Option bytes, low power, window watchdog: none of them is used here.
    Other,
}

/// Reads and clears the reset flags.
pub(crate) fn reset_cause() -> ResetCause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    // The pin flag is set by every internal reset too, so it decides last.
    if flags.iwdgrstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.borrstf() || flags.pinrstf() {
        ResetCause::PowerOrPin
    } else {
        ResetCause::Other
    }
}

/// Whether the firmware asked for the last reset; leaves the flags as they are.
pub(crate) fn reset_by_software() -> bool {
    pac::RCC.csr().read().sftrstf()
}

/// The bootloader in ROM (AN2606: system memory of the STM32G4). It listens at USART2 among others, which has the pins of the
/// virtual COM port, and knows nothing of the valve: the pin is high impedance, and PB0 an input, as after any reset.
const BOOTLOADER: u32 = 0x1FFF_0000;

/// Leaves for the ROM. The chip must be as a reset leaves it, the watchdog included: it could not be stopped.
pub(crate) fn jump_to_bootloader() -> ! {
    // As the boot pins would have it: the ROM at address 0.
    pac::RCC.apb2enr().modify(|w| w.set_syscfgen(true));
    let _ = pac::RCC.apb2enr().read();
    pac::SYSCFG.memrmp().modify(|w| w.set_mem_mode(1));
    // SAFETY: nothing else runs, no interrupt is enabled, and the ROM holds a vector table.
    unsafe {
        (*cortex_m::peripheral::SCB::PTR).vtor.write(BOOTLOADER);
        cortex_m::asm::bootload(BOOTLOADER as *const u32)
    }
}

bind_interrupts!(struct Interrupts {
    FLASH => flash::InterruptHandler;
});

/// Everything on a board, each part ready to be given to the module that owns it.
pub(crate) struct Board {
    /// Timer and converter.
    pub(crate) sampler: Sampler,
    /// Valve output.
    pub(crate) valve: Valve,
    /// Virtual COM port.
    pub(crate) serial: BufferedUart<'static>,
    /// Flash that holds the parameters.
    pub(crate) flash: Flash<'static, Async>,
    /// Shows the state.
    pub(crate) light: Output<'static>,
    /// Air allowed: high in idle, in run and in a controlled stop alone. For a dump valve.
    pub(crate) air: Output<'static>,
}

/// Serial buffers: one frame each way and some.
pub(crate) struct SerialBuffers {
    /// To the host.
    pub(crate) transmit: [u8; 256],
    /// From the host.
    pub(crate) receive: [u8; 256],
}

/// What the boards do not differ in.
pub(crate) struct Chip {
    /// Converts the four channels.
    pub(crate) adc: Peri<'static, peripherals::ADC1>,
    /// Reads the valve's pin back.
    pub(crate) read_back: Peri<'static, peripherals::ADC2>,
    /// That pin: output of the DAC, and input 17 of this converter (DS12288, table of pins).
    pub(crate) valve_pin: AnyAdcChannel<'static, peripherals::ADC2>,
    /// Holds the parameters.
    pub(crate) flash: Peri<'static, peripherals::FLASH>,
}

/// Sets up clocks, and interrupt priorities with `serial` as the board's serial interrupt. The valve is at mid before and
/// after.
pub(crate) fn start_clocks(serial: interrupt::Interrupt) -> Peripherals {
    let p = embassy_stm32::init(clocks());
    // Sampling preempts everything; the rest shares the lowest urgency.
    let [first, rest] =
        if broken::is(Fault::Priority) { [Priority::P8, Priority::P0] } else { [Priority::P0, Priority::P8] };
    interrupt::ADC1_2.set_priority(first);
    for other in [interrupt::TIM2, serial, interrupt::FLASH] {
        other.set_priority(rest);
    }
    p
}

/// Baud rate of the virtual COM port; the rest as by default: 8 data bits, no parity, 1 stop bit.
pub(crate) fn serial_config() -> usart::Config {
    let mut config = usart::Config::default();
    config.baudrate = 115_200;
    config
}

impl Board {
    /// Sets up the converter for position, p_a, p_b, p_sup, in this order, and puts the board together.
    pub(crate) fn assemble(
        chip: Chip,
        mut channels: [AnyAdcChannel<'static, peripherals::ADC1>; 4],
        serial: BufferedUart<'static>,
        light: Output<'static>,
        air: Output<'static>,
    ) -> Self {
        if broken::is(Fault::ChannelOrder) {
            channels.swap(2, 3);
        }
        // 12.5 cycles at 42.5 MHz give the sampling capacitor 294 ns: enough for the filter of docs/wiring.md, whose
        // 10 nF at the pin is a thousand times the 5 pF sampled.
        let time = SampleTime::CYCLES12_5;
        let adc = Adc::new(
            chip.adc,
            AdcConfig {
                oversampling_ratio: Some(OVERSAMPLING_16),
                oversampling_shift: Some(0),
                ..AdcConfig::default()
            },
        );
        // 640.5 cycles at 42.5 MHz, 15 us: the output has settled when they end, and the four channels take longer.
        let read_back = Adc::new(chip.read_back, AdcConfig::default());
        let pin = [(chip.valve_pin, SampleTime::CYCLES640_5)];
        // embassy-stm32 0.6 knows oversampling of regular conversions only.
        pac::ADC1.cfgr2().modify(|w| w.set_jovse(true));
        // The prescaler is loaded by an update, which is a trigger, too: before anybody listens.
        embassy_stm32::rcc::enable_and_reset::<peripherals::TIM6>();
        Sampler::set_clock();
        let injected = adc.setup_injected_conversions(
            channels.map(|channel| (channel, time)),
            triggers::TIM6_TRGO,
            Exten::RISING_EDGE,
            true,
        );
        let read_back = read_back.setup_injected_conversions(pin, triggers::TIM6_TRGO, Exten::RISING_EDGE, false);
        // Dropping a driver would stop its converter; from here on the interrupt reads the registers itself.
        core::mem::forget((injected, read_back));
        Self {
            sampler: Sampler { tick_counts: 0 },
            valve: Valve(()),
            serial,
            flash: Flash::new(chip.flash, Interrupts),
            light,
            air,
        }
    }
}

fn clocks() -> embassy_stm32::Config {
    use embassy_stm32::rcc::{Pll, PllMul, PllPreDiv, PllRDiv, PllSource, Sysclk, mux};
    let mut config = embassy_stm32::Config::default();
    // HSI 16 MHz / 4 × 85 / 2 = 170 MHz. The internal oscillator (1 %) is enough: no interface here needs a crystal,
    // and its failure mode, none, is the better one.
    config.rcc.pll = Some(Pll {
        source: PllSource::HSI,
        prediv: PllPreDiv::DIV4,
        mul: PllMul::MUL85,
        divp: None,
        divq: None,
        divr: Some(PllRDiv::DIV2),
    });
    config.rcc.sys = Sysclk::PLL1_R;
    config.rcc.boost = true;
    // 170 MHz / 4 = 42.5 MHz, below the converter's 60 MHz; the driver picks the divider.
    config.rcc.mux.adc12sel = mux::Adcsel::SYS;
    config
}

/// The tick: timer and converter.
pub(crate) struct Sampler {
    tick_counts: u16,
}

/// One end-of-sequence reading.
pub(crate) struct Sequence {
    /// Position, p_a, p_b, p_sup, 0..=65 535.
    pub(crate) codes: [u16; 4],
    /// The next conversion was under way while these were read: samples of two ticks may be mixed.
    pub(crate) mixed: bool,
    /// Core clock cycles since the last update of the timer.
    pub(crate) since_update: u32,
}

impl Sampler {
    /// Sets the tick rate; outside [`SLOWEST_TICK_HZ`]`..=`[`FASTEST_TICK_HZ`] it is limited.
    pub(crate) fn set_rate(&mut self, tick_hz: u32) {
        let counts = TICK_TIMER_HZ / tick_hz.clamp(SLOWEST_TICK_HZ, FASTEST_TICK_HZ);
        // 42.5 MHz / 650 Hz = 65 384: fits 16 bits.
        self.tick_counts = counts as u16;
        // Without preload, and with the timer standing still, the period is in force at once.
        pac::TIM6.arr().write(|w| w.set_arr((counts - 1) as u16));
    }

    /// Prescaler and trigger of the timer.
    fn set_clock() {
        let timer = pac::TIM6;
        timer.psc().write_value((CORE_HZ / TICK_TIMER_HZ - 1) as u16);
        timer.egr().write(|w| w.set_ug(true));
        timer.sr().write(|w| w.set_uif(false));
        timer.cr2().modify(|w| w.set_mms(pac::timer::vals::Mms::UPDATE));
    }

    /// Starts ticking; the interrupt fires from now on.
    pub(crate) fn start(&mut self) {
        // SAFETY: the interrupt's data is in place before the first tick; `sampling::start` is the only caller.
        unsafe { interrupt::ADC1_2.enable() };
        pac::TIM6.cr1().modify(|w| w.set_cen(true));
    }

    /// Reads the finished sequence and acknowledges it. For the end-of-sequence interrupt only.
    #[inline(always)]
    pub(crate) fn read(&mut self) -> Sequence {
        // The sequence ends CONVERSION_COUNTS after the update. A smaller count is one of the next period.
        let count = pac::TIM6.cnt().read().cnt();
        let mixed = count < CONVERSION_COUNTS;
        pac::TIM6.sr().write(|w| w.set_uif(false));
        let adc = pac::ADC1;
        // Written out: in a loop the register index would be checked at run time, and a panic linked in.
        let raw = [adc.jdr(0), adc.jdr(1), adc.jdr(2), adc.jdr(3)].map(|rank| rank.read().jdata());
        // Only the injected flags: the driver's read-modify-write would also clear flags nobody has looked at.
        adc.isr().write(|w| {
            w.set_jeos(true);
            w.set_jeoc(true);
        });
        if broken::is(Fault::NoRetrigger) {
            adc.cr().modify(|w| w.set_jadstp(pac::adc::vals::Adstp::STOP));
        }
        let since_update = u32::from(count) * (CORE_HZ / TICK_TIMER_HZ);
        Sequence { codes: raw.map(code_of_sum), mixed, since_update }
    }

    /// Whether the next tick has begun since [`Sampler::read`]: the valve code of this one came too late.
    #[inline(always)]
    pub(crate) fn overran(&self) -> bool {
        pac::TIM6.sr().read().uif()
    }

    /// Core clock cycles per tick.
    pub(crate) fn cycles_per_tick(&self) -> u32 {
        u32::from(self.tick_counts) * (CORE_HZ / TICK_TIMER_HZ)
    }
}

/// The valve output. One instance exists; it belongs to the control interrupt.
pub(crate) struct Valve(());

impl Valve {
    /// From now on a code takes effect at the next tick, latched by the timer.
    pub(crate) fn latch_with_tick(&mut self) {
        pac::DAC1.cr().modify(|w| {
            w.set_tsel(VALVE_CHANNEL, DAC_TRIGGER_TIM6);
            w.set_ten(VALVE_CHANNEL, true);
        });
    }

    /// What the output shows, and acknowledges that. For the end-of-sequence interrupt only.
    #[inline(always)]
    pub(crate) fn seen(&mut self) -> OutputSeen {
        let adc = pac::ADC2;
        let converted = adc.isr().read().jeos();
        adc.isr().write(|w| {
            w.set_jeos(true);
            w.set_jeoc(true);
        });
        let pin = converted.then(|| adc.jdr(0).read().jdata());
        OutputSeen { latched: pac::DAC1.dor(VALVE_CHANNEL).read().dor(), pin }
    }

    /// Hands over a code, 0..=4095, for the next tick. Larger codes are limited, not truncated.
    #[inline(always)]
    pub(crate) fn set(&mut self, code: u16) {
        let code = if broken::is(Fault::DacCode) { code.saturating_add(1) } else { code };
        pac::DAC1.dhr12r(VALVE_CHANNEL).write(|w| w.set_dhr(code.min(4095)));
    }
}

/// Resets the chip. The valve pin goes to high impedance, and the output stage holds the valve at mid.
pub(crate) fn reset() -> ! {
    cortex_m::peripheral::SCB::sys_reset()
}
