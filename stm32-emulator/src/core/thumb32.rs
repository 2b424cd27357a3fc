//! The 32-bit instructions (DDI 0403E, A5.3).

use super::alu::{
    Shift, add_with_carry, expand_immediate, saturate_signed, saturate_unsigned, shift, shift_immediate, sign_extend,
};
use super::{Bus, Core, Trap, UNDEFINED_INSTRUCTION, unknown};

/// Bits of FPCA and the stack choice in CONTROL.
const CONTROL_FPCA: u32 = 1 << 2;

fn low_half(value: u32) -> i64 {
    i64::from(value as i16)
}

fn high_half(value: u32) -> i64 {
    i64::from((value >> 16) as i16)
}

fn half(value: u32, top: bool) -> i64 {
    if top { high_half(value) } else { low_half(value) }
}

fn signed(value: u32) -> i64 {
    i64::from(value as i32)
}

impl Core {
    /// Executes a 32-bit instruction.
    pub(super) fn execute32<B: Bus + ?Sized>(&mut self, bus: &mut B, first: u32, second: u32) -> Result<(), Trap> {
        let op2 = first >> 4 & 0x7F;
        match first >> 11 & 3 {
            1 if op2 & 0x64 == 0 => self.load_store_multiple(bus, first, second),
            1 if op2 & 0x64 == 4 => self.load_store_dual(bus, first, second),
            1 if op2 & 0x60 == 0x20 => self.shifted_register(first, second),
            1 => self.execute_fpu(bus, first, second),
            2 if second >> 15 == 0 => {
                let immediate = (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xFF;
                if op2 & 0x20 == 0 {
                    let (y, carry) = expand_immediate(immediate, self.c);
                    self.data_processing32(first, second, y, carry)
                } else {
                    self.plain_immediate(first, second, immediate)
                }
            }
            2 => self.branch_or_miscellaneous(bus, first, second),
            _ if op2 & 0x71 == 0 || op2 & 0x61 == 1 => self.load_store_single(bus, first, second),
            _ if op2 & 0x70 == 0x20 => self.data_processing_register(first, second),
            _ if op2 & 0x78 == 0x30 => self.multiply(first, second),
            _ if op2 & 0x78 == 0x38 => self.long_multiply_or_divide(first, second),
            _ => self.execute_fpu(bus, first, second),
        }
    }

    /// LDM, STM with increment after or decrement before; PUSH and POP of the high registers.
    fn load_store_multiple<B: Bus + ?Sized>(&mut self, bus: &mut B, first: u32, second: u32) -> Result<(), Trap> {
        let (write_back, load, before) = (first >> 5 & 1 != 0, first >> 4 & 1 != 0, first >> 8 & 1 != 0);
        if (first >> 7 & 1 != 0) == before {
            return Err(unknown());
        }
        let n = (first & 15) as usize;
        let length = second.count_ones() * 4;
        let base = self.r[n];
        let mut address = Self::aligned(if before { base.wrapping_sub(length) } else { base }, 4)?;
        let after = if before { address } else { base.wrapping_add(length) };
        let mut target = None;
        for i in (0..16).filter(|i| second >> i & 1 != 0) {
            if load {
                let value = self.load(bus, address, 4)?;
                if i == 15 {
                    target = Some(value);
                } else {
                    self.r[i] = value;
                }
            } else {
                self.store(bus, address, 4, self.r[i])?;
            }
            address = address.wrapping_add(4);
        }
        if write_back && (!load || second >> n & 1 == 0) {
            self.r[n] = after;
        }
        target.map_or(Ok(()), |target| self.jump_exchange(bus, target))
    }

    /// LDRD, STRD, exclusives, table branches.
    fn load_store_dual<B: Bus + ?Sized>(&mut self, bus: &mut B, first: u32, second: u32) -> Result<(), Trap> {
        let (before, up, write_back, load) =
            (first >> 8 & 1 != 0, first >> 7 & 1 != 0, first >> 5 & 1 != 0, first >> 4 & 1 != 0);
        let (n, t, d, m) =
            ((first & 15) as usize, (second >> 12) as usize, (second >> 8 & 15) as usize, (second & 15) as usize);
        let offset = (second & 0xFF) * 4;
        if before || write_back {
            let base = if n == 15 { self.r[15] & !3 } else { self.r[n] };
            let moved = if up { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
            let address = Self::aligned(if before { moved } else { base }, 4)?;
            if load {
                let low = self.load(bus, address, 4)?;
                let high = self.load(bus, address.wrapping_add(4), 4)?;
                (self.r[t], self.r[d]) = (low, high);
            } else {
                self.store(bus, address, 4, self.r[t])?;
                self.store(bus, address.wrapping_add(4), 4, self.r[d])?;
            }
            if write_back {
                self.r[n] = moved;
            }
            return Ok(());
        }
        if !up {
            // LDREX, STREX.
            let address = Self::aligned(self.r[n].wrapping_add(offset), 4)?;
            return if load {
                self.load_exclusive(bus, t, address, 4)
            } else {
                self.store_exclusive(bus, d, t, address, 4)
            };
        }
        match (second >> 4 & 15, load) {
            (0, true) => {
                let offset = self.load(bus, self.r[n].wrapping_add(self.r[m]), 1)?;
                self.jump(self.r[15].wrapping_add(offset * 2));
            }
            (1, true) => {
                let offset = self.load(bus, self.r[n].wrapping_add(self.r[m] << 1), 2)?;
                self.jump(self.r[15].wrapping_add(offset * 2));
            }
            (4, true) => self.load_exclusive(bus, t, self.r[n], 1)?,
            (5, true) => self.load_exclusive(bus, t, Self::aligned(self.r[n], 2)?, 2)?,
            (4, false) => self.store_exclusive(bus, m, t, self.r[n], 1)?,
            (5, false) => self.store_exclusive(bus, m, t, Self::aligned(self.r[n], 2)?, 2)?,
            _ => return Err(unknown()),
        }
        Ok(())
    }

    fn load_exclusive<B: Bus + ?Sized>(&mut self, bus: &mut B, t: usize, address: u32, bytes: u32) -> Result<(), Trap> {
        self.r[t] = self.load(bus, address, bytes)?;
        self.exclusive = true;
        Ok(())
    }

    /// The status register `d` becomes 0 if the store happened, else 1.
    fn store_exclusive<B: Bus + ?Sized>(
        &mut self,
        bus: &mut B,
        d: usize,
        t: usize,
        address: u32,
        bytes: u32,
    ) -> Result<(), Trap> {
        if self.exclusive {
            self.store(bus, address, bytes, self.r[t])?;
        }
        self.r[d] = u32::from(!self.exclusive);
        self.exclusive = false;
        Ok(())
    }

    fn shifted_register(&mut self, first: u32, second: u32) -> Result<(), Trap> {
        let amount = second >> 12 << 2 & 0x1C | second >> 6 & 3;
        let (n, d, m) = ((first & 15) as usize, (second >> 8 & 15) as usize, (second & 15) as usize);
        if first >> 5 & 15 == 6 {
            // PKHBT, PKHTB.
            let top_first = second >> 5 & 1 != 0;
            let kind = if top_first { Shift::Asr } else { Shift::Lsl };
            let (y, _) = shift_immediate(kind, self.r[m], amount, self.c);
            let x = self.r[n];
            self.r[d] = if top_first { x & 0xFFFF_0000 | y & 0xFFFF } else { y & 0xFFFF_0000 | x & 0xFFFF };
            return Ok(());
        }
        let (y, carry) = shift_immediate(Shift::from_bits(second >> 4), self.r[m], amount, self.c);
        self.data_processing32(first, second, y, carry)
    }

    /// The operations of two operands; register 15 as target means a comparison, as operand nothing.
    #[inline]
    fn data_processing32(&mut self, first: u32, second: u32, y: u32, carry: bool) -> Result<(), Trap> {
        let (n, d) = ((first & 15) as usize, (second >> 8 & 15) as usize);
        let flags = first >> 4 & 1 != 0;
        let x = self.r[n];
        let (value, sum) = match first >> 5 & 15 {
            0 => (x & y, None),
            1 => (x & !y, None),
            2 => (if n == 15 { y } else { x | y }, None),
            3 => (if n == 15 { !y } else { x | !y }, None),
            4 => (x ^ y, None),
            8 => (0, Some(add_with_carry(x, y, false))),
            10 => (0, Some(add_with_carry(x, y, self.c))),
            11 => (0, Some(add_with_carry(x, !y, self.c))),
            13 => (0, Some(add_with_carry(x, !y, true))),
            14 => (0, Some(add_with_carry(!x, y, true))),
            _ => return Err(unknown()),
        };
        let value = match sum {
            Some(sum) if flags => self.set_nzcv(sum),
            Some(sum) => sum.value,
            None => {
                if flags {
                    self.set_nz(value);
                    self.c = carry;
                }
                value
            }
        };
        match d {
            15 if flags => {}
            15 => return Err(unknown()),
            13 => self.r[13] = value & !3,
            _ => self.r[d] = value,
        }
        Ok(())
    }

    /// ADDW, SUBW, ADR, MOVW, MOVT, saturation, bit fields.
    fn plain_immediate(&mut self, first: u32, second: u32, immediate: u32) -> Result<(), Trap> {
        let (n, d) = ((first & 15) as usize, (second >> 8 & 15) as usize);
        let amount = second >> 12 << 2 & 0x1C | second >> 6 & 3;
        let width = second & 31;
        let base = if n == 15 { self.r[15] & !3 } else { self.r[n] };
        let wide = (first & 15) << 12 | immediate;
        match first >> 4 & 31 {
            0 => self.r[d] = base.wrapping_add(immediate),
            10 => self.r[d] = base.wrapping_sub(immediate),
            4 => self.r[d] = wide,
            12 => self.r[d] = self.r[d] & 0xFFFF | wide << 16,
            // SSAT16, USAT16 share the code of the arithmetic shift by 0.
            18 if amount == 0 => {
                let limit = |value| saturate_signed(value, width + 1);
                self.saturate_halves(d, n, limit);
            }
            26 if amount == 0 => {
                let limit = |value| saturate_unsigned(value, width);
                self.saturate_halves(d, n, limit);
            }
            code @ (16 | 18 | 24 | 26) => {
                let kind = if code & 2 != 0 { Shift::Asr } else { Shift::Lsl };
                let (y, _) = shift_immediate(kind, self.r[n], amount, false);
                let y = signed(y);
                let (value, limited) =
                    if code & 8 == 0 { saturate_signed(y, width + 1) } else { saturate_unsigned(y, width) };
                self.r[d] = value;
                self.q |= limited;
            }
            // SBFX, UBFX.
            code @ (20 | 28) => {
                if amount + width > 31 {
                    return Err(unknown());
                }
                let raised = self.r[n] << (31 - amount - width);
                self.r[d] = if code == 20 { (raised as i32 >> (31 - width)) as u32 } else { raised >> (31 - width) };
            }
            // BFI, BFC.
            22 => {
                if width < amount {
                    return Err(unknown());
                }
                let mask = (u32::MAX >> (31 - (width - amount))) << amount;
                let inserted = if n == 15 { 0 } else { self.r[n] << amount };
                self.r[d] = self.r[d] & !mask | inserted & mask;
            }
            _ => return Err(unknown()),
        }
        Ok(())
    }

    fn saturate_halves(&mut self, d: usize, n: usize, limit: impl Fn(i64) -> (u32, bool)) {
        let (low, low_limited) = limit(low_half(self.r[n]));
        let (high, high_limited) = limit(high_half(self.r[n]));
        self.r[d] = high << 16 | low & 0xFFFF;
        self.q |= low_limited || high_limited;
    }

    fn branch_or_miscellaneous<B: Bus + ?Sized>(&mut self, bus: &mut B, first: u32, second: u32) -> Result<(), Trap> {
        let sign = first >> 10 & 1;
        let (j1, j2) = (second >> 13 & 1, second >> 11 & 1);
        if second >> 12 & 1 != 0 {
            // B, BL.
            let (i1, i2) = (!(j1 ^ sign) & 1, !(j2 ^ sign) & 1);
            let offset = sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FF) << 12 | (second & 0x7FF) << 1;
            if second >> 14 & 1 != 0 {
                self.r[14] = self.pc | 1;
            }
            self.jump(self.r[15].wrapping_add(sign_extend(offset, 25)));
            return Ok(());
        }
        if second >> 14 & 1 != 0 {
            return Err(unknown());
        }
        if first >> 6 & 14 != 14 {
            let offset = sign << 20 | j2 << 19 | j1 << 18 | (first & 0x3F) << 12 | (second & 0x7FF) << 1;
            if self.holds(first >> 6 & 15) {
                self.jump(self.r[15].wrapping_add(sign_extend(offset, 21)));
            }
            return Ok(());
        }
        let (n, d) = ((first & 15) as usize, (second >> 8 & 15) as usize);
        match first >> 4 & 0x7F {
            0x38 | 0x39 => self.write_special(bus, second, self.r[n]),
            0x3E | 0x3F => {
                self.r[d] = self.read_special(bus, second & 0xFF)?;
                self.cycles += 1;
                Ok(())
            }
            0x3A if second >> 8 & 7 == 0 => self.hint(second & 0xFF),
            0x3B => {
                match second >> 4 & 15 {
                    2 => self.exclusive = false,
                    // DSB, DMB, ISB: accesses happen in program order here.
                    4..=6 => {}
                    _ => return Err(unknown()),
                }
                Ok(())
            }
            0x7F => Err(Trap::Usage(UNDEFINED_INSTRUCTION)),
            _ => Err(unknown()),
        }
    }

    fn write_special<B: Bus + ?Sized>(&mut self, bus: &mut B, second: u32, value: u32) -> Result<(), Trap> {
        match second & 0xFF {
            0..=3 => {
                if second >> 11 & 1 != 0 {
                    self.set_flags(value);
                }
                if second >> 10 & 1 != 0 {
                    self.ge = value >> 16 & 15;
                }
            }
            8 => self.r[13] = value & !3,
            16 => self.primask = value & 1 != 0,
            17 => self.basepri = value & 0xF0,
            18 => {
                let value = value & 0xF0;
                if value != 0 && (self.basepri == 0 || value < self.basepri) {
                    self.basepri = value;
                }
            }
            19 => self.faultmask = value & 1 != 0,
            20 if value & 3 == 0 => self.fp_active = value & CONTROL_FPCA != 0,
            20 => return Err(Trap::unmodelled("the process stack and unprivileged execution")),
            _ => return Err(unknown()),
        }
        self.cycles += 1;
        bus.system().attention = true;
        Ok(())
    }

    fn read_special<B: Bus + ?Sized>(&mut self, bus: &mut B, register: u32) -> Result<u32, Trap> {
        Ok(match register {
            0..=7 => {
                let exception = if register & 1 != 0 { bus.system().current() } else { 0 };
                let flags = if register < 4 { self.xpsr(0) & 0xF80F_0000 } else { 0 };
                flags | exception
            }
            8 => self.r[13],
            16 => u32::from(self.primask),
            17 | 18 => self.basepri,
            19 => u32::from(self.faultmask),
            20 => u32::from(self.fp_active) << 2,
            _ => return Err(unknown()),
        })
    }

    fn load_store_single<B: Bus + ?Sized>(&mut self, bus: &mut B, first: u32, second: u32) -> Result<(), Trap> {
        let (n, t) = ((first & 15) as usize, (second >> 12) as usize);
        let load = first >> 4 & 1 != 0;
        let bytes = 1 << (first >> 5 & 3);
        let extend = first >> 8 & 1 != 0;
        let up = first >> 7 & 1 != 0;
        if bytes == 8 || (n == 15 && !load) || (extend && (!load || bytes == 4)) {
            return Err(unknown());
        }
        let base = if n == 15 { self.r[15] & !3 } else { self.r[n] };
        let (address, write_back) = if n == 15 {
            let offset = second & 0xFFF;
            (if up { base.wrapping_add(offset) } else { base.wrapping_sub(offset) }, None)
        } else if up {
            (base.wrapping_add(second & 0xFFF), None)
        } else if second >> 11 & 1 != 0 {
            let offset = second & 0xFF;
            let moved = if second >> 9 & 1 != 0 { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
            let before = second >> 10 & 1 != 0;
            (if before { moved } else { base }, (second >> 8 & 1 != 0).then_some(moved))
        } else {
            (base.wrapping_add(self.r[(second & 15) as usize] << (second >> 4 & 3)), None)
        };
        if !load {
            self.store(bus, address, bytes, self.r[t])?;
            if let Some(moved) = write_back {
                self.r[n] = moved;
            }
            return Ok(());
        }
        if t == 15 && bytes < 4 {
            // PLD, PLI.
            return Ok(());
        }
        let value = self.load(bus, address, bytes)?;
        let value = if extend { sign_extend(value, bytes * 8) } else { value };
        if let Some(moved) = write_back {
            self.r[n] = moved;
        }
        if t == 15 {
            return self.jump_exchange(bus, value);
        }
        self.r[t] = value;
        Ok(())
    }

    /// Shifts by registers, extensions, saturating and parallel additions, bit reversal.
    fn data_processing_register(&mut self, first: u32, second: u32) -> Result<(), Trap> {
        let (n, d, m) = ((first & 15) as usize, (second >> 8 & 15) as usize, (second & 15) as usize);
        let (x, y) = (self.r[n], self.r[m]);
        if second >> 12 != 15 {
            return Err(unknown());
        }
        let op1 = first >> 4 & 15;
        let op2 = second >> 4 & 15;
        if op1 < 8 && op2 == 0 {
            let (value, carry) = shift(Shift::from_bits(first >> 5), x, y & 0xFF, self.c);
            if first >> 4 & 1 != 0 {
                self.set_nz(value);
                self.c = carry;
            }
            self.r[d] = value;
            return Ok(());
        }
        if op1 < 8 && op2 & 8 != 0 {
            let y = y.rotate_right((second >> 4 & 3) * 8);
            let halves = |low: u32, high: u32| high << 16 | low & 0xFFFF;
            let extended = match op1 {
                0 => sign_extend(y, 16),
                1 => y & 0xFFFF,
                2 => halves(sign_extend(y, 8), sign_extend(y >> 16, 8)),
                3 => y & 0x00FF_00FF,
                4 => sign_extend(y, 8),
                5 => y & 0xFF,
                _ => return Err(unknown()),
            };
            self.r[d] = match (n, op1) {
                (15, _) => extended,
                (_, 2 | 3) => halves(x.wrapping_add(extended), (x >> 16).wrapping_add(extended >> 16)),
                _ => x.wrapping_add(extended),
            };
            return Ok(());
        }
        if op1 >= 8 && op2 < 8 {
            return self.parallel(op1 & 7, op2, d, x, y);
        }
        if op1 >= 8 && op2 & 12 == 8 {
            match (op1 & 7, op2 & 3) {
                // QADD, QDADD, QSUB, QDSUB: the first operand is Rm.
                (0, code) => {
                    let (addend, doubled) = if code & 1 != 0 { saturate_signed(2 * signed(x), 32) } else { (x, false) };
                    let exact = if code & 2 != 0 { signed(y) - signed(addend) } else { signed(y) + signed(addend) };
                    let (value, limited) = saturate_signed(exact, 32);
                    self.r[d] = value;
                    self.q |= limited || doubled;
                }
                (1, 0) => self.r[d] = y.swap_bytes(),
                (1, 1) => self.r[d] = y.swap_bytes().rotate_right(16),
                (1, 2) => self.r[d] = y.reverse_bits(),
                (1, 3) => self.r[d] = sign_extend(u32::from((y as u16).swap_bytes()), 16),
                // SEL.
                (2, 0) => {
                    let mask = (0..4).filter(|i| self.ge >> i & 1 != 0).fold(0, |mask, i| mask | 0xFF << (8 * i));
                    self.r[d] = x & mask | y & !mask;
                }
                (3, 0) => self.r[d] = y.leading_zeros(),
                _ => return Err(unknown()),
            }
            return Ok(());
        }
        Err(unknown())
    }

    /// Parallel additions and subtractions of halves and bytes: plain, saturating or halving, signed or unsigned.
    fn parallel(&mut self, op1: u32, op2: u32, d: usize, x: u32, y: u32) -> Result<(), Trap> {
        let unsigned = op2 & 4 != 0;
        let lane = |value: u32, bits: u32, index: u32| -> i64 {
            let raw = value >> (bits * index) & ((1 << bits) - 1);
            if unsigned { i64::from(raw) } else { signed(sign_extend(raw, bits)) }
        };
        let bits = if matches!(op1, 0 | 4) { 8 } else { 16 };
        let mut result = 0;
        let mut ge = 0;
        for index in 0..32 / bits {
            let own = lane(x, bits, index);
            // ASX and SAX exchange the halves of the second operand.
            let other = lane(y, bits, if matches!(op1, 2 | 6) { 1 - index } else { index });
            let subtract = match op1 {
                0 | 1 => false,
                4 | 5 => true,
                2 => index == 0,
                6 => index == 1,
                _ => return Err(unknown()),
            };
            let exact = if subtract { own - other } else { own + other };
            let value = match op2 & 3 {
                0 => {
                    let carried = if unsigned && !subtract { exact >= 1 << bits } else { exact >= 0 };
                    if carried {
                        ge |= if bits == 8 { 1 << index } else { 3 << (2 * index) };
                    }
                    exact as u32
                }
                1 if unsigned => saturate_unsigned(exact, bits).0,
                1 => saturate_signed(exact, bits).0,
                2 => (exact >> 1) as u32,
                _ => return Err(unknown()),
            };
            result |= (value & ((1_u64 << bits) - 1) as u32) << (bits * index);
        }
        if op2 & 3 == 0 {
            self.ge = ge;
        }
        self.r[d] = result;
        Ok(())
    }

    /// Products with a 32-bit result.
    fn multiply(&mut self, first: u32, second: u32) -> Result<(), Trap> {
        let (n, a, d, m) =
            ((first & 15) as usize, (second >> 12) as usize, (second >> 8 & 15) as usize, (second & 15) as usize);
        let (x, y) = (self.r[n], self.r[m]);
        let addend = if a == 15 { 0 } else { self.r[a] };
        let code = second >> 4 & 15;
        let (top_x, top_y) = (code & 2 != 0, code & 1 != 0);
        // Sums that overflow set Q and wrap.
        let mut sum = |exact: i64| {
            self.q |= exact != signed(exact as u32);
            exact as u32
        };
        self.r[d] = match (first >> 4 & 7, code) {
            (0, 0) => x.wrapping_mul(y).wrapping_add(addend),
            (0, 1) => addend.wrapping_sub(x.wrapping_mul(y)),
            (1, 0..=3) => sum(half(x, top_x) * half(y, top_y) + signed(addend)),
            (2 | 4, 0 | 1) => {
                let y = y.rotate_right(16 * code);
                let (low, high) = (low_half(x) * low_half(y), high_half(x) * high_half(y));
                let product = if first >> 4 & 7 == 2 { low + high } else { low - high };
                sum(product + signed(addend))
            }
            (3, 0 | 1) => sum(((signed(x) * half(y, top_y)) >> 16) + signed(addend)),
            (5 | 6, 0 | 1) => {
                let product = (signed(x)).wrapping_mul(signed(y));
                let addend = i64::from(addend as i32) << 32;
                let exact =
                    if first >> 4 & 7 == 5 { addend.wrapping_add(product) } else { addend.wrapping_sub(product) };
                (exact.wrapping_add(if code == 1 { 0x8000_0000 } else { 0 }) >> 32) as u32
            }
            (7, 0) => (0..4).fold(addend, |sum, i| {
                let byte = |value: u32| value >> (8 * i) & 0xFF;
                sum.wrapping_add(byte(x).abs_diff(byte(y)))
            }),
            _ => return Err(unknown()),
        };
        Ok(())
    }

    /// Products with a 64-bit result, and divisions.
    fn long_multiply_or_divide(&mut self, first: u32, second: u32) -> Result<(), Trap> {
        let (n, low, high, m) =
            ((first & 15) as usize, (second >> 12) as usize, (second >> 8 & 15) as usize, (second & 15) as usize);
        let (x, y) = (self.r[n], self.r[m]);
        let accumulator = u64::from(self.r[high]) << 32 | u64::from(self.r[low]);
        let signed_product = (signed(x)).wrapping_mul(signed(y)) as u64;
        let unsigned_product = u64::from(x) * u64::from(y);
        let code = second >> 4 & 15;
        let value = match (first >> 4 & 7, code) {
            (0, 0) => signed_product,
            (2, 0) => unsigned_product,
            (4, 0) => accumulator.wrapping_add(signed_product),
            (6, 0) => accumulator.wrapping_add(unsigned_product),
            // UMAAL.
            (6, 6) => unsigned_product + u64::from(self.r[low]) + u64::from(self.r[high]),
            (4, 8..=11) => accumulator.wrapping_add((half(x, code & 2 != 0) * half(y, code & 1 != 0)) as u64),
            (4 | 5, 12 | 13) => {
                let y = y.rotate_right(16 * (code & 1));
                let (l, h) = (low_half(x) * low_half(y), high_half(x) * high_half(y));
                accumulator.wrapping_add(if first >> 4 & 7 == 4 { l + h } else { l - h } as u64)
            }
            (kind @ (1 | 3), 15) => {
                // 2 to 12 cycles, early when the operands are of like size (ARM DDI 0439B, table 3-1).
                self.cycles += 1 + (y.leading_zeros().saturating_sub(x.leading_zeros()) / 3).min(10);
                self.r[high] = match (kind, y) {
                    (_, 0) => 0,
                    (1, _) => (x as i32).wrapping_div(y as i32) as u32,
                    _ => x / y,
                };
                return Ok(());
            }
            _ => return Err(unknown()),
        };
        self.r[low] = value as u32;
        self.r[high] = (value >> 32) as u32;
        Ok(())
    }
}
