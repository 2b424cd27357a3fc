//! The system control space: interrupt controller, system control block, cycle counter (DDI 0403E, B3 and C1.8).

use super::Trap;

/// Exceptions with a fixed number.
pub(crate) const NMI: u32 = 2;
pub(crate) const HARD_FAULT: u32 = 3;
pub(crate) const PEND_SV: u32 = 14;
/// Interrupt 0 is exception 16.
pub(crate) const FIRST_INTERRUPT: u32 = 16;
/// Interrupts of the STM32G474, rounded up to whole words.
const WORDS: usize = 4;
/// The chip has four bits of priority.
const PRIORITY_BITS: u8 = 0xF0;

/// FPCCR: the state of lazy stacking is valid.
const LAZY_ACTIVE: u32 = 1;
const LAZY_ENABLED: u32 = 1 << 30;
const AUTOMATIC: u32 = 1 << 31;

/// State of the system control space.
#[derive(Clone, Debug)]
pub struct System {
    enabled: [u32; WORDS],
    pending: [u32; WORDS],
    active: [u32; WORDS],
    /// Levels of the interrupt lines.
    lines: [u32; WORDS],
    priority: [u8; 32 * WORDS],
    system_priority: [u8; 12],
    nmi_pending: bool,
    pend_sv: bool,
    /// Exceptions being handled, the innermost last.
    handled: Vec<u32>,
    /// Something changed that may let an exception in.
    pub attention: bool,
    /// Vector table.
    pub vectors: u32,
    /// Coprocessor access.
    pub cpacr: u32,
    /// Floating-point context: control and address of the reserved space.
    fpccr: u32,
    pub(crate) fpcar: u32,
    /// Configurable faults that happened.
    pub cfsr: u32,
    /// Hard faults that happened.
    pub hfsr: u32,
    /// Address of the last bus fault.
    pub bfar: u32,
    demcr: u32,
    dwt_control: u32,
    sleep_control: u32,
    configuration: u32,
    /// Core cycles since reset, for the cycle counter.
    pub cycles: u64,
    cycles_at_zero: u64,
    reset_requested: bool,
}

impl Default for System {
    fn default() -> Self {
        Self {
            enabled: [0; WORDS],
            pending: [0; WORDS],
            active: [0; WORDS],
            lines: [0; WORDS],
            priority: [0; 32 * WORDS],
            system_priority: [0; 12],
            nmi_pending: false,
            pend_sv: false,
            handled: Vec::new(),
            attention: false,
            vectors: 0,
            cpacr: 0,
            fpccr: AUTOMATIC | LAZY_ENABLED,
            fpcar: 0,
            cfsr: 0,
            hfsr: 0,
            bfar: 0,
            demcr: 0,
            dwt_control: 0,
            sleep_control: 0,
            configuration: 1 << 9,
            cycles: 0,
            cycles_at_zero: 0,
            reset_requested: false,
        }
    }
}

fn place(interrupt: u32) -> (usize, u32) {
    ((interrupt / 32) as usize % WORDS, 1 << (interrupt % 32))
}

impl System {
    /// A peripheral's interrupt line. A line that stays high pends its interrupt again when the handler returns.
    #[inline]
    pub fn set_line(&mut self, interrupt: u32, high: bool) {
        let (word, bit) = place(interrupt);
        if high {
            if self.lines[word] & bit == 0 && self.active[word] & bit == 0 {
                self.pending[word] |= bit;
                self.attention = true;
            }
            self.lines[word] |= bit;
        } else {
            self.lines[word] &= !bit;
        }
    }

    /// The non-maskable interrupt.
    pub fn raise_nmi(&mut self) {
        self.nmi_pending = true;
        self.attention = true;
    }

    pub(crate) fn nmi_pending(&self) -> bool {
        self.nmi_pending
    }

    /// Whether an exception is being handled.
    #[inline]
    #[must_use]
    pub fn handling(&self) -> bool {
        !self.handled.is_empty()
    }

    /// Number of the exception being handled, 0 for none.
    #[must_use]
    pub fn current(&self) -> u32 {
        self.handled.last().copied().unwrap_or(0)
    }

    /// Whether the firmware asked for a reset; asking clears it.
    #[inline]
    pub fn take_reset_request(&mut self) -> bool {
        std::mem::take(&mut self.reset_requested)
    }

    fn priority_of(&self, exception: u32) -> i32 {
        match exception {
            NMI => -2,
            HARD_FAULT => -1,
            4..FIRST_INTERRUPT => i32::from(self.system_priority[exception as usize - 4]),
            _ => i32::from(self.priority.get((exception - FIRST_INTERRUPT) as usize).copied().unwrap_or(0xFF)),
        }
    }

    /// The running code's priority: 256 outside handlers.
    pub(crate) fn execution_priority(&self) -> i32 {
        self.handled.iter().map(|exception| self.priority_of(*exception)).min().unwrap_or(256)
    }

    /// The most urgent pending exception and its priority.
    fn most_urgent(&self) -> Option<(i32, u32)> {
        if self.nmi_pending {
            return Some((-2, NMI));
        }
        let mut best = self.pend_sv.then(|| (self.priority_of(PEND_SV), PEND_SV));
        for word in 0..WORDS {
            let mut waiting = self.enabled[word] & self.pending[word];
            while waiting != 0 {
                let exception = FIRST_INTERRUPT + 32 * word as u32 + waiting.trailing_zeros();
                waiting &= waiting - 1;
                let candidate = (self.priority_of(exception), exception);
                if best.is_none_or(|best| candidate < best) {
                    best = Some(candidate);
                }
            }
        }
        best
    }

    /// The exception to take now, if one is more urgent than what runs and what is masked. `limit` is the priority from BASEPRI
    /// and the masks.
    pub(crate) fn take(&mut self, limit: i32) -> Option<u32> {
        self.attention = false;
        let (priority, exception) = self.most_urgent()?;
        if priority >= self.execution_priority().min(limit) {
            return None;
        }
        match exception {
            NMI => self.nmi_pending = false,
            PEND_SV => self.pend_sv = false,
            _ => {
                let (word, bit) = place(exception - FIRST_INTERRUPT);
                self.pending[word] &= !bit;
                self.active[word] |= bit;
            }
        }
        Some(exception)
    }

    /// Whether a pending exception would wake the core, whatever PRIMASK says.
    pub(crate) fn would_wake(&self, basepri: u32) -> bool {
        let limit = if basepri == 0 { 256 } else { basepri as i32 };
        self.most_urgent().is_some_and(|(priority, _)| priority < self.execution_priority().min(limit))
    }

    pub(crate) fn enter(&mut self, exception: u32) {
        self.handled.push(exception);
    }

    /// Ends the innermost handler.
    pub(crate) fn leave(&mut self) -> Option<u32> {
        let exception = self.handled.pop()?;
        if exception >= FIRST_INTERRUPT {
            let (word, bit) = place(exception - FIRST_INTERRUPT);
            self.active[word] &= !bit;
            self.pending[word] |= self.lines[word] & bit;
        }
        self.attention = true;
        Some(exception)
    }

    pub(crate) fn note_bus_fault(&mut self, address: u32) {
        const PRECISE: u32 = 1 << 9;
        const ADDRESS_VALID: u32 = 1 << 15;
        self.cfsr |= PRECISE | ADDRESS_VALID;
        self.bfar = address;
    }

    pub(crate) fn lazy_stacking(&self) -> bool {
        self.fpccr & LAZY_ENABLED != 0
    }

    pub(crate) fn automatic_stacking(&self) -> bool {
        self.fpccr & AUTOMATIC != 0
    }

    pub(crate) fn lazy_pending(&self) -> bool {
        self.fpccr & LAZY_ACTIVE != 0
    }

    pub(crate) fn set_lazy_pending(&mut self, pending: bool) {
        self.fpccr = self.fpccr & !LAZY_ACTIVE | u32::from(pending);
    }

    /// Reads a word of 0xE000_0000..0xE010_0000.
    pub(crate) fn read(&mut self, address: u32) -> Result<u32, Trap> {
        let word = (address >> 2 & 31) as usize % WORDS;
        Ok(match address {
            0xE000_1000 => self.dwt_control | 0x4000_0000,
            0xE000_1004 => (self.cycles - self.cycles_at_zero) as u32,
            // No lock on the debug blocks, no ITM.
            0xE000_1FB0..=0xE000_1FB4 => 0,
            0xE000_E100..=0xE000_E10C | 0xE000_E180..=0xE000_E18C => self.enabled[word],
            0xE000_E200..=0xE000_E20C | 0xE000_E280..=0xE000_E28C => self.pending[word],
            0xE000_E300..=0xE000_E30C => self.active[word],
            0xE000_E400..=0xE000_E47C => bytes_at(&self.priority, address - 0xE000_E400),
            0xE000_ED00 => 0x410F_C241,
            0xE000_ED04 => self.current() | u32::from(self.pend_sv) << 28 | u32::from(self.nmi_pending) << 31,
            0xE000_ED08 => self.vectors,
            0xE000_ED0C => 0xFA05_0000,
            0xE000_ED10 => self.sleep_control,
            0xE000_ED14 => self.configuration,
            0xE000_ED18..=0xE000_ED20 => bytes_at(&self.system_priority, address - 0xE000_ED18),
            // No handler of its own for memory, bus and usage faults.
            0xE000_ED24 => 0,
            0xE000_ED28 => self.cfsr,
            0xE000_ED2C => self.hfsr,
            0xE000_ED38 => self.bfar,
            0xE000_ED88 => self.cpacr,
            0xE000_EDFC => self.demcr,
            0xE000_EF34 => self.fpccr,
            0xE000_EF38 => self.fpcar,
            0xE000_EF3C => 0,
            _ => return Err(Trap::unmodelled(format!("read of {address:#010x} in the system control space"))),
        })
    }

    /// Writes 1 to 4 bytes there.
    pub(crate) fn write(&mut self, address: u32, bytes: u32, value: u32) -> Result<(), Trap> {
        let word = (address >> 2 & 31) as usize % WORDS;
        self.attention = true;
        match address {
            0xE000_E400..=0xE000_E47F => set_bytes(&mut self.priority, address - 0xE000_E400, bytes, value),
            0xE000_ED18..=0xE000_ED23 => set_bytes(&mut self.system_priority, address - 0xE000_ED18, bytes, value),
            _ if bytes != 4 => {
                return Err(Trap::unmodelled(format!(
                    "write of {bytes} bytes to {address:#010x} in the system control space"
                )));
            }
            0xE000_1000 => self.dwt_control = value & 1,
            0xE000_1004 => self.cycles_at_zero = self.cycles.wrapping_sub(u64::from(value)),
            0xE000_1FB0 => {}
            0xE000_E100..=0xE000_E10C => self.enabled[word] |= value,
            0xE000_E180..=0xE000_E18C => self.enabled[word] &= !value,
            0xE000_E200..=0xE000_E20C => self.pending[word] |= value,
            0xE000_E280..=0xE000_E28C => {
                self.pending[word] &= !value;
                self.pending[word] |= self.lines[word] & !self.active[word] & value;
            }
            0xE000_ED04 => {
                if value >> 31 != 0 {
                    self.nmi_pending = true;
                }
                if value >> 28 & 1 != 0 {
                    self.pend_sv = true;
                }
                if value >> 27 & 1 != 0 {
                    self.pend_sv = false;
                }
            }
            0xE000_ED08 => self.vectors = value & !0x7F,
            0xE000_ED0C => {
                if value >> 16 != 0x05FA || value & 0x703 != 0 {
                    return Err(Trap::unmodelled(format!("AIRCR = {value:#010x}")));
                }
                self.reset_requested = value & 4 != 0;
            }
            0xE000_ED10 if value & 4 != 0 => return Err(Trap::unmodelled("deep sleep")),
            0xE000_ED10 => self.sleep_control = value & 0x12,
            0xE000_ED14 => self.configuration = value,
            0xE000_ED24 if value & 0x7_0000 == 0 => {}
            0xE000_ED28 => self.cfsr &= !value,
            0xE000_ED2C => self.hfsr &= !value,
            0xE000_ED88 => self.cpacr = value & 0x00F0_0000,
            0xE000_EDFC => self.demcr = value,
            0xE000_EF00 => {
                let (word, bit) = place(value & 0x1FF);
                self.pending[word] |= bit;
            }
            0xE000_EF34 => self.fpccr = value,
            _ => {
                return Err(Trap::unmodelled(format!(
                    "write of {value:#010x} to {address:#010x} in the system control space"
                )));
            }
        }
        Ok(())
    }
}

fn bytes_at(bytes: &[u8], offset: u32) -> u32 {
    let at = |i: usize| u32::from(bytes.get(offset as usize + i).copied().unwrap_or(0)) << (8 * i);
    at(0) | at(1) | at(2) | at(3)
}

fn set_bytes(bytes: &mut [u8], offset: u32, count: u32, value: u32) {
    for i in 0..count {
        if let Some(byte) = bytes.get_mut((offset + i) as usize) {
            *byte = (value >> (8 * i)) as u8 & PRIORITY_BITS;
        }
    }
}
