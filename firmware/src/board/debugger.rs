//! Halts of the processor by a debugger.
//!
//! Meanwhile TIM1 stands, and its outputs are inactive, as if the main output were off (RM0440, TIM1, "Debug mode"; with
//! OSSI set they are at their idle level, low: the motor is open). TIM4, which triggers the samples, stands with it, so that
//! both keep their phase. The watchdogs stand too. The encoder's timers go on: the link may move.
//!
//! The control tick stands as well and notices nothing. The processor notes the halt in DFSR; at the next look, 10 ms later
//! at most, the cycle counter, which stood too, is moved on. The control tick then finds that it is late, which is the
//! fault `Deadline`.

use cortex_m::peripheral::{DWT, SCB};
use embassy_stm32::pac::DBGMCU;
use rig_firmware::nameplate::RATES;

use super::clock::CORE_HZ;

/// DFSR: halt request, breakpoint, watchpoint, vector catch, external request (Armv7-M ARM, B3.2.22). Writing ones clears
/// them.
const HALTED: u32 = 0x1F;

/// Periods by which the cycle counter is moved on: more than two and a half are two late ticks, which are the fault.
const LATE_PERIODS: u32 = 4;

/// Makes halts safe. Forgets halts before the start, as of a debugger that has flashed the chip.
pub(crate) fn freeze_outputs_at_halts() {
    DBGMCU.apb2fzr().modify(|w| w.set_tim1(true));
    DBGMCU.apb1lfzr().modify(|w| {
        w.set_tim4(true);
        w.set_iwdg(true);
        w.set_wwdg(true);
    });
    take_halt();
}

/// Returns true if the processor was halted since the last call.
fn take_halt() -> bool {
    // The register of its own, read and cleared by one task at a time.
    #[allow(unsafe_code)]
    let register = unsafe { &(*SCB::PTR).dfsr };
    let halted = register.read() & HALTED;
    if halted == 0 {
        return false;
    }
    // Writing ones clears; the register has nothing else.
    #[allow(unsafe_code)]
    unsafe {
        register.write(halted);
    }
    true
}

/// Lets the control tick find that it is late, if the processor was halted since the last call.
pub(crate) fn tell_halts() {
    if !take_halt() {
        return;
    }
    defmt::warn!("the processor was halted by a debugger");
    let moved = DWT::cycle_count().wrapping_add(LATE_PERIODS * (CORE_HZ / RATES.control_hz));
    // A count may be written at any time (Armv7-M ARM, C1.8.8).
    #[allow(unsafe_code)]
    unsafe {
        (*DWT::PTR).cyccnt.write(moved);
    }
}
