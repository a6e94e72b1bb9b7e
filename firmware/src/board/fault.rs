//! When the program itself fails: the bridge goes off before anything else, then the chip starts anew.

// The compiler counts assembly that defines a symbol as unsafe code.
#![allow(unsafe_code)]

use core::arch::global_asm;
use core::panic::PanicInfo;

use embassy_stm32::pac::FLASH;

use super::pwm;

/// A program error. The rig starts again disarmed, and tells in its health report why.
#[panic_handler]
fn panic(_info: &PanicInfo) -> ! {
    fault()
}

/// `defmt`'s own assertions end here too.
#[defmt::panic_handler]
fn defmt_panic() -> ! {
    fault()
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

/// A flash word of the stored settings that has two wrong bits, as a supply that failed while it was written
/// leaves it, is read as it is: the check sum finds it. Every other non-maskable interrupt is a fault.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    let flag = FLASH.eccr().read();
    if flag.eccd() && flag.bk_ecc() {
        // Written with one it is cleared.
        FLASH.eccr().modify(|w| w.set_eccd(true));
    } else {
        fault()
    }
}

/// An exception that nobody has asked for.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_number: i16) {
    fault()
}

extern "C" fn fault() -> ! {
    // One instruction, before the bridge: a control tick in between would switch it on again.
    cortex_m::interrupt::disable();
    pwm::off();
    cortex_m::peripheral::SCB::sys_reset()
}
