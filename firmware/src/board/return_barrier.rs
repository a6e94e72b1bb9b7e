//! The end of interrupt handlers: no store may overlap their return (Cortex-M4 erratum 838869).
//!
//! A handler stores, and returns while the store is still in the write buffer. If an interrupt of higher priority comes at
//! that moment while another of lower priority is pending, the processor may lose the first and run the second twice. The
//! control tick interrupts all other handlers, so each of them needs the barrier for the tick not to be lost.
//!
//! Leaves out: the handler of the tasks' clock (TIM3), which is the library's own.

use embassy_stm32::interrupt::typelevel::{Handler, Interrupt};

/// Waits until all stores are complete. Call it last in a handler.
#[inline(always)]
pub(crate) fn finish_stores() {
    cortex_m::asm::dsb();
}

/// The same as a handler, to be bound as the last one of an interrupt.
pub(crate) struct ReturnBarrier;

impl<I: Interrupt> Handler<I> for ReturnBarrier {
    #[allow(unsafe_code)]
    #[inline(always)]
    unsafe fn on_interrupt() {
        finish_stores();
    }
}
