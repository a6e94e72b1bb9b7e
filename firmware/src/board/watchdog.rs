//! The independent watchdog, fed only when every part of the program has reported since the last time.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;

/// Longest silence of any part, µs: a thousand control ticks, and several times the slowest part's own period.
const PATIENCE_US: u32 = 100_000;

/// Parts that report, one bit each.
#[derive(Clone, Copy)]
#[repr(u8)]
pub(crate) enum Part {
    /// The control interrupt.
    Tick = 1,
    /// The task that sends.
    Telemetry = 2,
    /// The task that listens.
    Commands = 4,
}

const ALL: u8 = Part::Tick as u8 | Part::Telemetry as u8 | Part::Commands as u8;

static REPORTED: AtomicU8 = AtomicU8::new(0);

/// Says that a part is alive.
#[inline(always)]
pub(crate) fn report(part: Part) {
    REPORTED.fetch_or(part as u8, Ordering::Relaxed);
}

/// The watchdog.
pub(crate) struct Watchdog {
    inner: IndependentWatchdog<'static, IWDG>,
}

impl Watchdog {
    /// Starts it. Nothing but a reset stops it.
    pub(crate) fn start(peripheral: Peri<'static, IWDG>) -> Self {
        let mut inner = IndependentWatchdog::new(peripheral, PATIENCE_US);
        inner.unleash();
        Self { inner }
    }

    /// Feeds it if every part has reported.
    pub(crate) fn feed(&mut self) {
        if REPORTED.load(Ordering::Relaxed) == ALL {
            REPORTED.store(0, Ordering::Relaxed);
            self.inner.pet();
        }
    }
}
