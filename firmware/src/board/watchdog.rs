//! The independent watchdog. It starts before anything else, so that a start that does not end is reset, and is fed only if
//! every part of the program has reported since the last feeding.

use core::sync::atomic::{AtomicU8, Ordering};

use embassy_stm32::pac::IWDG;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use rig_shared::wire::message::{CrashKind, WATCHED_PARTS};

use super::crash::{self, Failure};

/// Longest silence of the tick or the telemetry, and longest start, ms: a thousand control ticks. The wait for a crystal
/// that does not start is left out.
const TIMEOUT_MS: u32 = 100;
/// Counts of the watchdog in a ms: its oscillator of 32 kHz (DS12288, f_LSI: 31.04 to 32.96 kHz at 3 V, 30 °C) over 4.
const COUNTS_PER_MS: u32 = 8;
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
    /// The start of the program, until all tasks have reported.
    Start = 32,
}

const DEADLINE_TASKS: u8 = Task::Tick as u8 | Task::Telemetry as u8;
const ALL: u8 = DEADLINE_TASKS | Task::Receive as u8 | Task::Storage as u8 | Task::Precheck as u8;

const _: () = assert!((ALL | Task::Start as u8) as usize == (1 << WATCHED_PARTS.len()) - 1);

static CHECKED_IN: AtomicU8 = AtomicU8::new(0);

/// Reports that a task is alive.
#[inline(always)]
pub(crate) fn check_in(task: Task) {
    CHECKED_IN.fetch_or(task as u8, Ordering::Relaxed);
}

/// Starts the watchdog, with its oscillator. Only a reset stops it. Needs no clock of the bus and waits for nothing (RM0440,
/// IWDG, "Configuring the IWDG when the window option is disabled"; the registers take their values over some 0.2 ms, and
/// the longer time after a reset holds until then).
pub(crate) fn start() {
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    (IWDG.rlr()).write(|w| w.set_rl((TIMEOUT_MS * COUNTS_PER_MS - 1) as u16));
    feed();
}

/// Feeds it. The start does so in a wait that ends by a count.
pub(crate) fn feed() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}

/// Records that the program is starting, for the case that this does not end: the watchdog's reset comes without notice.
pub(crate) fn record_start() {
    let failure = Failure {
        silent: Task::Start as u8,
        ..Failure::default()
    };
    crash::record(CrashKind::Watchdog, failure);
}

/// The keeper of the watchdog once the tasks run.
pub(crate) struct Watchdog {
    missed: u32,
    /// True if parts were silent at the last feeding: they are recorded, because its reset comes without notice.
    recorded: bool,
}

impl Watchdog {
    /// Returns the keeper of the watchdog, which runs. The record of the start is forgotten at the first feeding.
    pub(crate) fn new() -> Self {
        Self {
            missed: 0,
            recorded: true,
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
        feed();
    }
}
