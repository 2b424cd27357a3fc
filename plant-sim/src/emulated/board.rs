//! A running board: ticks, resets, serial bytes, log.

use super::EmulatedError;
use stm32_emulator::analog::Analog;
use stm32_emulator::machine::{Machine, Pause, Watch};
use stm32_emulator::peripherals::rcc::ResetCause;
use stm32_emulator::rtt;
use stm32_emulator::time::{Time, from_seconds};

/// The control interrupt: exception 16 plus interrupt 18 (ADC1 and ADC2).
const CONTROL_INTERRUPT: u32 = 34;

/// The machine is there whenever the board is used.
const THERE: &str = "only a reset takes it, and puts it back";

/// How often the log in RAM is emptied: its kilobyte lasts longer at any rate of telemetry.
const LOG_EVERY_S: f64 = 0.002;

/// What one control interrupt did up to the write of the valve code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tick {
    /// When the code was written.
    pub written: Time,
    /// When the handler's first instruction had run.
    pub entered: Time,
    /// Instructions and cycles from there to the write.
    pub instructions: u64,
    /// Cycles of the same.
    pub cycles: u64,
    /// The code; the timer hands it to the pin with the next tick.
    pub code: u16,
}

/// What ended a stretch of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// The first instruction of the control interrupt has run.
    Entered,
    /// The control interrupt has written a valve code.
    Wrote(Tick),
    /// The chip was reset and has started anew.
    Reset(ResetCause),
    /// The time is up.
    Time,
}

/// A chip with firmware, running.
pub struct Board<A> {
    /// Only a reset takes it, and puts it back.
    machine: Option<Machine<A>>,
    /// Where the control interrupt that runs began: time, instructions, cycles.
    entered: Option<(Time, u64, u64)>,
    /// The control interrupt, the lowest stack pointer, and when the log is next emptied.
    watch: Watch,
    log: Vec<u8>,
    ticks: u64,
}

impl<A: Analog> Board<A> {
    /// A board with this firmware in its flash, just powered up.
    ///
    /// # Errors
    /// The file is no firmware for this chip.
    pub fn power_up(elf: &[u8], analog: A) -> Result<Self, EmulatedError> {
        let machine = Machine::new(elf, analog)?;
        let watch = Watch { exception: CONTROL_INTERRUPT, pause_at: 0, lowest_stack: machine.core.r[13] };
        Ok(Self { machine: Some(machine), entered: None, watch, log: Vec::new(), ticks: 0 })
    }

    /// The machine inside.
    ///
    /// # Panics
    /// Never: a reset that fails is an error, after which the board is gone.
    pub fn machine(&mut self) -> &mut Machine<A> {
        self.machine.as_mut().expect(THERE)
    }

    /// What stands at the analog pins.
    pub fn analog(&mut self) -> &mut A {
        &mut self.machine().chip.analog
    }

    /// Simulated time.
    pub fn now(&mut self) -> Time {
        self.machine().chip.now
    }

    /// Valve codes written since power-up.
    #[must_use]
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// The lowest stack pointer so far.
    #[must_use]
    pub fn lowest_stack(&self) -> u32 {
        self.watch.lowest_stack
    }

    /// Runs until something happens, or until `end`. A reset has been carried out when it is reported.
    ///
    /// # Errors
    /// The firmware did what is not modelled.
    pub fn advance(&mut self, end: Time) -> Result<Event, EmulatedError> {
        loop {
            let machine = self.machine.as_mut().expect(THERE);
            let pause = machine.run_watching(end, &mut self.watch)?;
            let now = machine.chip.now;
            let (instructions, cycles) = (machine.core.instructions, machine.chip.system.cycles);
            let code = machine.chip.dac.holding();
            if now >= self.watch.pause_at {
                self.drain();
            }
            match (pause, self.entered) {
                (Pause::Time, _) => return Ok(Event::Time),
                (Pause::Due, _) | (Pause::Wrote, None) => {}
                (Pause::Reset(cause), _) => {
                    self.reset(cause)?;
                    return Ok(Event::Reset(cause));
                }
                (Pause::Left, _) => self.entered = None,
                (Pause::Entered, _) => {
                    self.entered = Some((now, instructions, cycles));
                    return Ok(Event::Entered);
                }
                (Pause::Wrote, Some((entered, first, begun))) => {
                    self.ticks += 1;
                    return Ok(Event::Wrote(Tick {
                        written: now,
                        entered,
                        instructions: instructions - first,
                        cycles: cycles - begun,
                        code,
                    }));
                }
            }
        }
    }

    /// Lets time pass. Resets happen as they come.
    ///
    /// # Errors
    /// As [`Board::advance`].
    pub fn run(&mut self, seconds: f64) -> Result<(), EmulatedError> {
        let end = self.now() + from_seconds(seconds);
        while self.advance(end)? != Event::Time {}
        Ok(())
    }

    fn reset(&mut self, cause: ResetCause) -> Result<(), EmulatedError> {
        let machine = self.machine.take().ok_or_else(|| EmulatedError::Other("the chip is gone".into()))?;
        self.machine = Some(machine.reset(cause)?);
        self.entered = None;
        Ok(())
    }

    /// The supply fails and returns.
    ///
    /// # Errors
    /// Flash holds no firmware any more.
    pub fn power_cycle(&mut self) -> Result<(), EmulatedError> {
        self.drain();
        let machine = self.machine.take().ok_or_else(|| EmulatedError::Other("the chip is gone".into()))?;
        self.machine = Some(machine.power_cycle()?);
        self.entered = None;
        Ok(())
    }

    /// Puts bytes on the serial line to the board.
    pub fn send(&mut self, bytes: &[u8]) {
        self.machine().chip.send(bytes);
    }

    /// What the board has sent over the serial line since the last call.
    pub fn take_sent(&mut self) -> Vec<u8> {
        self.machine().chip.lpuart.take_sent()
    }

    /// What the firmware has logged since the last call: the raw stream that a debug probe would read.
    pub fn take_log(&mut self) -> Vec<u8> {
        self.drain();
        std::mem::take(&mut self.log)
    }

    fn drain(&mut self) {
        let taken = rtt::take(self.machine()).unwrap_or_default();
        self.log.extend(taken);
        self.watch.pause_at = self.now() + from_seconds(LOG_EVERY_S);
    }
}
