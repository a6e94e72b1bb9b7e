//! When the program itself fails: the bridge goes off before anything else, then the chip starts anew.

// The compiler counts assembly that defines a symbol as unsafe code.
#![allow(unsafe_code)]

use core::arch::global_asm;
use core::panic::PanicInfo;

use super::pwm;

/// A program error. The rig starts again disarmed, and tells in its health report why.
#[panic_handler]
fn panic(_info: &PanicInfo) -> ! {
    pwm::off();
    cortex_m::interrupt::disable();
    cortex_m::peripheral::SCB::sys_reset()
}

/// `defmt`'s own assertions end here too.
#[defmt::panic_handler]
fn defmt_panic() -> ! {
    core::panic!()
}

// A fault of the processor. The stack may be what has failed, so it is set to its beginning first, and nothing
// is saved: nobody returns from here.
global_asm!(
    ".section .HardFault.rig, \"ax\"",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "ldr r0, =_stack_start",
    "msr msp, r0",
    "b {handler}",
    handler = sym fault,
);

extern "C" fn fault() -> ! {
    pwm::off();
    cortex_m::peripheral::SCB::sys_reset()
}
