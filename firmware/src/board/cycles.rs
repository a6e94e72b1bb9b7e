//! The processor's cycle counter.

use cortex_m::peripheral::{DCB, DWT};

/// Starts the counter; it wraps after 25 s.
pub(crate) fn start(dcb: &mut DCB, dwt: &mut DWT) {
    dcb.enable_trace();
    dwt.enable_cycle_counter();
}

/// Returns the cycle count; it wraps.
#[inline(always)]
pub(crate) fn now() -> u32 {
    DWT::cycle_count()
}
