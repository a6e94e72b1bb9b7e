//! Handles failures of the program: it switches the bridge off first, then the chip restarts.

// The compiler counts assembly that defines a symbol as unsafe code.
#![allow(unsafe_code)]

use core::arch::global_asm;
use core::panic::PanicInfo;

use embassy_stm32::pac::FLASH;

use super::pwm;

/// Handles a program error. The rig restarts disarmed and gives the reason in its health report.
#[panic_handler]
fn panic(_info: &PanicInfo) -> ! {
    fault()
}

/// `defmt`'s own assertions end here too.
#[defmt::panic_handler]
fn defmt_panic() -> ! {
    fault()
}

// A processor fault. The stack may be the cause, so it is first reset to its beginning. Nothing is saved, because this
// code never returns.
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

/// Handles a flash word of the stored settings with two wrong bits, caused by a supply failure while writing: it is
/// read unchanged, and the check sum detects it. Every other non-maskable interrupt is a fault.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    let flag = FLASH.eccr().read();
    if flag.eccd() && flag.bk_ecc() {
        // Writing one clears it.
        FLASH.eccr().modify(|w| w.set_eccd(true));
    } else {
        fault()
    }
}

/// An unexpected exception.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_number: i16) {
    fault()
}

extern "C" fn fault() -> ! {
    // This comes before the bridge is switched off: a control tick in between would switch it on again.
    cortex_m::interrupt::disable();
    pwm::switch_off();
    cortex_m::peripheral::SCB::sys_reset()
}
