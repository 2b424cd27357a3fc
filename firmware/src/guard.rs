//! A sum over memory that must not change by itself.
//!
//! The control interrupt sums what it owns when it ends and compares when it begins, a tick later: a bit that flips in
//! between is found before a valve code comes of it. The part that only orders change, the configuration, keeps a sum of its
//! own from order to order, so that a flip within the tick is found in the next. One flipped bit always changes the sum;
//! several that cancel out are beyond it.

use core::arch::asm;

/// Sums the words of `region`: rotated by a bit, then added. Whole words only; what is left over is not covered.
///
/// In assembler for two reasons: the region holds padding, which Rust may not read, and eight words at a time take 21 cycles.
pub(crate) fn sum_of<T: ?Sized>(region: &T) -> u32 {
    let words = size_of_val(region) / 4;
    let start = core::ptr::from_ref(region).cast::<u32>();
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
