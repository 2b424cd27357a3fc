//! A sum over memory that must not change by itself.
//!
//! The control interrupt sums what a tick changes when it ends, and compares when it begins, a tick later: a bit that flips in
//! between is found before a valve code comes of it. The larger part, which only orders change, keeps a sum from order to
//! order, compared at the same time: a flip within the tick is found, too. One flipped bit always changes the sum; several
//! that cancel out are beyond it.

use core::arch::asm;

/// Sums the words of `region`: rotated by a bit, then added. Whole words only; what is left over is not covered.
///
/// In assembler for two reasons: the region holds padding, which Rust may not read, and sixteen words at a time take 38 cycles.
pub(crate) fn sum_of<T: ?Sized>(region: &T) -> u32 {
    // SAFETY: the words of a region that is borrowed.
    unsafe { sum_of_words(core::ptr::from_ref(region).cast(), size_of_val(region) / 4) }
}

/// A part of a region that a sum leaves out.
#[derive(Clone, Copy)]
pub(crate) struct Hole {
    start: usize,
    bytes: usize,
}

impl Hole {
    #[inline(always)]
    pub(crate) fn at<H>(part: &H) -> Self {
        Self { start: core::ptr::from_ref(part) as usize, bytes: size_of::<H>() }
    }

    /// The same two, the one that comes first before the other.
    #[inline(always)]
    fn in_order(a: Self, b: Self) -> (Self, Self) {
        if a.start <= b.start { (a, b) } else { (b, a) }
    }
}

/// The same without three parts that lie in `region`, apart from one another or at the same place.
#[inline(always)]
pub(crate) fn sum_around<T>(region: &T, [a, b, c]: [Hole; 3]) -> u32 {
    let (a, b) = Hole::in_order(a, b);
    let (b, c) = Hole::in_order(b, c);
    let (a, b) = Hole::in_order(a, b);
    let start = core::ptr::from_ref(region).cast::<u32>();
    let words = size_of::<T>() / 4;
    let (mut sum, mut at) = (0, 0);
    let end = Hole { start: start as usize + 4 * words, bytes: 0 };
    for hole in [a, b, c, end] {
        let from = (hole.start.wrapping_sub(start as usize) / 4).min(words);
        // SAFETY: a stretch of the region, which is borrowed: `at <= from <= words`, or it is empty.
        sum ^= unsafe { sum_of_words(start.wrapping_add(at), from.saturating_sub(at)) }.rotate_left(at as u32 % 32);
        at = at.max(from + hole.bytes / 4);
    }
    sum
}

/// # Safety
/// So many words from `start` on must be readable.
unsafe fn sum_of_words(start: *const u32, words: usize) -> u32 {
    let mut sum = 0_u32;
    let mut at = start;
    let blocks = words / 16;
    if blocks > 0 {
        // SAFETY: reads `16 * blocks` words of the region, which is borrowed and aligned to words.
        unsafe {
            asm!(
                "2:",
                ".rept 2",
                "ldmia {at}!, {{r0, r1, r2, r3, r4, r5, r8, r9}}",
                "add {sum}, r0, {sum}, ror #31",
                "add {sum}, r1, {sum}, ror #31",
                "add {sum}, r2, {sum}, ror #31",
                "add {sum}, r3, {sum}, ror #31",
                "add {sum}, r4, {sum}, ror #31",
                "add {sum}, r5, {sum}, ror #31",
                "add {sum}, r8, {sum}, ror #31",
                "add {sum}, r9, {sum}, ror #31",
                ".endr",
                "subs {blocks}, {blocks}, #1",
                "bne 2b",
                at = inout(reg) at,
                sum = inout(reg) sum,
                blocks = inout(reg) blocks => _,
                out("r0") _, out("r1") _, out("r2") _, out("r3") _, out("r4") _, out("r5") _, out("r8") _, out("r9") _,
                options(readonly, nostack),
            );
        }
    }
    for _ in 0..words % 16 / 4 {
        // SAFETY: reads four words behind the blocks, at most `words` in all.
        unsafe {
            asm!(
                "ldmia {at}!, {{r0, r1, r2, r3}}",
                "add {sum}, r0, {sum}, ror #31",
                "add {sum}, r1, {sum}, ror #31",
                "add {sum}, r2, {sum}, ror #31",
                "add {sum}, r3, {sum}, ror #31",
                at = inout(reg) at,
                sum = inout(reg) sum,
                out("r0") _, out("r1") _, out("r2") _, out("r3") _,
                options(readonly, nostack),
            );
        }
    }
    for _ in 0..words % 4 {
        // SAFETY: reads one word behind those, at most `words` in all.
        unsafe {
            asm!(
                "ldr {word}, [{at}], #4",
                "add {sum}, {word}, {sum}, ror #31",
                word = out(reg) _,
                at = inout(reg) at,
                sum = inout(reg) sum,
                options(readonly, nostack),
            );
        }
    }
    sum
}
