//! Use of the stack, which was painted before the program began.

use core::sync::atomic::{AtomicU32, Ordering};

/// Paint of `cortex-m-rt` (its feature `paint-stack`).
const PAINT: u32 = 0xcccc_cccc;
/// Bytes from the stack's end where the tick checks: room for one interrupt in addition to the deepest use so far.
const GUARD: usize = 1024;

// Symbols of memory.x; only their addresses are used.
#[allow(unsafe_code)]
unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

static FREE: AtomicU32 = AtomicU32::new(u32::MAX);

/// Returns true if a word, counted from the stack's end, was never used. Only the stack lies in this region.
#[inline(always)]
fn is_painted(word: usize) -> bool {
    let end = &raw const _stack_end;
    // Within the stack's own region; volatile, because the compiler does not see the use of the stack.
    #[allow(unsafe_code)]
    unsafe {
        end.add(word).read_volatile() == PAINT
    }
}

/// Returns the remaining bytes if the stack has reached its guard: four words, one in each tick, because a frame may skip
/// some that it does not write.
#[inline(always)]
pub(crate) fn near_end(tick: u64) -> Option<u32> {
    let word = GUARD / 4 + (tick as usize & 3);
    (!is_painted(word)).then_some(GUARD as u32)
}

/// Counts the bytes that were never used; slow.
pub(crate) fn measure_free() {
    let words = (&raw const _stack_start as usize - &raw const _stack_end as usize) / 4;
    let free = (0..words).take_while(|&word| is_painted(word)).count();
    FREE.store(4 * free as u32, Ordering::Relaxed);
}

/// Returns the bytes that were never used, at the last count.
#[inline(always)]
pub(crate) fn free() -> u32 {
    FREE.load(Ordering::Relaxed)
}
