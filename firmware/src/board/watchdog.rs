//! The independent watchdog, fed only if every part of the program has reported since the last feeding.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use rig_shared::wire::message::{CrashKind, WATCHED_PARTS};

use super::crash::{self, Failure};

/// Longest silence of the tick or the telemetry, µs: a thousand control ticks.
const TIMEOUT_US: u32 = 100_000;
/// Feedings in a row that tasks without a deadline may miss. One prechecks a trajectory in up to 0.2 s, and the other
/// does not run meanwhile. At 100 feedings a second this is half a second.
const MAX_MISSED: u32 = 50;

/// Parts that report, one bit each, in the order of [`WATCHED_PARTS`].
#[derive(Clone, Copy)]
#[repr(u8)]
pub(crate) enum Task {
    /// The control interrupt.
    Tick = 1,
    /// The task that sends.
    Telemetry = 2,
    /// The task that receives.
    Receive = 4,
    /// The task that stores.
    Storage = 8,
    /// The task that prechecks.
    Precheck = 16,
}

const DEADLINE_TASKS: u8 = Task::Tick as u8 | Task::Telemetry as u8;
const ALL: u8 = DEADLINE_TASKS | Task::Receive as u8 | Task::Storage as u8 | Task::Precheck as u8;

const _: () = assert!(ALL as usize == (1 << WATCHED_PARTS.len()) - 1);

static CHECKED_IN: AtomicU8 = AtomicU8::new(0);

/// Reports that a task is alive.
#[inline(always)]
pub(crate) fn check_in(task: Task) {
    CHECKED_IN.fetch_or(task as u8, Ordering::Relaxed);
}

/// The watchdog.
pub(crate) struct Watchdog {
    missed: u32,
    /// True if parts were silent at the last feeding: they are recorded, because its reset comes without notice.
    recorded: bool,
    inner: IndependentWatchdog<'static, IWDG>,
}

impl Watchdog {
    /// Starts it. Only a reset stops it.
    pub(crate) fn start(peripheral: Peri<'static, IWDG>) -> Self {
        let mut inner = IndependentWatchdog::new(peripheral, TIMEOUT_US);
        inner.unleash();
        Self {
            missed: 0,
            recorded: false,
            inner,
        }
    }

    /// Feeds it if every part has reported. Parts without a deadline may report once in several feedings.
    pub(crate) fn feed(&mut self) {
        let reported = CHECKED_IN.load(Ordering::Relaxed);
        let all = reported & ALL == ALL;
        let late = !all && self.missed >= MAX_MISSED;
        if late || reported & DEADLINE_TASKS != DEADLINE_TASKS {
            let awaited = if late { ALL } else { DEADLINE_TASKS };
            let failure = Failure {
                silent: awaited & !reported,
                ..Failure::default()
            };
            crash::record(CrashKind::Watchdog, failure);
            self.recorded = true;
            return;
        }
        if self.recorded {
            crash::clear();
            self.recorded = false;
        }
        let clear = if all { ALL } else { DEADLINE_TASKS };
        CHECKED_IN.fetch_and(!clear, Ordering::Relaxed);
        self.missed = if all { 0 } else { self.missed + 1 };
        self.inner.pet();
    }
}
