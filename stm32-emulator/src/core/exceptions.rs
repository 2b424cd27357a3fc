//! Exception entry and return (DDI 0403E, B1.5), with lazy stacking of the floating-point registers.

use super::system::{HARD_FAULT, NMI};
use super::{Bus, Core, INVALID_RETURN, Sleep, Trap};

/// Cycles from an interrupt to its handler's first instruction and back, without wait states (ARM DDI 0439B, 3.9).
const ENTRY_CYCLES: u32 = 12;
const RETURN_CYCLES: u32 = 10;

/// Integer registers of a frame, and the whole frame with floating-point registers, in bytes.
const BASIC_FRAME: u32 = 32;
const EXTENDED_FRAME: u32 = 104;
/// Offset of the floating-point part.
const FLOATING_PART: u32 = 32;

/// Stacking failed, in CFSR.
const STACKING_ERROR: u32 = 1 << 12;
const UNSTACKING_ERROR: u32 = 1 << 11;
/// A configurable fault was escalated, in HFSR.
const FORCED: u32 = 1 << 30;

/// What a call to [`Core::interrupts`] did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exception {
    /// Its number: 16 and above are interrupts.
    pub number: u32,
    /// Cycles of its entry.
    pub cycles: u32,
}

impl Core {
    /// Takes the most urgent exception that is neither masked nor less urgent than what runs.
    ///
    /// # Errors
    /// The vector table cannot be read.
    pub fn interrupts<B: Bus + ?Sized>(&mut self, bus: &mut B) -> Result<Option<Exception>, Trap> {
        if self.asleep == Sleep::LockedUp {
            return Ok(None);
        }
        if self.asleep != Sleep::Awake && bus.system().would_wake(self.basepri) {
            self.asleep = Sleep::Awake;
        }
        let mut limit = if self.basepri == 0 { 256 } else { self.basepri as i32 };
        if self.primask {
            limit = limit.min(0);
        }
        if self.faultmask {
            limit = -1;
        }
        let Some(number) = bus.system().take(limit) else { return Ok(None) };
        self.enter(bus, number)?;
        Ok(Some(Exception { number, cycles: ENTRY_CYCLES }))
    }

    /// Lets WFE go on if an event is registered.
    pub fn wake_by_event(&mut self) {
        if self.asleep == Sleep::Event && self.event {
            self.event = false;
            self.asleep = Sleep::Awake;
        }
    }

    /// Pushes a frame and goes to the handler. If the stack does not answer, a hard fault is entered instead.
    fn enter<B: Bus + ?Sized>(&mut self, bus: &mut B, number: u32) -> Result<(), Trap> {
        self.asleep = Sleep::Awake;
        let with_floats = self.fp_active && bus.system().automatic_stacking();
        let frame_bytes = if with_floats { EXTENDED_FRAME } else { BASIC_FRAME };
        let padded = self.r[13] & 4;
        let frame = (self.r[13] & !7).wrapping_sub(frame_bytes);
        let previous = bus.system().current();
        let psr = self.xpsr(previous) & !(1 << 9) | padded << 7;
        let words = [self.r[0], self.r[1], self.r[2], self.r[3], self.r[12], self.r[14], self.pc, psr];
        let mut stacked = Ok(());
        for (i, word) in words.iter().enumerate() {
            stacked = stacked.and(bus.write(frame.wrapping_add(4 * i as u32), 4, *word));
        }
        if with_floats {
            let at = frame.wrapping_add(FLOATING_PART);
            if bus.system().lazy_stacking() {
                bus.system().fpcar = at;
                bus.system().set_lazy_pending(true);
            } else {
                stacked = stacked.and(self.save_floats(bus, at));
            }
        }
        self.r[13] = frame;
        let from_thread = u32::from(previous == 0);
        self.r[14] = 0xFFFF_FFE1 | from_thread << 3 | u32::from(!with_floats) << 4;
        self.fp_active = false;
        self.it = 0;
        self.exclusive = false;
        self.event = true;
        let number = match stacked {
            Ok(()) => number,
            Err(Trap::Bus(_)) => {
                let system = bus.system();
                system.cfsr |= STACKING_ERROR;
                system.hfsr |= FORCED;
                // The interrupt that could not be entered is not pended again: the firmware's handler resets the chip.
                HARD_FAULT
            }
            Err(other) => return Err(other),
        };
        bus.system().enter(number);
        let vectors = bus.system().vectors;
        self.pc = bus.read(vectors.wrapping_add(4 * number), 4)? & !1;
        Ok(())
    }

    /// A fault of the running instruction. Configurable faults have no handler of their own here: they become hard faults.
    ///
    /// # Errors
    /// A fault inside the hard fault handler or above: the chip locks up.
    pub(super) fn fault<B: Bus + ?Sized>(&mut self, bus: &mut B) -> Result<(), Trap> {
        if bus.system().execution_priority() < 0 || self.faultmask {
            self.asleep = Sleep::LockedUp;
            return Ok(());
        }
        bus.system().hfsr |= FORCED;
        self.cycles += ENTRY_CYCLES;
        self.enter(bus, HARD_FAULT)
    }

    /// A branch to an EXC_RETURN value.
    pub(super) fn return_from_exception<B: Bus + ?Sized>(&mut self, bus: &mut B, value: u32) -> Result<(), Trap> {
        let to_thread = value & 8 != 0;
        if value | 0x1C != 0xFFFF_FFFD || value & 4 != 0 {
            return Err(Trap::Usage(INVALID_RETURN));
        }
        let with_floats = value & 16 == 0;
        let frame = self.r[13];
        let mut words = [0; 8];
        for (i, word) in words.iter_mut().enumerate() {
            *word = match bus.read(frame.wrapping_add(4 * i as u32), 4) {
                Err(Trap::Bus(_)) => {
                    bus.system().cfsr |= UNSTACKING_ERROR;
                    return self.fault(bus);
                }
                word => word?,
            };
        }
        if with_floats {
            if bus.system().lazy_pending() {
                // Nothing used them since: they still hold the interrupted code's values.
                bus.system().set_lazy_pending(false);
            } else {
                for i in 0..16 {
                    self.s[i] = bus.read(frame.wrapping_add(FLOATING_PART + 4 * i as u32), 4)?;
                }
                self.fpscr = bus.read(frame.wrapping_add(FLOATING_PART + 64), 4)?;
            }
        }
        let psr = words[7];
        let left = bus.system().leave();
        if (bus.system().current() == 0) != to_thread {
            return Err(Trap::unmodelled("return from an exception to the wrong mode"));
        }
        if left != Some(NMI) {
            self.faultmask = false;
        }
        [self.r[0], self.r[1], self.r[2], self.r[3], self.r[12], self.r[14]] =
            [words[0], words[1], words[2], words[3], words[4], words[5]];
        self.pc = words[6] & !1;
        self.r[13] = frame.wrapping_add(if with_floats { EXTENDED_FRAME } else { BASIC_FRAME }) | psr >> 7 & 4;
        self.set_flags(psr);
        self.ge = psr >> 16 & 15;
        self.it = (psr >> 25 & 3 | (psr >> 10 & 0x3F) << 2) as u8;
        self.fp_active = with_floats;
        self.exclusive = false;
        self.event = true;
        self.cycles += RETURN_CYCLES;
        Ok(())
    }

    /// Writes the floating-point registers into the space reserved at exception entry, before the handler changes them.
    #[inline]
    pub(super) fn save_deferred<B: Bus + ?Sized>(&mut self, bus: &mut B) -> Result<(), Trap> {
        if bus.system().lazy_pending() {
            let at = bus.system().fpcar;
            self.save_floats(bus, at)?;
            bus.system().set_lazy_pending(false);
            self.cycles += 17;
        }
        Ok(())
    }

    fn save_floats<B: Bus + ?Sized>(&mut self, bus: &mut B, at: u32) -> Result<(), Trap> {
        for i in 0..16 {
            bus.write(at.wrapping_add(4 * i as u32), 4, self.s[i])?;
        }
        bus.write(at.wrapping_add(64), 4, self.fpscr)
    }
}
