//! A sum over memory that must not change by itself.
//!
//! The control interrupt sums what it owns when it ends and compares when it begins, a tick later: a bit that flips in
//! between is found before a valve code comes of it. The part that only orders change, the configuration, keeps a sum of its
//! own from order to order, so that a flip within the tick is found at its end. One flipped bit always changes the sum;
//! several that cancel out are beyond it.

use core::arch::asm;

/// Sums the words of `region`: rotated by a bit, then added. Whole words only; what is left over is not covered.
///
/// In assembler for two reasons: the region holds padding, which Rust may not read, and eight words at a time take 21 cycles.
pub(crate) fn sum_of<T: ?Sized>(region: &T) -> u32 {
    // SAFETY: the words of a region that is borrowed.
    unsafe { sum_of_words(core::ptr::from_ref(region).cast(), size_of_val(region) / 4) }
}

/// The same without `hole`, which lies in `region`.
#[inline(always)]
pub(crate) fn sum_around<T, H>(region: &T, hole: &H) -> u32 {
    let (start, inside) = (core::ptr::from_ref(region).cast::<u32>(), core::ptr::from_ref(hole).cast::<u32>());
    let before = (inside as usize).wrapping_sub(start as usize) / 4;
    let behind = before + size_of::<H>() / 4;
    // SAFETY: both stretches lie in the region, which is borrowed; a hole outside of it leaves the second one empty.
    unsafe {
        let rest = (size_of::<T>() / 4).saturating_sub(behind);
        sum_of_words(start, before.min(size_of::<T>() / 4))
            ^ sum_of_words(start.wrapping_add(behind), rest).rotate_left(1)
    }
}

/// # Safety
/// So many words from `start` on must be readable.
unsafe fn sum_of_words(start: *const u32, words: usize) -> u32 {
    let mut sum = 0_u32;
    let mut at = start;
    let blocks = words / 8;
    if blocks > 0 {
        // SAFETY: reads `8 * blocks` words of the region, which is borrowed and aligned to words.
        unsafe {
            asm!(
                "2:",
                "ldmia {at}!, {{r0, r1, r2, r3, r4, r5, r8, r9}}",
                "add {sum}, r0, {sum}, ror #31",
                "add {sum}, r1, {sum}, ror #31",
                "add {sum}, r2, {sum}, ror #31",
                "add {sum}, r3, {sum}, ror #31",
                "add {sum}, r4, {sum}, ror #31",
                "add {sum}, r5, {sum}, ror #31",
                "add {sum}, r8, {sum}, ror #31",
                "add {sum}, r9, {sum}, ror #31",
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
    for _ in 0..words % 8 {
        // SAFETY: reads one word behind the blocks, at most `words` in all.
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
