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

/// What a run looks out for, and has noted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watch {
    /// The number of an exception: when its handler is entered, left, or writes the valve's output, the run pauses.
    pub exception: u32,
    /// The run pauses at the first instruction that ends then or later.
    pub pause_at: Time,
    /// The lowest stack pointer so far.
    pub lowest_stack: u32,
}

/// Why a watched run paused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pause {
    /// By watchdog or firmware, before the chip starts anew: call [`Machine::reset`] with the cause.
    Reset(ResetCause),
    /// The first instruction of the handler has run.
    Entered,
    /// The handler has returned, or another one interrupts it.
    Left,
    /// The handler has written the valve's output.
    Wrote,
    /// [`Watch::pause_at`] is reached.
    Due,
    /// The time is up.
    Time,
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

    /// Runs until `end`, or until something happens that is watched for.
    ///
    /// # Errors
    /// What happened is not modelled.
    pub fn run_watching(&mut self, end: Time, watch: &mut Watch) -> Result<Pause, Stop> {
        run_watching(&mut self.core, &mut self.chip, &mut self.idle, (end, watch))
    }

    /// One instruction, or a jump over sleep to the next event or `end`.
    ///
    /// # Errors
    /// As [`Machine::run_until`].
    pub fn step(&mut self, end: Time) -> Result<Option<ResetCause>, Stop> {
        step(&mut self.core, &mut self.chip, &mut self.idle, end)
    }
}

/// [`Machine::run_watching`]. Neither it nor [`step`] knows what stands at the pins, so both are compiled once, with this crate: a
/// generic function is compiled with the crate that calls it, which a test builds with little optimisation.
fn run_watching(
    core: &mut Core,
    chip: &mut Chip<dyn Analog + '_>,
    idle: &mut Time,
    (end, watch): (Time, &mut Watch),
) -> Result<Pause, Stop> {
    while chip.now < end {
        let (inside, writes) = (chip.system.current() == watch.exception, chip.dac.writes);
        let reset = step(core, chip, idle, end)?;
        watch.lowest_stack = watch.lowest_stack.min(core.r[13]);
        if let Some(cause) = reset {
            return Ok(Pause::Reset(cause));
        }
        match (inside, chip.system.current() == watch.exception) {
            (false, true) => return Ok(Pause::Entered),
            (true, false) => return Ok(Pause::Left),
            (true, true) if chip.dac.writes != writes => return Ok(Pause::Wrote),
            _ => {}
        }
        if chip.now >= watch.pause_at {
            return Ok(Pause::Due);
        }
    }
    Ok(Pause::Time)
}

/// [`Machine::step`].
fn step(
    core: &mut Core,
    chip: &mut Chip<dyn Analog + '_>,
    idle: &mut Time,
    end: Time,
) -> Result<Option<ResetCause>, Stop> {
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
        let entered = core.interrupts(chip).map_err(|trap| stop_at(core, &trap))?;
        if let Some(exception) = entered {
            chip.now += u64::from(exception.cycles) * units;
            chip.system.cycles += u64::from(exception.cycles);
            return Ok(None);
        }
    }
    if core.asleep != Sleep::Awake {
        core.wake_by_event();
        if core.asleep != Sleep::Awake {
            let until = chip.next_event.min(chip.iwdg.bites_at()).min(end);
            // Whole cycles: the core wakes on its own clock.
            let cycles = until.saturating_sub(chip.now).div_ceil(units).max(1);
            chip.now += cycles * units;
            chip.system.cycles += cycles;
            *idle += cycles * units;
            return Ok(None);
        }
    }
    let cycles = u64::from(core.step(chip)?);
    chip.now += cycles * units;
    chip.system.cycles += cycles;
    if chip.stalled_until > chip.now {
        let waited = (chip.stalled_until - chip.now).div_ceil(units);
        chip.now += waited * units;
        chip.system.cycles += waited;
    }
    Ok(chip.system.take_reset_request().then_some(ResetCause::Software))
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
