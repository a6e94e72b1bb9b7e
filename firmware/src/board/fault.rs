//! Handles failures of the program: it switches the bridge off first, then records the failure, then the chip restarts.

// The compiler counts assembly that defines a symbol as unsafe code.
#![allow(unsafe_code)]

use core::arch::global_asm;
use core::panic::{Location, PanicInfo};

use embassy_stm32::pac::{FLASH, RCC};
use rig_shared::wire::message::CrashKind;

use super::{crash, pwm};

/// Handles a program error. The rig restarts disarmed and gives the reason in its health report.
#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    switch_off();
    let line = info.location().map_or(0, Location::line);
    restart(CrashKind::Panic, [0; 2], line)
}

/// `defmt`'s own assertions end here too.
#[defmt::panic_handler]
fn defmt_panic() -> ! {
    switch_off();
    restart(CrashKind::Panic, [0; 2], 0)
}

// A processor fault. The stack may be the cause, so it is first reset to its beginning; the first argument is the frame
// of the exception. Nothing is saved, because this code never returns.
global_asm!(
    ".section .HardFault.rig, \"ax\"",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "mrs r0, msp",
    "ldr r1, =_stack_start",
    "msr msp, r1",
    "b {handler}",
    handler = sym processor_fault,
);

extern "C" fn processor_fault(frame: *const u32) -> ! {
    switch_off();
    restart(CrashKind::ProcessorFault, crash::from_frame(frame), 0)
}

/// Handles a flash word of the stored settings with two wrong bits, caused by a supply failure while writing: it is
/// read unchanged, and the check sum detects it. Every other non-maskable interrupt is a fault.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    let flag = FLASH.eccr().read();
    if flag.eccd() && flag.bk_ecc() {
        // Writing one clears it.
        FLASH.eccr().modify(|w| w.set_eccd(true));
        return;
    }
    switch_off();
    let kind = if RCC.cifr().read().cssf() {
        CrashKind::ClockStopped
    } else {
        CrashKind::FlashError
    };
    restart(kind, [0; 2], 0)
}

/// An unexpected exception.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) {
    switch_off();
    restart(CrashKind::UnexpectedException, [0; 2], number as u32)
}

/// Switches the bridge off for good.
fn switch_off() {
    // This comes before the bridge is switched off: a control tick in between would switch it on again.
    cortex_m::interrupt::disable();
    pwm::switch_off();
}

fn restart(kind: CrashKind, place: [u32; 2], line: u32) -> ! {
    crash::record(kind, place, line);
    cortex_m::peripheral::SCB::sys_reset()
}
