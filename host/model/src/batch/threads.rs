//! Shares the work on a recording among threads.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Samples of a block whose regressor stays in the cache.
pub const BLOCK: usize = 64;

/// Cuts `samples` into at most `threads` stretches of nearly equal length and runs `work` on all in parallel. Returns
/// the results in the order of the stretches. Cuts lie on multiples of [`BLOCK`]. So a result depends on the number of
/// threads only through the way in which the caller joins the parts.
///
/// With one thread (or few samples) `work` runs in the calling thread. A panic in `work` continues in the caller.
pub fn over_threads<R: Send>(
    samples: usize,
    threads: usize,
    work: impl Fn(Range<usize>) -> R + Sync,
) -> Vec<R> {
    let blocks = samples.div_ceil(BLOCK);
    let parts = threads.clamp(1, blocks.max(1));
    let cut = |part: usize| (blocks * part / parts * BLOCK).min(samples);
    let range = |part: usize| cut(part)..cut(part + 1);
    each_by(parts, parts, |part| work(range(part)))
}

/// Runs `work` on each of `items` pieces of unequal length, at most `threads` at a time. Returns the results in order.
///
/// With one thread `work` runs in the calling thread. A panic in `work` continues in the caller.
pub fn each_by<R: Send>(items: usize, threads: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_pieces_whoever_did_them() {
        let squares: Vec<usize> = (0..50).map(|k| k * k).collect();
        for threads in [0, 1, 2, 7, 80] {
            assert_eq!(each_by(50, threads, |k| k * k), squares);
        }
        assert!(each_by(0, 4, |k| k).is_empty());
        let stretches = over_threads(5 * BLOCK + 3, 3, |range| range);
        assert_eq!(stretches.len(), 3);
        let end = stretches.iter().fold(0, |end, range| {
            assert_eq!(range.start, end);
            range.end
        });
        assert_eq!(end, 5 * BLOCK + 3);
    }
}
