//! Handles failures of the program: it switches the bridge off first, then records the failure, then the chip restarts.

// The compiler counts assembly that defines a symbol as unsafe code.
#![allow(unsafe_code)]

use core::arch::global_asm;
use core::panic::{Location, PanicInfo};

use cortex_m::peripheral::SCB;
use embassy_stm32::pac::{FLASH, RCC};
use rig_shared::wire::message::CrashKind;

use super::crash::{self, Failure};
use super::pwm;

/// Handles a program error. The rig restarts disarmed and gives file and line in its health report.
#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    switch_off();
    let location = info.location();
    restart(
        CrashKind::Panic,
        Failure {
            line: location.map_or(0, Location::line),
            file: location.map_or("", Location::file),
            ..Failure::default()
        },
    )
}

/// `defmt`'s own assertions end here too.
#[defmt::panic_handler]
fn defmt_panic() -> ! {
    switch_off();
    restart(CrashKind::Panic, Failure::default())
}

// A processor fault. The stack may be the cause, so it is first reset to its beginning; the first argument is the frame
// of the exception. Nothing is saved, because this code never returns.
//
// The two others pass on their frame: at their first instruction it is at the stack's end. They keep the link register,
// by which their handlers return from the exception.
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
    ".ltorg",
    ".global NonMaskableInt",
    ".type NonMaskableInt, %function",
    ".thumb_func",
    "NonMaskableInt:",
    "mrs r0, msp",
    "b {non_maskable}",
    ".global DefaultHandler",
    ".type DefaultHandler, %function",
    ".thumb_func",
    "DefaultHandler:",
    "mrs r0, msp",
    "b {unexpected}",
    handler = sym processor_fault,
    non_maskable = sym non_maskable,
    unexpected = sym unexpected,
);

extern "C" fn processor_fault(frame: *const u32) -> ! {
    switch_off();
    restart_from(CrashKind::ProcessorFault, frame, 0)
}

/// Handles a flash word of the stored settings with two wrong bits, caused by a supply failure while writing: it is
/// read unchanged, and the check sum detects it. Every other non-maskable interrupt is a fault.
extern "C" fn non_maskable(frame: *const u32) {
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
    restart_from(kind, frame, 0)
}

/// An unexpected exception; its number is that of the active vector.
extern "C" fn unexpected(frame: *const u32) {
    switch_off();
    // Reading it has no side effect.
    let active = unsafe { (*SCB::PTR).icsr.read() } & 0x1FF;
    restart_from(CrashKind::UnexpectedException, frame, active)
}

/// Switches the bridge off for good.
pub(super) fn switch_off() {
    // This comes before the bridge is switched off: a control tick in between would switch it on again.
    cortex_m::interrupt::disable();
    pwm::switch_off();
}

/// Records a failure in an exception with this frame, and restarts.
pub(super) fn restart_from(kind: CrashKind, frame: *const u32, line: u32) -> ! {
    restart(
        kind,
        Failure {
            place: crash::from_frame(frame),
            line,
            ..Failure::default()
        },
    )
}

fn restart(kind: CrashKind, failure: Failure<'_>) -> ! {
    crash::record(kind, failure);
    SCB::sys_reset()
}
