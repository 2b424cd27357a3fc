//! The 16-bit instructions (DDI 0403E, A5.2).

use super::alu::{Shift, add_with_carry, shift, shift_immediate, sign_extend};
use super::{Bus, Core, Sleep, Trap, UNDEFINED_INSTRUCTION, unknown};

impl Core {
    /// Executes a 16-bit instruction. Inside an If-Then block data processing sets no flags.
    #[inline]
    pub(super) fn execute16<B: Bus + ?Sized>(&mut self, bus: &mut B, op: u32, in_it_block: bool) -> Result<(), Trap> {
        let flags = !in_it_block;
        let low = (op & 7) as usize;
        let second = (op >> 3 & 7) as usize;
        let third = (op >> 6 & 7) as usize;
        let high = (op >> 8 & 7) as usize;
        let imm5 = op >> 6 & 31;
        let imm8 = op & 0xFF;
        match op >> 11 {
            // Shifts by an immediate; LSL #0 is MOVS.
            0..=2 => {
                let (value, carry) = shift_immediate(Shift::from_bits(op >> 11), self.r[second], imm5, self.c);
                self.logic(low, value, carry, flags);
            }
            // ADD, SUB of a register or a three-bit immediate.
            3 => {
                let y = if op >> 10 & 1 != 0 { third as u32 } else { self.r[third] };
                let x = self.r[second];
                let sum = if op >> 9 & 1 != 0 { add_with_carry(x, !y, true) } else { add_with_carry(x, y, false) };
                self.r[low] = if flags { self.set_nzcv(sum) } else { sum.value };
            }
            // MOV immediate.
            4 => self.logic(high, imm8, self.c, flags),
            // CMP immediate.
            5 => {
                self.set_nzcv(add_with_carry(self.r[high], !imm8, true));
            }
            // ADD, SUB of an eight-bit immediate.
            6 | 7 => {
                let x = self.r[high];
                let sum = if op >> 11 == 7 { add_with_carry(x, !imm8, true) } else { add_with_carry(x, imm8, false) };
                self.r[high] = if flags { self.set_nzcv(sum) } else { sum.value };
            }
            8 if op >> 10 & 1 == 0 => self.data_processing16(op, flags),
            8 => return self.special_data16(bus, op),
            // LDR literal.
            9 => {
                let address = (self.r[15] & !3).wrapping_add(imm8 * 4);
                self.r[high] = self.load(bus, address, 4)?;
            }
            // Loads and stores with a register offset.
            10 | 11 => {
                let address = self.r[second].wrapping_add(self.r[third]);
                match op >> 9 & 7 {
                    0 => self.store(bus, address, 4, self.r[low])?,
                    1 => self.store(bus, address, 2, self.r[low])?,
                    2 => self.store(bus, address, 1, self.r[low])?,
                    3 => self.r[low] = sign_extend(self.load(bus, address, 1)?, 8),
                    4 => self.r[low] = self.load(bus, address, 4)?,
                    5 => self.r[low] = self.load(bus, address, 2)?,
                    6 => self.r[low] = self.load(bus, address, 1)?,
                    _ => self.r[low] = sign_extend(self.load(bus, address, 2)?, 16),
                }
            }
            // Loads and stores with an immediate offset: words, bytes, halfwords.
            12 => self.store(bus, self.r[second].wrapping_add(imm5 * 4), 4, self.r[low])?,
            13 => self.r[low] = self.load(bus, self.r[second].wrapping_add(imm5 * 4), 4)?,
            14 => self.store(bus, self.r[second].wrapping_add(imm5), 1, self.r[low])?,
            15 => self.r[low] = self.load(bus, self.r[second].wrapping_add(imm5), 1)?,
            16 => self.store(bus, self.r[second].wrapping_add(imm5 * 2), 2, self.r[low])?,
            17 => self.r[low] = self.load(bus, self.r[second].wrapping_add(imm5 * 2), 2)?,
            // Relative to the stack pointer.
            18 => self.store(bus, self.r[13].wrapping_add(imm8 * 4), 4, self.r[high])?,
            19 => self.r[high] = self.load(bus, self.r[13].wrapping_add(imm8 * 4), 4)?,
            // ADR, ADD from the stack pointer.
            20 => self.r[high] = (self.r[15] & !3).wrapping_add(imm8 * 4),
            21 => self.r[high] = self.r[13].wrapping_add(imm8 * 4),
            22 | 23 => return self.miscellaneous16(bus, op),
            // STM, LDM with write-back.
            24 => {
                let base = self.r[high];
                let mut address = Self::aligned(base, 4)?;
                for i in (0..8).filter(|i| op >> i & 1 != 0) {
                    self.store(bus, address, 4, self.r[i])?;
                    address = address.wrapping_add(4);
                }
                self.r[high] = address;
            }
            25 => {
                let mut address = Self::aligned(self.r[high], 4)?;
                for i in (0..8).filter(|i| op >> i & 1 != 0) {
                    self.r[i] = self.load(bus, address, 4)?;
                    address = address.wrapping_add(4);
                }
                if op >> high & 1 == 0 {
                    self.r[high] = address;
                }
            }
            // B with a condition; condition 14 is UDF, 15 SVC.
            26 | 27 => match op >> 8 & 15 {
                14 => return Err(Trap::Usage(UNDEFINED_INSTRUCTION)),
                15 => return Err(unknown()),
                condition => {
                    if self.holds(condition) {
                        self.jump(self.r[15].wrapping_add(sign_extend(imm8, 8) << 1));
                    }
                }
            },
            28 => self.jump(self.r[15].wrapping_add(sign_extend(op & 0x7FF, 11) << 1)),
            _ => return Err(unknown()),
        }
        Ok(())
    }

    /// Writes a result of a logical operation.
    #[inline]
    fn logic(&mut self, register: usize, value: u32, carry: bool, flags: bool) {
        if flags {
            self.set_nz(value);
            self.c = carry;
        }
        self.r[register] = value;
    }

    fn data_processing16(&mut self, op: u32, flags: bool) {
        let (low, second) = ((op & 7) as usize, (op >> 3 & 7) as usize);
        let (x, y) = (self.r[low], self.r[second]);
        let sum = |core: &mut Self, sum| core.r[low] = if flags { core.set_nzcv(sum) } else { sum.value };
        match op >> 6 & 15 {
            0 => self.logic(low, x & y, self.c, flags),
            1 => self.logic(low, x ^ y, self.c, flags),
            code @ (2 | 3 | 4 | 7) => {
                let kind = match code {
                    2 => Shift::Lsl,
                    3 => Shift::Lsr,
                    4 => Shift::Asr,
                    _ => Shift::Ror,
                };
                let (value, carry) = shift(kind, x, y & 0xFF, self.c);
                self.logic(low, value, carry, flags);
            }
            5 => sum(self, add_with_carry(x, y, self.c)),
            6 => sum(self, add_with_carry(x, !y, self.c)),
            8 => self.set_nz(x & y),
            9 => sum(self, add_with_carry(!y, 0, true)),
            10 => {
                self.set_nzcv(add_with_carry(x, !y, true));
            }
            11 => {
                self.set_nzcv(add_with_carry(x, y, false));
            }
            12 => self.logic(low, x | y, self.c, flags),
            13 => self.logic(low, x.wrapping_mul(y), self.c, flags),
            14 => self.logic(low, x & !y, self.c, flags),
            _ => self.logic(low, !y, self.c, flags),
        }
    }

    /// ADD, CMP, MOV of any registers; BX, BLX.
    fn special_data16<B: Bus + ?Sized>(&mut self, bus: &mut B, op: u32) -> Result<(), Trap> {
        let target = (op & 7 | op >> 4 & 8) as usize;
        let value = self.r[(op >> 3 & 15) as usize];
        match op >> 8 & 3 {
            0 => {
                let sum = self.r[target].wrapping_add(value);
                self.write_register(target, sum);
            }
            1 => {
                self.set_nzcv(add_with_carry(self.r[target], !value, true));
            }
            2 => self.write_register(target, value),
            _ => {
                if op & 0x80 != 0 {
                    self.r[14] = self.pc | 1;
                }
                self.jump_exchange(bus, value)?;
            }
        }
        Ok(())
    }

    /// Writes any register; the program counter jumps, the stack pointer keeps its two low bits clear.
    #[inline]
    fn write_register(&mut self, register: usize, value: u32) {
        match register {
            15 => self.jump(value),
            13 => self.r[13] = value & !3,
            _ => self.r[register] = value,
        }
    }

    fn miscellaneous16<B: Bus + ?Sized>(&mut self, bus: &mut B, op: u32) -> Result<(), Trap> {
        let (low, second) = ((op & 7) as usize, (op >> 3 & 7) as usize);
        match op >> 8 & 15 {
            0 => {
                let offset = (op & 0x7F) * 4;
                self.r[13] =
                    if op & 0x80 == 0 { self.r[13].wrapping_add(offset) } else { self.r[13].wrapping_sub(offset) };
            }
            // CBZ, CBNZ.
            1 | 3 | 9 | 11 => {
                let when_zero = op >> 11 & 1 == 0;
                if (self.r[low] == 0) == when_zero {
                    self.jump(self.r[15].wrapping_add((op >> 9 & 1) << 6 | (op >> 3 & 31) << 1));
                }
            }
            2 => {
                let value = self.r[second];
                self.r[low] = match op >> 6 & 3 {
                    0 => sign_extend(value, 16),
                    1 => sign_extend(value, 8),
                    2 => value & 0xFFFF,
                    _ => value & 0xFF,
                };
            }
            // PUSH.
            4 | 5 => {
                let list = op & 0xFF | (op >> 8 & 1) << 14;
                let mut address = self.r[13].wrapping_sub(4 * list.count_ones());
                let bottom = address;
                for i in (0..15).filter(|i| list >> i & 1 != 0) {
                    self.store(bus, address, 4, self.r[i])?;
                    address = address.wrapping_add(4);
                }
                self.r[13] = bottom;
            }
            // POP.
            12 | 13 => {
                let mut address = self.r[13];
                for i in (0..8).filter(|i| op >> i & 1 != 0) {
                    self.r[i] = self.load(bus, address, 4)?;
                    address = address.wrapping_add(4);
                }
                if op >> 8 & 1 != 0 {
                    let target = self.load(bus, address, 4)?;
                    self.r[13] = address.wrapping_add(4);
                    return self.jump_exchange(bus, target);
                }
                self.r[13] = address;
            }
            // CPS.
            6 if op & 0xE0 == 0x60 => {
                let disable = op >> 4 & 1 != 0;
                if op & 2 != 0 {
                    self.primask = disable;
                }
                if op & 1 != 0 {
                    self.faultmask = disable;
                }
                bus.system().attention = true;
            }
            10 => {
                let value = self.r[second];
                self.r[low] = match op >> 6 & 3 {
                    0 => value.swap_bytes(),
                    1 => value.swap_bytes().rotate_right(16),
                    3 => sign_extend(u32::from((value as u16).swap_bytes()), 16),
                    _ => return Err(unknown()),
                };
            }
            14 => return Err(Trap::unmodelled("breakpoint")),
            // IT.
            15 if op & 15 != 0 => self.it = op as u8,
            15 => self.hint(op >> 4 & 15)?,
            _ => return Err(unknown()),
        }
        Ok(())
    }

    /// NOP, YIELD, WFE, WFI, SEV.
    pub(super) fn hint(&mut self, hint: u32) -> Result<(), Trap> {
        match hint {
            0 | 1 => {}
            2 if self.event => self.event = false,
            2 => self.asleep = Sleep::Event,
            3 => self.asleep = Sleep::Interrupt,
            4 => self.event = true,
            _ => return Err(unknown()),
        }
        Ok(())
    }
}
