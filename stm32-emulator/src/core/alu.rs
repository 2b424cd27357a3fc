//! Arithmetic of the core without state: what ARM's manual (DDI 0403E, A2.2 and A7.4) calls pseudocode functions.

/// A sum with the flags that it sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sum {
    /// The lower 32 bits.
    pub value: u32,
    /// Carry out: for a subtraction, "no borrow".
    pub carry: bool,
    /// Signed overflow.
    pub overflow: bool,
}

/// `x + y + carry`. A subtraction is `x + !y + 1`.
#[inline]
#[must_use]
pub fn add_with_carry(x: u32, y: u32, carry: bool) -> Sum {
    let wide = u64::from(x) + u64::from(y) + u64::from(carry);
    let value = wide as u32;
    Sum { value, carry: wide >> 32 != 0, overflow: (!(x ^ y) & (x ^ value)) >> 31 != 0 }
}

/// Kinds of shifts, in the order of their two-bit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shift {
    /// Logical left.
    Lsl,
    /// Logical right.
    Lsr,
    /// Arithmetic right.
    Asr,
    /// Rotate right.
    Ror,
}

impl Shift {
    /// From a two-bit field; higher bits are ignored.
    #[inline]
    #[must_use]
    pub fn from_bits(bits: u32) -> Self {
        match bits & 3 {
            0 => Self::Lsl,
            1 => Self::Lsr,
            2 => Self::Asr,
            _ => Self::Ror,
        }
    }
}

/// Shift by a number from a register, 0..=255: the value and the carry.
#[inline]
#[must_use]
pub fn shift(kind: Shift, value: u32, amount: u32, carry: bool) -> (u32, bool) {
    if amount == 0 {
        return (value, carry);
    }
    match kind {
        Shift::Lsl if amount < 32 => (value << amount, value >> (32 - amount) & 1 != 0),
        Shift::Lsl => (0, amount == 32 && value & 1 != 0),
        Shift::Lsr if amount < 32 => (value >> amount, value >> (amount - 1) & 1 != 0),
        Shift::Lsr => (0, amount == 32 && value >> 31 != 0),
        Shift::Asr if amount < 32 => ((value as i32 >> amount) as u32, value >> (amount - 1) & 1 != 0),
        Shift::Asr => ((value as i32 >> 31) as u32, value >> 31 != 0),
        Shift::Ror => {
            let rotated = value.rotate_right(amount & 31);
            (rotated, rotated >> 31 != 0)
        }
    }
}

/// Shift by a five-bit immediate, in which 0 means 32 for the right shifts and "through carry by one" for the rotation.
#[inline]
#[must_use]
pub fn shift_immediate(kind: Shift, value: u32, amount: u32, carry: bool) -> (u32, bool) {
    match (kind, amount) {
        (Shift::Lsl, 0) => (value, carry),
        (Shift::Lsr | Shift::Asr, 0) => shift(kind, value, 32, carry),
        (Shift::Ror, 0) => (u32::from(carry) << 31 | value >> 1, value & 1 != 0),
        _ => shift(kind, value, amount, carry),
    }
}

/// The 32-bit constant of a 12-bit modified immediate, and the carry.
#[inline]
#[must_use]
pub fn expand_immediate(immediate: u32, carry: bool) -> (u32, bool) {
    let byte = immediate & 0xFF;
    if immediate >> 10 == 0 {
        let value = match immediate >> 8 & 3 {
            0 => byte,
            1 => byte << 16 | byte,
            2 => byte << 24 | byte << 8,
            _ => byte * 0x0101_0101,
        };
        (value, carry)
    } else {
        let value = (0x80 | immediate & 0x7F).rotate_right(immediate >> 7);
        (value, value >> 31 != 0)
    }
}

/// Limits to a signed number of `bits` bits, 1..=32; whether it had to.
#[inline]
#[must_use]
pub fn saturate_signed(value: i64, bits: u32) -> (u32, bool) {
    let high = (1_i64 << (bits - 1)) - 1;
    let limited = value.clamp(-high - 1, high);
    (limited as u32, limited != value)
}

/// Limits to an unsigned number of `bits` bits, 0..=31; whether it had to.
#[inline]
#[must_use]
pub fn saturate_unsigned(value: i64, bits: u32) -> (u32, bool) {
    let limited = value.clamp(0, (1_i64 << bits) - 1);
    (limited as u32, limited != value)
}

/// Sign-extends the lowest `bits` bits, 1..=32.
#[inline]
#[must_use]
pub fn sign_extend(value: u32, bits: u32) -> u32 {
    ((value << (32 - bits)) as i32 >> (32 - bits)) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_carry_and_overflow_as_the_manual_says() {
        for (x, y, carry_in, value, carry, overflow) in [
            (0, 0, false, 0, false, false),
            (u32::MAX, 1, false, 0, true, false),
            (0x7FFF_FFFF, 1, false, 0x8000_0000, false, true),
            (0x8000_0000, 0x8000_0000, false, 0, true, true),
            (5, !3, true, 2, true, false),
            (3, !5, true, 0xFFFF_FFFE, false, false),
            (0x8000_0000, !1, true, 0x7FFF_FFFF, true, true),
        ] {
            assert_eq!(add_with_carry(x, y, carry_in), Sum { value, carry, overflow }, "{x:#x} + {y:#x}");
        }
    }

    #[test]
    fn shifts_by_register_end_where_the_word_ends() {
        use Shift::{Asr, Lsl, Lsr, Ror};
        for (kind, value, amount, result, carry) in [
            (Lsl, 0x8000_0001, 1, 2, true),
            (Lsl, 1, 32, 0, true),
            (Lsl, 1, 33, 0, false),
            (Lsr, 0x8000_0000, 32, 0, true),
            (Lsr, 0x8000_0000, 33, 0, false),
            (Lsr, 3, 1, 1, true),
            (Asr, 0x8000_0000, 31, 0xFFFF_FFFF, false),
            (Asr, 0x8000_0000, 200, 0xFFFF_FFFF, true),
            (Ror, 1, 1, 0x8000_0000, true),
            (Ror, 0x8000_0000, 32, 0x8000_0000, true),
            (Ror, 1, 32, 1, false),
        ] {
            assert_eq!(shift(kind, value, amount, false), (result, carry), "{kind:?} {value:#x} by {amount}");
        }
        assert_eq!(shift(Shift::Lsr, 7, 0, true), (7, true), "no shift keeps the carry");
        assert_eq!(shift_immediate(Shift::Ror, 3, 0, true), (0x8000_0001, true), "rotation through carry");
        assert_eq!(shift_immediate(Shift::Asr, 0x8000_0000, 0, false), (u32::MAX, true), "zero means 32");
    }

    #[test]
    fn modified_immediates_expand() {
        for (immediate, value) in [
            (0x0AB, 0xAB),
            (0x1AB, 0x00AB_00AB),
            (0x2AB, 0xAB00_AB00),
            (0x3AB, 0xABAB_ABAB),
            (0x4AB, 0x5580_0000),
            (0xFAB, 0x156),
            (0x400, 0x8000_0000),
        ] {
            let (expanded, _) = expand_immediate(immediate, false);
            if immediate == 0x4AB {
                assert_eq!(expanded, (0x80_u32 | 0x2B).rotate_right(9));
            } else {
                assert_eq!(expanded, value, "{immediate:#x}");
            }
        }
    }

    #[test]
    fn saturation_says_when_it_limits() {
        assert_eq!(saturate_signed(40_000, 16), (32_767, true));
        assert_eq!(saturate_signed(-40_000, 16), ((-32_768_i32) as u32, true));
        assert_eq!(saturate_signed(-5, 16), ((-5_i32) as u32, false));
        assert_eq!(saturate_unsigned(-5, 8), (0, true));
        assert_eq!(saturate_unsigned(300, 8), (255, true));
        assert_eq!(saturate_unsigned(255, 8), (255, false));
        assert_eq!(sign_extend(0x80, 8), 0xFFFF_FF80);
    }
}
