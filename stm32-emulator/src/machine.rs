//! The chip as a whole: power, resets, the run.

use object::Object as _;
use object::read::elf::{FileHeader as _, ProgramHeader as _};

use crate::analog::Analog;
use crate::core::{Core, Sleep, Stop, Trap};
use crate::memory::{Chip, FLASH, RAM_BYTES};
use crate::peripherals::flash::FLASH_BYTES;
use crate::peripherals::rcc::ResetCause;
use crate::time::Time;

/// A core in its chip. A copy goes on from the same instant on its own.
#[derive(Clone)]
pub struct Machine<A> {
    /// The core.
    pub core: Core,
    /// Everything else.
    pub chip: Chip<A>,
    /// Resets since power-up, in order: when and why.
    pub resets: Vec<(Time, ResetCause)>,
    /// Units of time spent asleep.
    pub idle: Time,
}

/// A file that is no firmware for this chip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImageError(pub String);

impl std::fmt::Display for ImageError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for ImageError {}

/// Puts the loadable parts of an ELF file where a probe would flash them.
fn load(elf: &[u8], flash: &mut [u8]) -> Result<(), ImageError> {
    let fail = |what: &str| ImageError(format!("not an ELF file for this chip: {what}; build it with `cargo fw`"));
    type Header = object::elf::FileHeader32<object::Endianness>;
    let header = Header::parse(elf).map_err(|error| fail(&error.to_string()))?;
    let endian = header.endian().map_err(|error| fail(&error.to_string()))?;
    let segments = header.program_headers(endian, elf).map_err(|error| fail(&error.to_string()))?;
    let mut loaded = 0;
    for segment in segments {
        let data = segment.data(endian, elf).map_err(|()| fail("a segment lies outside the file"))?;
        if segment.p_type(endian) != object::elf::PT_LOAD || data.is_empty() {
            continue;
        }
        let start =
            segment.p_paddr(endian).checked_sub(FLASH).ok_or_else(|| fail("a segment lies below flash"))? as usize;
        let place = flash.get_mut(start..start + data.len()).ok_or_else(|| fail("a segment lies outside flash"))?;
        place.copy_from_slice(data);
        loaded += data.len();
    }
    if loaded == 0 { Err(fail("nothing to load")) } else { Ok(()) }
}

impl<A: Analog> Machine<A> {
    /// A chip with this firmware in its flash, just powered up.
    ///
    /// # Errors
    /// The file is not an ELF file for this chip.
    pub fn new(elf: &[u8], analog: A) -> Result<Self, ImageError> {
        object::File::parse(elf).map(|file| file.architecture()).map_err(|error| ImageError(error.to_string()))?;
        let mut chip = Chip::new(analog);
        load(elf, &mut chip.flash.bytes)?;
        let core = start(&mut chip)?;
        Ok(Self { core, chip, resets: Vec::new(), idle: 0 })
    }

    /// Starts anew with memory as it is.
    ///
    /// # Errors
    /// Flash holds no vector table.
    pub fn reset(self, cause: ResetCause) -> Result<Self, ImageError> {
        let mut resets = self.resets;
        resets.push((self.chip.now, cause));
        let instructions = self.core.instructions;
        let mut chip = self.chip.reset(cause);
        let mut core = start(&mut chip)?;
        core.instructions = instructions;
        Ok(Self { core, chip, resets, idle: self.idle })
    }

    /// The supply fails and returns: flash operations stop halfway, RAM is lost.
    ///
    /// # Errors
    /// Flash holds no vector table.
    pub fn power_cycle(mut self) -> Result<Self, ImageError> {
        self.chip.flash.cut();
        // What RAM holds then is not defined; a pattern that is not zero shows who relies on zero.
        self.chip.ram = vec![0xA5; RAM_BYTES];
        self.reset(ResetCause::PowerOn)
    }

    /// Runs until `end`. A reset by watchdog or firmware returns its cause early, before the chip starts anew:
    /// call [`Machine::reset`] with it.
    ///
    /// # Errors
    /// What happened is not modelled.
    pub fn run_until(&mut self, end: Time) -> Result<Option<ResetCause>, Stop> {
        while self.chip.now < end {
            if let Some(cause) = self.step(end)? {
                return Ok(Some(cause));
            }
        }
        Ok(None)
    }

    /// One instruction, or a jump over sleep to the next event or `end`.
    ///
    /// # Errors
    /// As [`Machine::run_until`].
    #[inline]
    pub fn step(&mut self, end: Time) -> Result<Option<ResetCause>, Stop> {
        let chip = &mut self.chip;
        if chip.rcc.clock_stopped {
            let bites_at = chip.iwdg.bites_at();
            chip.now = bites_at.min(end).max(chip.now);
            return Ok((chip.now >= bites_at).then_some(ResetCause::Watchdog));
        }
        if chip.now >= chip.next_event {
            chip.events();
        }
        if chip.now >= chip.iwdg.bites_at() {
            return Ok(Some(ResetCause::Watchdog));
        }
        let units = chip.rcc.units_per_cycle();
        if chip.system.attention {
            let entered = self.core.interrupts(chip).map_err(|trap| stop_at(&self.core, &trap))?;
            if let Some(exception) = entered {
                chip.now += u64::from(exception.cycles) * units;
                chip.system.cycles += u64::from(exception.cycles);
                return Ok(None);
            }
        }
        if self.core.asleep != Sleep::Awake {
            self.core.wake_by_event();
            if self.core.asleep != Sleep::Awake {
                let until = chip.next_event.min(chip.iwdg.bites_at()).min(end);
                // Whole cycles: the core wakes on its own clock.
                let cycles = until.saturating_sub(chip.now).div_ceil(units).max(1);
                chip.now += cycles * units;
                chip.system.cycles += cycles;
                self.idle += cycles * units;
                return Ok(None);
            }
        }
        let cycles = u64::from(self.core.step(chip)?);
        chip.now += cycles * units;
        chip.system.cycles += cycles;
        if chip.stalled_until > chip.now {
            let waited = (chip.stalled_until - chip.now).div_ceil(units);
            chip.now += waited * units;
            chip.system.cycles += waited;
        }
        Ok(chip.system.take_reset_request().then_some(ResetCause::Software))
    }
}

fn start<A: Analog>(chip: &mut Chip<A>) -> Result<Core, ImageError> {
    chip.system.vectors = FLASH;
    debug_assert_eq!(chip.flash.bytes.len(), FLASH_BYTES, "flash has its size");
    Core::reset(chip, FLASH).map_err(|trap| ImageError(format!("no vector table: {trap:?}")))
}

fn stop_at(core: &Core, trap: &Trap) -> Stop {
    let what = match trap {
        Trap::Unmodelled(what) => what.to_string(),
        other => format!("{other:?} while an exception was entered"),
    };
    Stop { instruction_at: core.pc, instruction: 0, what }
}
