//! Work on a recording shared among threads.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use super::BLOCK;

/// Cuts `samples` into at most `threads` stretches of nearly equal length, runs `work` on each in its own thread and
/// gives the results in the order of the stretches. Cuts lie on multiples of [`BLOCK`], so a result does not
/// depend on the number of threads save through the caller's own way of joining the parts.
///
/// With one thread (or few samples) `work` runs in the calling thread. A panic in `work` goes on in the caller.
pub fn over_threads<R: Send>(
    samples: usize,
    threads: usize,
    work: impl Fn(Range<usize>) -> R + Sync,
) -> Vec<R> {
    let blocks = samples.div_ceil(BLOCK);
    let parts = threads.clamp(1, blocks.max(1));
    let cut = |part: usize| (blocks * part / parts * BLOCK).min(samples);
    let range = |part: usize| cut(part)..cut(part + 1);
    if parts == 1 {
        return vec![work(0..samples)];
    }
    thread::scope(|scope| {
        let work = &work;
        let others: Vec<_> = (1..parts)
            .map(|part| scope.spawn(move || work(range(part))))
            .collect();
        let mut results = vec![work(range(0))];
        for other in others {
            match other.join() {
                Ok(result) => results.push(result),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        results
    })
}

/// Runs `work` on each of `items` pieces of unequal length, at most `threads` at a time, and gives the results in their order.
///
/// With one thread `work` runs in the calling thread. A panic in `work` goes on in the caller.
pub fn each_by<R: Send>(threads: usize, items: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let mine = || {
        let mut done = Vec::new();
        loop {
            let item = next.fetch_add(1, Ordering::Relaxed);
            if item >= items {
                return done;
            }
            done.push((item, work(item)));
        }
    };
    let mut done = thread::scope(|scope| {
        let others: Vec<_> = (1..threads.min(items)).map(|_| scope.spawn(mine)).collect();
        let mut all = mine();
        for other in others {
            match other.join() {
                Ok(more) => all.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        all
    });
    done.sort_by_key(|(item, _)| *item);
    done.into_iter().map(|(_, result)| result).collect()
}
