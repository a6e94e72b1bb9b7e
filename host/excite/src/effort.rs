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
            // A system that does not count gives zero, even for the thread that began the program.
            processor: spent("/proc/self/schedstat").is_some_and(|time| !time.is_zero()),
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

/// Returns the processor time of the calling thread, where the system tells it; zero if it has only begun.
fn processor_time() -> Option<Duration> {
    spent("/proc/thread-self/schedstat")
}

/// Returns the first number of a file of Linux's scheduler, ns.
fn spent(file: &str) -> Option<Duration> {
    let text = std::fs::read_to_string(file).ok()?;
    let nanoseconds = text.split_whitespace().next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// More threads than cores: the processor time of new threads does not exceed what all cores can give.
    #[test]
    fn waiting_threads_do_not_count_as_work() {
        let meter = Meter::new();
        if !meter.processor {
            println!("SKIPPED: this system does not tell the processor time of a thread.");
            return;
        }
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let count = 6 * cores;
        std::thread::scope(|scope| {
            for _ in 0..count {
                scope.spawn(|| {
                    meter.measure(|| {
                        let sum: f64 = (0..10_000_000).map(|k| f64::from(k).sqrt()).sum();
                        assert!(sum > 0.0);
                    });
                });
            }
        });
        let effort = meter.effort(count);
        println!("{:.2} of {cores} cores", effort.speed_up());
        assert!(effort.speed_up() < 1.5 * cores as f64);
    }
}
