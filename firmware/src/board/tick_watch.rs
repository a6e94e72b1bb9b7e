//! The window watchdog watches the control tick alone, much faster than the independent watchdog watches all parts.
//!
//! Every fourth tick refreshes it. If it is not refreshed for 1.5 ms, because a tick hangs or its trigger does not come, the
//! early warning interrupts whatever runs: it switches the bridge off, records which code that was, and restarts the chip. It
//! is the only interrupt above the control tick. Where interrupts are disabled it cannot come; the watchdog's own reset follows
//! one count later and switches the bridge off likewise, without a record.
//!
//! A counter of seven bits counts the bus clock over 4096, 24.1 µs a count. It warns at 0x40 and resets at 0x3F (RM0440, WWDG,
//! "WWDG functional description"). Its window is not used: no tick is too early.

// The compiler counts assembly that defines a symbol as unsafe code.
#![allow(unsafe_code)]

use core::arch::global_asm;

use embassy_stm32::interrupt;
use embassy_stm32::interrupt::InterruptExt;
use embassy_stm32::pac::wwdg::vals::Wdgtb;
use embassy_stm32::pac::{RCC, WWDG};
use rig_shared::wire::message::CrashKind;

use super::clock::TICK_WATCH_PRIORITY;
use super::fault;

/// The counter at its start: 63 counts, 1.52 ms, before the warning. The divider runs freely, so the first may be short.
const FULL: u8 = 0x7F;

/// Starts the watch. Only a reset stops it.
pub(crate) fn start() {
    RCC.apb1enr1().modify(|w| w.set_wwdgen(true));
    refresh();
    WWDG.cfr().write(|w| {
        w.set_w(FULL);
        w.set_wdgtb(Wdgtb::DIV1);
        w.set_ewi(true);
    });
    interrupt::WWDG.set_priority(TICK_WATCH_PRIORITY);
    // Its handler owns nothing.
    unsafe {
        interrupt::WWDG.enable();
    }
}

/// Notes that control ticks end.
#[inline(always)]
pub(crate) fn refresh() {
    WWDG.cr().write(|w| {
        w.set_t(FULL);
        w.set_wdga(true);
    });
}

// The first argument is the frame of the exception, which at this instruction is at the stack's end.
global_asm!(
    ".section .text.WWDG, \"ax\"",
    ".global WWDG",
    ".type WWDG, %function",
    ".thumb_func",
    "WWDG:",
    "mrs r0, msp",
    "b {handler}",
    handler = sym warned,
);

extern "C" fn warned(frame: *const u32) -> ! {
    fault::switch_off();
    // Time to write the record.
    refresh();
    fault::restart_from(CrashKind::TickStopped, frame, 0)
}
