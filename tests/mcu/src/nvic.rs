//! Exceptions and the system control space (ARMv7-M ARM DDI 0403E, B1.5 and B3): priorities, preemption,
//! pending and enable bits, SysTick, system control block.
//!
//! Left out: the MPU's effect (its registers are storage, and switching it on is refused), fault handlers
//! other than HardFault (everything escalates unless they are enabled, which is refused), debug.

mod controller;
mod registers;
#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod test;

pub use controller::{HARD_FAULT, INTERRUPTS, Nvic, PEND_SV, SV_CALL, SYS_TICK};
