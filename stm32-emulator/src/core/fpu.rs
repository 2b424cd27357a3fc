//! Single-precision floating point (DDI 0403E, A6; FPv4-SP).
//!
//! Rounding is to nearest even, denormals are kept: the state after reset. Another mode ends the run. Cumulative exception
//! flags are not kept: compiled Rust does not read them.

use super::{Bus, Core, NO_COPROCESSOR, Trap, unknown};

/// ARM's default not-a-number.
const DEFAULT_NAN: u32 = 0x7FC0_0000;
const QUIET: u32 = 1 << 22;

fn is_nan(bits: u32) -> bool {
    bits & 0x7FFF_FFFF > 0x7F80_0000
}

fn is_signalling(bits: u32) -> bool {
    is_nan(bits) && bits & QUIET == 0
}

/// Which not-a-number an operation passes on: the first signalling one, else the first quiet one, else the default one, which an
/// invalid operation makes (DDI 0403E, `FPProcessNaNs`).
fn passed_on(operands: &[u32]) -> u32 {
    let signalling = operands.iter().copied().find(|bits| is_signalling(*bits));
    signalling.or_else(|| operands.iter().copied().find(|bits| is_nan(*bits))).map_or(DEFAULT_NAN, |bits| bits | QUIET)
}

/// A result's bits; the host's own not-a-number is replaced by the core's.
fn result(value: f32, operands: &[u32]) -> u32 {
    if value.is_nan() { passed_on(operands) } else { value.to_bits() }
}

fn binary(operation: impl Fn(f32, f32) -> f32, x: u32, y: u32) -> u32 {
    result(operation(f32::from_bits(x), f32::from_bits(y)), &[x, y])
}

/// The sign is changed of any pattern, a not-a-number's too.
fn negated(bits: u32) -> u32 {
    bits ^ 1 << 31
}

/// Product, then sum, each rounded (VMLA, VMLS and their negated forms).
fn chained(addend: u32, x: u32, y: u32) -> u32 {
    binary(|a, b| a + b, addend, product(x, y))
}

fn product(x: u32, y: u32) -> u32 {
    binary(|a, b| a * b, x, y)
}

/// Rounded once (VFMA and its forms). Operands of the check for not-a-number come in ARM's order: addend first.
fn fused(addend: u32, x: u32, y: u32) -> u32 {
    let value = f32::from_bits(x).mul_add(f32::from_bits(y), f32::from_bits(addend));
    if value.is_nan() && !is_signalling(addend) && is_nan(addend) && !is_signalling(x) && !is_signalling(y) {
        // Infinity times zero is invalid, whatever quiet not-a-number is added.
        let invalid = f32::from_bits(x).is_infinite() && y << 1 == 0 || f32::from_bits(y).is_infinite() && x << 1 == 0;
        if invalid {
            return DEFAULT_NAN;
        }
    }
    result(value, &[addend, x, y])
}

/// The constant of VMOV immediate.
fn expand(immediate: u32) -> u32 {
    let exponent = if immediate >> 6 & 1 != 0 { 0x1F } else { 0x20 };
    (immediate >> 7 & 1) << 31 | exponent << 25 | (immediate & 0x3F) << 19
}

/// To an integer, limited at its ends; not-a-number is 0.
fn to_integer(value: f64, signed: bool, bits: i32) -> u32 {
    match (signed, bits) {
        (true, 32) => value as i32 as u32,
        (false, 32) => value as u32,
        (true, _) => i32::from(value as i16) as u32,
        (false, _) => u32::from(value as u16),
    }
}

impl Core {
    /// Executes an instruction of coprocessor 10 or 11.
    pub(super) fn execute_fpu<B: Bus + ?Sized>(&mut self, bus: &mut B, first: u32, second: u32) -> Result<(), Trap> {
        if second >> 9 & 7 != 5 || first >> 12 & 1 != 0 {
            return Err(unknown());
        }
        if bus.system().cpacr >> 20 & 15 != 15 {
            return Err(Trap::Usage(NO_COPROCESSOR));
        }
        self.save_deferred(bus)?;
        self.fp_active = true;
        let double = second >> 8 & 1 != 0;
        if first >> 9 & 1 == 0 {
            return self.fp_memory(bus, first, second, double);
        }
        if second >> 4 & 1 != 0 {
            return self.fp_transfer(first, second, double);
        }
        if double { Err(unknown()) } else { self.fp_data(first, second) }
    }

    /// Loads, stores, and moves of two core registers.
    fn fp_memory<B: Bus + ?Sized>(&mut self, bus: &mut B, first: u32, second: u32, double: bool) -> Result<(), Trap> {
        let bit = |position: u32| first >> position & 1 != 0;
        let (before, up, write_back, load) = (bit(8), bit(7), bit(5), bit(4));
        let n = (first & 15) as usize;
        let t = (second >> 12) as usize;
        let target =
            if double { ((first >> 6 & 1) << 4) as usize * 2 + t * 2 } else { t * 2 + (first >> 6 & 1) as usize };
        if !before && !up && !write_back {
            if !bit(6) {
                return Err(unknown());
            }
            let m = second & 15;
            let register =
                if double { ((second >> 5 & 1) << 4 | m) as usize * 2 } else { (m << 1 | second >> 5 & 1) as usize };
            let (Some(low), Some(high)) = (self.s.get(register).copied(), self.s.get(register + 1).copied()) else {
                return Err(unknown());
            };
            if load {
                (self.r[t], self.r[n]) = (low, high);
            } else {
                (self.s[register], self.s[register + 1]) = (self.r[t], self.r[n]);
            }
            return Ok(());
        }
        let offset = (second & 0xFF) * 4;
        let base = if n == 15 { self.r[15] & !3 } else { self.r[n] };
        let moved = if up { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
        let single = before && !write_back;
        let (start, words) = match (single, double) {
            (true, true) => (moved, 2),
            (true, false) => (moved, 1),
            (false, _) => (if before { moved } else { base }, (second & 0xFF) as usize),
        };
        let start = Self::aligned(start, 4)?;
        if target + words > 32 {
            return Err(unknown());
        }
        for i in 0..words {
            let address = start.wrapping_add(4 * i as u32);
            if load {
                self.s[target + i] = self.load(bus, address, 4)?;
            } else {
                self.store(bus, address, 4, self.s[target + i])?;
            }
        }
        if write_back {
            self.r[n] = moved;
        }
        Ok(())
    }

    /// VMOV between a core register and a single, VMRS, VMSR.
    fn fp_transfer(&mut self, first: u32, second: u32, double: bool) -> Result<(), Trap> {
        let t = (second >> 12) as usize;
        let single = ((first & 15) << 1 | second >> 7 & 1) as usize;
        match (first >> 5 & 7, first >> 4 & 1, double) {
            (0, 0, false) => self.s[single] = self.r[t],
            (0, 1, false) => self.r[t] = self.s[single],
            (7, 1, false) if t == 15 => {
                let flags = self.fpscr;
                let q = self.q;
                self.set_flags(flags);
                self.q = q;
            }
            (7, 1, false) => self.r[t] = self.fpscr,
            (7, 0, false) => {
                if self.r[t] & 0x07C0_0000 != 0 {
                    return Err(Trap::unmodelled("rounding or not-a-number mode of the FPU other than after reset"));
                }
                self.fpscr = self.r[t] & 0xF000_009F;
            }
            _ => return Err(unknown()),
        }
        Ok(())
    }

    fn fp_data(&mut self, first: u32, second: u32) -> Result<(), Trap> {
        let d = (second >> 12 << 1 | first >> 6 & 1) as usize;
        let x = self.s[((first & 15) << 1 | second >> 7 & 1) as usize];
        let m = ((second & 15) << 1 | second >> 5 & 1) as usize;
        let y = self.s[m];
        let second_form = second >> 6 & 1 != 0;
        let addend = self.s[d];
        self.s[d] = match (first >> 7 & 1) << 2 | first >> 4 & 3 {
            // VMLA, VMLS.
            0 => {
                self.cycles += 2;
                let value = product(x, y);
                let value = if second_form { negated(value) } else { value };
                binary(|a, b| a + b, addend, value)
            }
            // VNMLS, VNMLA.
            1 => {
                self.cycles += 2;
                if second_form {
                    binary(|a, b| a + b, negated(addend), negated(product(x, y)))
                } else {
                    chained(negated(addend), x, y)
                }
            }
            // VMUL, VNMUL.
            2 => {
                let value = product(x, y);
                if second_form { negated(value) } else { value }
            }
            // VADD, VSUB.
            3 if second_form => binary(|a, b| a - b, x, y),
            3 => binary(|a, b| a + b, x, y),
            // VDIV.
            4 if !second_form => {
                self.cycles += 13;
                binary(|a, b| a / b, x, y)
            }
            // VFNMS, VFNMA.
            5 => {
                self.cycles += 2;
                fused(negated(addend), if second_form { negated(x) } else { x }, y)
            }
            // VFMA, VFMS.
            6 => {
                self.cycles += 2;
                fused(addend, if second_form { negated(x) } else { x }, y)
            }
            7 if !second_form => expand((first & 15) << 4 | second & 15),
            7 => return self.fp_other(first, second, d, m),
            _ => return Err(unknown()),
        };
        Ok(())
    }

    /// VMOV, VABS, VNEG, VSQRT, VCMP, VCVT.
    fn fp_other(&mut self, first: u32, second: u32, d: usize, m: usize) -> Result<(), Trap> {
        let bit7 = second >> 7 & 1 != 0;
        let y = self.s[m];
        self.s[d] = match first & 15 {
            0 if bit7 => y & 0x7FFF_FFFF,
            0 => y,
            1 if bit7 => {
                self.cycles += 13;
                result(f32::from_bits(y).sqrt(), &[y])
            }
            1 => negated(y),
            code @ (4 | 5) => {
                let (x, y) = (f32::from_bits(self.s[d]), if code == 5 { 0.0 } else { f32::from_bits(y) });
                let flags = match x.partial_cmp(&y) {
                    None => 0b0011,
                    Some(std::cmp::Ordering::Equal) => 0b0110,
                    Some(std::cmp::Ordering::Less) => 0b1000,
                    Some(std::cmp::Ordering::Greater) => 0b0010,
                };
                self.fpscr = self.fpscr & 0x0FFF_FFFF | flags << 28;
                return Ok(());
            }
            // From an integer.
            8 if bit7 => (y as i32 as f32).to_bits(),
            8 => (y as f32).to_bits(),
            // To an integer: bit 7 rounds towards zero, otherwise by the mode, to nearest even.
            code @ (12 | 13) => {
                let value = f64::from(f32::from_bits(y));
                to_integer(if bit7 { value.trunc() } else { value.round_ties_even() }, code == 13, 32)
            }
            // Fixed point, in place.
            code @ (10 | 11 | 14 | 15) => {
                let bits = if bit7 { 32 } else { 16 };
                let fraction = bits - ((second & 15) << 1 | second >> 5 & 1) as i32;
                let scale = 2_f64.powi(fraction);
                let signed = code & 1 == 0;
                let x = self.s[d];
                if code & 4 == 0 {
                    let value = match (signed, bits) {
                        (true, 32) => f64::from(x as i32),
                        (false, 32) => f64::from(x),
                        (true, _) => f64::from(x as i16),
                        (false, _) => f64::from(x as u16),
                    };
                    ((value / scale) as f32).to_bits()
                } else {
                    to_integer(f64::from(f32::from_bits(x)) * scale, signed, bits)
                }
            }
            _ => return Err(unknown()),
        };
        Ok(())
    }
}
