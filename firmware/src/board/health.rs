//! The health report and the cycle count of the ticks.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::pac::RCC;
use rig_firmware::event::BoardMeasurement;
use rig_shared::wire::message::{ResetCause, StopSwitchState};

use super::clock;
use super::pins::StopInput;
use super::stack;

/// Damaged requests; counted by the command task.
pub(crate) static BAD_REQUESTS: AtomicU32 = AtomicU32::new(0);

/// Errors of the serial line: bytes with a framing or noise error, and bytes lost for lack of room.
pub(crate) static LINE_ERRORS: AtomicU32 = AtomicU32::new(0);

/// Cycles of the ticks since the last report.
pub(crate) struct HealthMonitor {
    report_ticks: u32,
    ticks: u32,
    sum: u32,
    max: u32,
}

impl HealthMonitor {
    /// Makes a report after every `report_ticks` ticks.
    pub(crate) fn new(report_ticks: u32) -> Self {
        Self {
            report_ticks,
            ticks: 0,
            sum: 0,
            max: 0,
        }
    }

    /// Counts a tick; returns the report if it is due. `tick` is its number, `dropped` the windows lost so far.
    #[inline(always)]
    pub(crate) fn record_tick(
        &mut self,
        cycles: u32,
        (tick, dropped): (u64, u32),
        stop_switch: &StopInput,
    ) -> Option<BoardMeasurement> {
        self.ticks += 1;
        // Of a second: a tick is shorter than its period, so the sum is far below 2³².
        self.sum = self.sum.wrapping_add(cycles);
        self.max = self.max.max(cycles);
        if self.ticks < self.report_ticks {
            return None;
        }
        let measured = BoardMeasurement {
            tick,
            boost: clock::is_boosted(),
            tick_cycles_max: self.max,
            tick_cycles_mean: self.sum / self.ticks.max(1),
            stack_free: stack::free(),
            bad_requests: BAD_REQUESTS.load(Ordering::Relaxed),
            line_errors: LINE_ERRORS.load(Ordering::Relaxed),
            dropped,
            stop_switch: match (stop_switch.is_fitted(), stop_switch.is_open()) {
                (false, _) => StopSwitchState::NotFitted,
                (true, false) => StopSwitchState::Closed,
                (true, true) => StopSwitchState::Open,
            },
        };
        *self = Self::new(self.report_ticks);
        Some(measured)
    }
}

/// Returns the cause of the last reset and clears it, so that the next start reads only its own cause.
pub(crate) fn reset_cause() -> ResetCause {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // Every internal reset pulls the reset pin low too, so the pin is tested last (RM0440, RCC, "System reset").
    if flags.iwdgrstf() || flags.wwdgrstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.borrstf() {
        ResetCause::Power
    } else if flags.lpwrrstf() || flags.oblrstf() {
        ResetCause::Other
    } else {
        ResetCause::Pin
    }
}
