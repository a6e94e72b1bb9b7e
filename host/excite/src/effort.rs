//! How much work the threads of a search did, and in which time.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Work of a search and the time that it took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Number of threads.
    pub threads: usize,
    /// Time from the start of the search to its end.
    pub wall: Duration,
    /// Sum over all threads of the time that they worked.
    pub work: Duration,
    /// True if `work` is processor time. Otherwise the system does not tell it, and `work` is elapsed time, which
    /// includes waiting for a processor.
    pub processor: bool,
}

impl Effort {
    /// Returns the work over the time: the mean number of threads that worked at the same time. It is the speed-up over
    /// one thread if a thread works as fast beside others as alone.
    pub fn speed_up(&self) -> f64 {
        self.work.as_secs_f64() / self.wall.as_secs_f64().max(f64::MIN_POSITIVE)
    }
}

/// Sums the work of threads.
pub(super) struct Meter {
    begun: Instant,
    work: AtomicU64,
    processor: bool,
}

impl Meter {
    pub(super) fn new() -> Self {
        Self {
            begun: Instant::now(),
            work: AtomicU64::new(0),
            processor: processor_time().is_some(),
        }
    }

    /// Runs a unit of work and adds its time.
    pub(super) fn measure<T>(&self, work: impl FnOnce() -> T) -> T {
        let (begun, before) = (Instant::now(), processor_time());
        let done = work();
        let spent = match (self.processor, before, processor_time()) {
            (true, Some(before), Some(after)) => after.saturating_sub(before),
            _ => begun.elapsed(),
        };
        let nanoseconds = u64::try_from(spent.as_nanos()).unwrap_or(u64::MAX);
        self.work.fetch_add(nanoseconds, Ordering::Relaxed);
        done
    }

    pub(super) fn effort(&self, threads: usize) -> Effort {
        Effort {
            threads,
            wall: self.begun.elapsed(),
            work: Duration::from_nanos(self.work.load(Ordering::Relaxed)),
            processor: self.processor,
        }
    }
}

/// Returns the processor time of the calling thread, where the system tells it: the first number of Linux's
/// `/proc/thread-self/schedstat`, ns.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: u64 = text.split_whitespace().next()?.parse().ok()?;
    (nanoseconds > 0).then(|| Duration::from_nanos(nanoseconds))
}
