//! The Cortex-M4F: registers, one instruction at a time, exceptions.
//!
//! Source: ARMv7-M Architecture Reference Manual (ARM DDI 0403E). Implemented is what compilers emit for
//! `thumbv7em-none-eabihf`; any other instruction ends the run with [`Trap::Unmodelled`], never with a wrong result.

pub mod alu;
mod exceptions;
mod fpu;
pub mod system;
mod thumb16;
mod thumb32;

use std::fmt;

pub use exceptions::Exception;
use system::System;

/// What memory and peripherals offer to the core.
pub trait Bus {
    /// A halfword of code.
    ///
    /// # Errors
    /// Nothing answers at the address.
    fn fetch(&mut self, address: u32) -> Result<u16, Trap>;
    /// Reads 1, 2 or 4 bytes, zero-extended.
    ///
    /// # Errors
    /// Nothing answers, or what answers is not modelled.
    fn read(&mut self, address: u32, bytes: u32) -> Result<u32, Trap>;
    /// Writes 1, 2 or 4 bytes.
    ///
    /// # Errors
    /// As [`Bus::read`].
    fn write(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap>;
    /// The system control space: interrupts, priorities, fault status.
    fn system(&mut self) -> &mut System;
}

/// Why an instruction did not finish.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trap {
    /// No device answers at this address: a precise bus fault.
    Bus(u32),
    /// The instruction is permanently undefined (`udf`) or floating point is switched off: a usage fault with this bit of UFSR.
    Usage(u32),
    /// The emulator does not know what the chip would do: the run ends.
    Unmodelled(Box<str>),
}

impl Trap {
    /// An access or instruction outside the model.
    pub fn unmodelled(what: impl Into<String>) -> Self {
        Self::Unmodelled(what.into().into_boxed_str())
    }
}

/// Bits of UFSR, as they stand in CFSR.
pub(crate) const UNDEFINED_INSTRUCTION: u32 = 1 << 16;
pub(crate) const INVALID_STATE: u32 = 1 << 17;
pub(crate) const INVALID_RETURN: u32 = 1 << 18;
pub(crate) const NO_COPROCESSOR: u32 = 1 << 19;
pub(crate) const UNALIGNED: u32 = 1 << 24;

/// What ended a run that the emulator cannot go on with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stop {
    /// Address of the instruction.
    pub instruction_at: u32,
    /// The instruction; the first halfword stands above if there are two.
    pub instruction: u32,
    /// What is not modelled: address, peripheral.
    pub what: String,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "at {:#010x}, instruction {:#x}: {}", self.instruction_at, self.instruction, self.what)
    }
}

impl std::error::Error for Stop {}

/// Cycles of a taken branch beyond its own: the pipeline is filled anew (1 to 3, ARM DDI 0439B table 3-1; taken as 2).
const REFILL: u32 = 2;

/// The core's registers.
#[derive(Clone, Debug)]
pub struct Core {
    /// r0 to r14; r13 is the main stack pointer. During an instruction r15 holds its address + 4, as the instruction reads it.
    pub r: [u32; 16],
    /// Address of the next instruction.
    pub pc: u32,
    /// Negative.
    pub n: bool,
    /// Zero.
    pub z: bool,
    /// Carry.
    pub c: bool,
    /// Signed overflow.
    pub v: bool,
    /// Saturation happened.
    pub q: bool,
    /// Greater-or-equal flags of the parallel additions, 4 bits.
    pub ge: u32,
    /// The If-Then state: condition and remaining mask.
    pub it: u8,
    /// Floating-point registers, as bits.
    pub s: [u32; 32],
    /// Floating-point status and control. Cumulative exception flags are not kept.
    pub fpscr: u32,
    /// All exceptions of configurable priority are masked.
    pub primask: bool,
    /// All exceptions but NMI are masked.
    pub faultmask: bool,
    /// Exceptions of this priority and less urgent ones are masked; 0 masks none.
    pub basepri: u32,
    /// CONTROL.FPCA: floating-point registers are in use by the running context.
    pub fp_active: bool,
    /// Waiting for an interrupt or event.
    pub asleep: Sleep,
    /// The event register of WFE.
    event: bool,
    /// The local exclusive monitor.
    exclusive: bool,
    /// Cycles of the instruction that runs.
    cycles: u32,
    /// Instructions executed since power-up.
    pub instructions: u64,
}

/// Whether the core waits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sleep {
    /// It runs.
    Awake,
    /// WFI: until an exception could be taken.
    Interrupt,
    /// WFE: until an event, too.
    Event,
    /// A fault inside a fault handler: until a reset (DDI 0403E, B1.5.15; that a non-maskable interrupt may end it is left out).
    LockedUp,
}

impl Core {
    /// The state after reset: stack pointer and entry from the vector table at `vectors`.
    ///
    /// # Errors
    /// There is no memory at the vector table.
    pub fn reset(bus: &mut (impl Bus + ?Sized), vectors: u32) -> Result<Self, Trap> {
        let stack = bus.read(vectors, 4)? & !3;
        let entry = bus.read(vectors + 4, 4)?;
        let mut r = [0; 16];
        r[13] = stack;
        r[14] = u32::MAX;
        Ok(Self {
            r,
            pc: entry & !1,
            n: false,
            z: false,
            c: false,
            v: false,
            q: false,
            ge: 0,
            it: 0,
            s: [0; 32],
            fpscr: 0,
            primask: false,
            faultmask: false,
            basepri: 0,
            fp_active: false,
            asleep: Sleep::Awake,
            event: false,
            exclusive: false,
            cycles: 0,
            instructions: 0,
        })
    }

    /// Executes one instruction and returns its cycles, an estimate from ARM's table (DDI 0439B, 3.3) without wait states.
    ///
    /// # Errors
    /// The instruction, or what it touches, is not modelled.
    #[inline]
    pub fn step<B: Bus + ?Sized>(&mut self, bus: &mut B) -> Result<u32, Stop> {
        let at = self.pc;
        self.cycles = 1;
        self.instructions += 1;
        if let Err(trap) = self.execute_at(bus, at) {
            self.trapped(bus, at, trap)?;
        }
        Ok(self.cycles)
    }

    #[inline]
    fn execute_at<B: Bus + ?Sized>(&mut self, bus: &mut B, at: u32) -> Result<(), Trap> {
        let first = u32::from(bus.fetch(at)?);
        self.r[15] = at.wrapping_add(4);
        let wide = first >= 0xE800;
        let second = if wide { u32::from(bus.fetch(at.wrapping_add(2))?) } else { 0 };
        self.pc = at.wrapping_add(if wide { 4 } else { 2 });
        let in_it_block = self.it != 0;
        if in_it_block {
            let condition = u32::from(self.it >> 4);
            self.it = if self.it & 7 == 0 { 0 } else { self.it & 0xE0 | self.it << 1 & 0x1F };
            if !self.holds(condition) {
                return Ok(());
            }
        }
        if wide { self.execute32(bus, first, second) } else { self.execute16(bus, first, in_it_block) }
    }

    /// A trap becomes a fault exception, or ends the run.
    #[cold]
    fn trapped<B: Bus + ?Sized>(&mut self, bus: &mut B, at: u32, trap: Trap) -> Result<(), Stop> {
        let stop = |bus: &mut B, what: String| {
            let first = bus.fetch(at).map_or(0, u32::from);
            let instruction =
                if first >= 0xE800 { first << 16 | bus.fetch(at.wrapping_add(2)).map_or(0, u32::from) } else { first };
            Stop { instruction_at: at, instruction, what }
        };
        let entered = match trap {
            // The instruction came from a double word with two wrong bits: the interrupt that says so is taken next.
            Trap::Unmodelled(_) if bus.system().nmi_pending() => Ok(()),
            Trap::Unmodelled(what) => return Err(stop(bus, what.into())),
            // A synchronous fault returns to the instruction that caused it.
            Trap::Bus(address) => {
                self.pc = at;
                bus.system().note_bus_fault(address);
                self.fault(bus)
            }
            Trap::Usage(bit) => {
                self.pc = at;
                bus.system().cfsr |= bit;
                self.fault(bus)
            }
        };
        entered.map_err(|trap| stop(bus, format!("{trap:?} while a fault was entered")))
    }

    /// Whether a condition code holds.
    #[inline]
    fn holds(&self, condition: u32) -> bool {
        let holds = match condition >> 1 {
            0 => self.z,
            1 => self.c,
            2 => self.n,
            3 => self.v,
            4 => self.c && !self.z,
            5 => self.n == self.v,
            6 => self.n == self.v && !self.z,
            _ => return true,
        };
        holds != (condition & 1 != 0)
    }

    #[inline]
    fn set_nz(&mut self, value: u32) {
        self.n = value >> 31 != 0;
        self.z = value == 0;
    }

    #[inline]
    fn set_nzcv(&mut self, sum: alu::Sum) -> u32 {
        self.set_nz(sum.value);
        self.c = sum.carry;
        self.v = sum.overflow;
        sum.value
    }

    #[inline]
    fn jump(&mut self, target: u32) {
        self.cycles += REFILL;
        self.pc = target & !1;
    }

    /// A branch to an address in a register: it may return from an exception, and must stay in Thumb state.
    fn jump_exchange<B: Bus + ?Sized>(&mut self, bus: &mut B, target: u32) -> Result<(), Trap> {
        if target >> 28 == 0xF && bus.system().handling() {
            return self.return_from_exception(bus, target);
        }
        if target & 1 == 0 {
            return Err(Trap::Usage(INVALID_STATE));
        }
        self.jump(target);
        Ok(())
    }

    #[inline]
    fn load<B: Bus + ?Sized>(&mut self, bus: &mut B, address: u32, bytes: u32) -> Result<u32, Trap> {
        self.cycles += 1;
        bus.read(address, bytes)
    }

    #[inline]
    fn store<B: Bus + ?Sized>(&mut self, bus: &mut B, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        self.cycles += 1;
        bus.write(address, bytes, value)
    }

    /// Loads of several words, pairs, floating point and exclusives must be aligned.
    fn aligned(address: u32, bytes: u32) -> Result<u32, Trap> {
        if address.is_multiple_of(bytes) { Ok(address) } else { Err(Trap::Usage(UNALIGNED)) }
    }

    /// The program status register as stacked and read.
    #[must_use]
    pub fn xpsr(&self, exception: u32) -> u32 {
        let flags = [self.n, self.z, self.c, self.v, self.q];
        let flags = flags.iter().enumerate().fold(0, |bits, (i, flag)| bits | u32::from(*flag) << (31 - i));
        let it = u32::from(self.it);
        flags | (it & 3) << 25 | (it >> 2) << 10 | self.ge << 16 | 1 << 24 | exception
    }

    fn set_flags(&mut self, psr: u32) {
        self.n = psr >> 31 & 1 != 0;
        self.z = psr >> 30 & 1 != 0;
        self.c = psr >> 29 & 1 != 0;
        self.v = psr >> 28 & 1 != 0;
        self.q = psr >> 27 & 1 != 0;
    }
}

/// An instruction outside the model.
#[cold]
fn unknown() -> Trap {
    Trap::unmodelled("the core does not model this instruction")
}

#[cfg(test)]
mod tests;
